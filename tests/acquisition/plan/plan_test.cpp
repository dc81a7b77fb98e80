#include "acquisition/plan/plan.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

namespace {

Plan read(const char* text) {
  const auto plan = readPlan(text);
  if (!plan) QTest::qFail(plan.error().message.c_str(), __FILE__, __LINE__);
  return plan.value_or(Plan{});
}

std::vector<int> nodesOf(const std::vector<PlannedPlace>& all) {
  std::vector<int> nodes;
  for (const PlannedPlace& place : all) nodes.push_back(place.node);
  return nodes;
}

}  // namespace

class PlanTest : public QObject {
  Q_OBJECT
 private slots:
  void textIsRead() {
    const Plan plan = read(
        "grid:5x4x3@0.3048x0.25x0.2:origin=0.5,-1,2e-1:order=random:seed=18446744073709551615"
        ":orientations=3:reseat=2");
    QCOMPARE(plan.counts, (std::array<int, 3>{5, 4, 3}));
    QCOMPARE(plan.pitch_m, Eigen::Vector3d(0.3048, 0.25, 0.2));
    QVERIFY(plan.origin_m);
    QCOMPARE(*plan.origin_m, Eigen::Vector3d(0.5, -1.0, 0.2));
    QVERIFY(plan.order == PlanOrder::kRandom);
    QCOMPARE(plan.seed, UINT64_MAX);
    QCOMPARE(plan.orientations, 3);
    QCOMPARE(plan.reseat, 2);
    QCOMPARE(read("grid:2x2x2@0.5").pitch_m, Eigen::Vector3d(0.5, 0.5, 0.5));
    QVERIFY(!read("grid:2x2x2@0.5").origin_m);
  }

  void badTextIsNamed_data() {
    QTest::addColumn<QString>("text");
    QTest::addColumn<QString>("expected");
    QTest::newRow("two counts") << "grid:5x5@0.3"
                                << "grid:5x5@0.3: expected NXxNYxNZ, got 5x5 (at character 6)";
    QTest::newRow("no pitch") << "grid:5x5x4"
                              << "expected NXxNYxNZ@PX or NXxNYxNZ@PXxPYxPZ, got 5x5x4 (at character 6)";
    QTest::newRow("nothing") << "grid:"
                             << "got nothing (at character 6)";
    QTest::newRow("zero count") << "grid:5x0x4@0.3"
                                << "expected a count from 1 to 100000, got 0 (at character 8)";
    QTest::newRow("fraction") << "grid:5x1.5x4@0.3"
                              << "got 1.5 (at character 8)";
    QTest::newRow("two pitches") << "grid:5x5x4@0.3x0.3"
                                 << "expected PX or PXxPYxPZ in metres, got 0.3x0.3";
    QTest::newRow("no number") << "grid:5x5x4@one"
                               << "expected a pitch from 0.0001 to 1000 m, got one (at character 12)";
    QTest::newRow("NaN pitch") << "grid:5x5x4@nan"
                               << "got nan";
    QTest::newRow("negative pitch") << "grid:5x5x4@-1"
                                    << "got -1";
    QTest::newRow("short origin") << "grid:5x5x4@0.3:origin=1,2"
                                  << "expected x,y,z in metres after origin=, got 1,2";
    QTest::newRow("infinite origin") << "grid:5x5x4@0.3:origin=1,inf,2"
                                     << "got inf (at character 25)";
    QTest::newRow("order") << "grid:5x5x4@0.3:order=spiral"
                           << "expected order serpentine or random, got spiral";
    QTest::newRow("seed") << "grid:5x5x4@0.3:seed=-1"
                          << "expected seed as a whole number from 0, got -1";
    QTest::newRow("orientations") << "grid:5x5x4@0.3:orientations=25"
                                  << "expected orientations from 1 to 24, got 25";
    QTest::newRow("reseat") << "grid:5x5x4@0.3:reseat=0"
                            << "expected reseat from 1 to 1000, got 0";
    QTest::newRow("unknown key") << "grid:5x5x4@0.3:pitch=2"
                                 << "orientations= or reseat=, got pitch=2 (at character 16)";
    QTest::newRow("no value") << "grid:5x5x4@0.3:seed"
                              << "got seed (at character 16)";
    QTest::newRow("twice") << "grid:5x5x4@0.3:seed=1:seed=2"
                           << "expected seed= only once";
    QTest::newRow("too many") << "grid:1000x1000x1@0.3"
                              << "more than 100000 stops";
    QTest::newRow("far too many") << "grid:100000x100000x100000@0.3:orientations=24:reseat=1000"
                                  << "more than 100000 stops";
    QTest::newRow("visits") << "grid:50x50x40@0.3:reseat=2"
                            << "more than 100000 stops";
    QTest::newRow("neither") << "5x5x4@0.3"
                             << "expected grid:NXxNYxNZ@PX... or the path of a *.plan.json";
  }
  void badTextIsNamed() {
    QFETCH(QString, text);
    QFETCH(QString, expected);
    const auto plan = readPlan(text.toStdString());
    QVERIFY(!plan);
    QVERIFY(plan.error().code == ErrorCode::kBadInput);
    const QString message = QString::fromStdString(plan.error().message);
    QVERIFY2(message.contains(expected), qPrintable(message));
  }

  void largestPlanIsAllowed() { QCOMPARE(places(read("grid:50x50x40@0.3")).size(), std::size_t{100000}); }

  void defaultOriginStandsBeforeTheTransmitter() {
    const Plan plan = read("grid:5x4x3@0.4x0.5x0.6");
    // First column 1.5 pitches out; y: half of 3 pitches of 0.5; z: half of 2 pitches of 0.6.
    QVERIFY2(testing::near(origin_m(plan), {0.6, -0.75, -0.6}, 1e-12), "origin");
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    const auto all = places(plan);
    for (const PlannedPlace& place : all) centre += place.reference_from_sensor.position_m / double(all.size());
    QVERIFY2(testing::near(centre, {0.6 + 2 * 0.4, 0.0, 0.0}, 1e-12), "centre");
  }

  void serpentineNeverJumps_data() {
    QTest::addColumn<QString>("text");
    QTest::addColumn<int>("pipe_changes");
    QTest::newRow("odd rows") << "grid:3x3x2@0.3" << 1;
    QTest::newRow("even rows") << "grid:4x2x3@0.3" << 2;
    QTest::newRow("visits") << "grid:3x2x3@0.3:orientations=2:reseat=2" << 2;
    QTest::newRow("one level") << "grid:5x5x1@0.3" << 0;
  }
  void serpentineNeverJumps() {
    QFETCH(QString, text);
    QFETCH(int, pipe_changes);
    const auto all = places(read(qPrintable(text)));
    int changes = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
      const Eigen::Vector3d step_m =
          all[i].reference_from_sensor.position_m - all[i - 1].reference_from_sensor.position_m;
      QVERIFY2(step_m.norm() < 0.3 + 1e-12, "one pitch at most to the next place");
      changes += (*all[i].index)[2] != (*all[i - 1].index)[2];
    }
    QCOMPARE(changes, pipe_changes);
  }

  void serpentineByHand() {
    QCOMPARE(nodesOf(places(read("grid:3x2x2@0.3"))), (std::vector<int>{0, 1, 2, 5, 4, 3, 9, 10, 11, 8, 7, 6}));
  }

  void everyVisitAppearsOnce_data() {
    QTest::addColumn<QString>("order");
    QTest::newRow("serpentine") << "serpentine";
    QTest::newRow("random") << "random";
  }
  void everyVisitAppearsOnce() {
    QFETCH(QString, order);
    const auto all = places(read(qPrintable("grid:3x2x2@0.3:orientations=3:reseat=2:order=" + order)));
    QCOMPARE(all.size(), std::size_t{12} * 6);
    std::set<std::pair<int, int>> seen;
    for (const PlannedPlace& place : all) {
      QVERIFY(place.node >= 0 && place.node < 12 && place.visit >= 0 && place.visit < 6);
      QVERIFY(seen.insert({place.node, place.visit}).second);
      const Eigen::Quaterniond& turned = place.reference_from_sensor.orientation;
      QVERIFY2(testing::near(turned, planOrientation(place.visit / 2), 1e-12), "visit = orientation * reseat + repeat");
    }
  }

  void randomOrderIsTheSameEverywhere() {
    // std::mt19937_64 is fixed by the standard: its first draws with seed 1 are 2469588189546311528,
    // 2516265689700432462 and 8323445853463659930. Fisher-Yates from the back over 4 places: draws mod 4, 3, 2.
    std::vector<int> expected{0, 1, 2, 3};
    std::swap(expected[3], expected[2469588189546311528u % 4]);
    std::swap(expected[2], expected[2516265689700432462u % 3]);
    std::swap(expected[1], expected[8323445853463659930u % 2]);
    QCOMPARE(nodesOf(places(read("grid:4x1x1@0.3:order=random:seed=1"))), expected);
    QVERIFY(nodesOf(places(read("grid:5x5x4@0.3:order=random:seed=1"))) !=
            nodesOf(places(read("grid:5x5x4@0.3:order=random:seed=2"))));
  }

  void orientationsAreWellApart() {
    QVERIFY2(testing::near(planOrientation(0), Eigen::Quaterniond::Identity(), 1e-12), "visit 0");
    const Eigen::Quaterniond third(Eigen::AngleAxisd(2 * M_PI / 3, Eigen::Vector3d::Ones().normalized()));
    QVERIFY2(testing::near(planOrientation(1), third, 1e-12), "visit 1");
    QVERIFY2(testing::near(planOrientation(2), third * third, 1e-12), "visit 2");
    for (int a = 0; a < kMaxOrientations; ++a) {
      for (int b = 0; b < a; ++b) {
        const double apart_deg = angleBetween_rad(planOrientation(a), planOrientation(b)) * 180 / M_PI;
        QVERIFY2(apart_deg > (a < 12 ? 119.999 : 89.999),
                 qPrintable(QString("%1 and %2: %3").arg(a).arg(b).arg(apart_deg)));
      }
    }
  }

  void namesArePeoples_data() {
    QTest::addColumn<int>("i");
    QTest::addColumn<int>("j");
    QTest::addColumn<int>("k");
    QTest::addColumn<QString>("name");
    QTest::newRow("first") << 0 << 0 << 0 << "A1, pipe 1";
    QTest::newRow("example") << 2 << 3 << 2 << "C4, pipe 3";
    QTest::newRow("column 26") << 25 << 9 << 0 << "Z10, pipe 1";
    QTest::newRow("column 27") << 26 << 0 << 0 << "AA1, pipe 1";
    QTest::newRow("column 703") << 702 << 0 << 0 << "AAA1, pipe 1";
  }
  void namesArePeoples() {
    QFETCH(int, i);
    QFETCH(int, j);
    QFETCH(int, k);
    QFETCH(QString, name);
    PlannedPlace place;
    place.index = {i, j, k};
    QCOMPARE(QString::fromStdString(placeName(place)), name);
  }
  void scatteredPlacesHaveNumbers() {
    PlannedPlace place;
    place.node = 17;
    QCOMPARE(placeName(place), std::string("P17"));
  }

  void pipesAreAsLongAsTheirLevelIsHigh() {
    Plan plan = read("grid:2x2x3@0.25:origin=1,0,0.75");
    plan.pipe_base_m = 0.5;
    QCOMPARE(pipeLengths_m(plan), (std::vector<double>{0.25, 0.5, 0.75}));
    plan.pipe_base_m = 0.75;
    QVERIFY(pipeLengths_m(plan).empty());
  }

  void jsonKeepsAll() {
    Plan plan = read("grid:5x4x3@0.1x0.25x0.2:origin=0.1,0.2,0.3:order=random:seed=18446744073709551615:reseat=2");
    plan.pipe_base_m = -1.25;
    const nlohmann::json written = toJson(plan);
    const auto again = planFromJson(nlohmann::json::parse(written.dump()), "again");
    QVERIFY2(testing::succeeded(again), "reads back");
    QVERIFY(toJson(*again) == written);
    const auto before = places(plan), after = places(*again);
    QCOMPARE(nodesOf(after), nodesOf(before));
    for (std::size_t i = 0; i < before.size(); ++i) {
      QVERIFY(testing::sameBits(after[i].reference_from_sensor, before[i].reference_from_sensor));
    }
  }

  void fileOfScatteredNodes() {
    QTemporaryDir folder;
    const std::string path = folder.filePath("lab.plan.json").toStdString();
    std::ofstream(path) << R"({"schema": "fieldtrue.plan/1", "nodes": [
      {"node": 7, "x_m": 0.5, "y_m": 0, "z_m": -0.25},
      {"node": 9, "x_m": 1, "y_m": 2, "z_m": 3, "qw": 0, "qx": 0, "qy": 0, "qz": -2, "role": "validation"},
      {"node": 7, "x_m": 0.5, "y_m": 0, "z_m": -0.25, "i": 1, "j": 2, "k": 3}]})";
    const auto plan = readPlan(path);
    QVERIFY2(testing::succeeded(plan), testing::succeeded(plan).text.constData());
    const auto all = places(*plan);
    QCOMPARE(nodesOf(all), (std::vector<int>{7, 9, 7}));
    QCOMPARE(all[2].visit, 1);
    QCOMPARE(*all[2].index, (std::array<int, 3>{1, 2, 3}));
    QVERIFY(all[1].role == NodeRole::kValidation);
    QVERIFY(testing::near(all[1].reference_from_sensor.orientation, Eigen::Quaterniond(0, 0, 0, 1), 1e-12));
    QVERIFY(toJson(*planFromJson(toJson(*plan), "again")) == toJson(*plan));
  }

  void badJsonIsNamed_data() {
    QTest::addColumn<QString>("text");
    QTest::addColumn<QString>("expected");
    const auto node = [](const char* rest) {
      return QString(R"({"nodes": [{"node": 1, "x_m": 1, "y_m": 2, %1}]})").arg(rest);
    };
    QTest::newRow("empty") << "{}"
                           << "lab: needs grid or nodes";
    QTest::newRow("list") << "[]"
                          << "lab: the file is []; it must be an object";
    QTest::newRow("grid") << R"({"grid": "5x5@0.3"})"
                          << "lab: grid: 5x5@0.3: expected NXxNYxNZ, got 5x5";
    QTest::newRow("grid is a number") << R"({"grid": 5})"
                                      << "grid is 5; it must be text like \"5x5x4@0.3048\"";
    QTest::newRow("unknown key") << R"({"grid": "1x1x1@1", "pitch": 1})"
                                 << "pitch is not known; did you mean grid? Known: schema, grid";
    QTest::newRow("origin") << R"({"grid": "1x1x1@1", "origin": [1, 2]})"
                            << "origin is [1,2]; it must be three numbers of size up to 1000 [m]";
    QTest::newRow("origin text") << R"({"grid": "1x1x1@1", "origin": [1, 2, "3"]})"
                                 << "it must be three numbers";
    QTest::newRow("order") << R"({"grid": "1x1x1@1", "order": "left"})"
                           << R"(order is the text "left"; it must be "serpentine" or "random")";
    QTest::newRow("seed") << R"({"grid": "1x1x1@1", "seed": -3})"
                          << "seed is -3; it must be a whole number from 0";
    QTest::newRow("reseat") << R"({"grid": "1x1x1@1", "reseat": 1.5})"
                            << "reseat is 1.5; it must be a whole number from 1 to 1000";
    QTest::newRow("no nodes") << R"({"nodes": []})"
                              << "nodes is []; it must be a list with at least one node";
    QTest::newRow("no z") << node("\"y_m\": 2") << "lab: nodes[0].z_m is missing";
    QTest::newRow("far away") << node("\"z_m\": 1e9")
                              << "nodes[0].z_m is 1e+09; it must be a number of metres within 1000";
    QTest::newRow("half a quaternion") << node("\"z_m\": 3, \"qw\": 1") << "nodes[0] needs qw, qx, qy and qz together";
    QTest::newRow("zero quaternion") << node("\"z_m\": 3, \"qw\": 0, \"qx\": 0, \"qy\": 0, \"qz\": 0")
                                     << "quaternion of zeros";
    QTest::newRow("half an index") << node("\"z_m\": 3, \"i\": 1") << "nodes[0] needs i, j and k together";
    QTest::newRow("role") << node("\"z_m\": 3, \"role\": \"skipped\"")
                          << R"(role is the text "skipped"; it must be "fit" or "validation")";
    QTest::newRow("twice") << R"({"nodes": [{"node": 1, "visit": 0, "x_m": 1, "y_m": 2, "z_m": 3},
        {"node": 1, "visit": 0, "x_m": 1, "y_m": 2, "z_m": 3}]})"
                           << "nodes[1] is node 1, visit 0, which is listed twice";
    QTest::newRow("visits twice over")
        << R"({"reseat": 2, "nodes": [{"node": 1, "visit": 1, "x_m": 1, "y_m": 2, "z_m": 3}]})"
        << "nodes[0].visit is 1; it must be 0 when orientations or reseat ask for further visits";
  }
  void badJsonIsNamed() {
    QFETCH(QString, text);
    QFETCH(QString, expected);
    const auto plan = planFromJson(nlohmann::json::parse(text.toStdString()), "lab");
    QVERIFY(!plan);
    QVERIFY2(QString::fromStdString(plan.error().message).contains(expected), plan.error().message.c_str());
  }

  void newerAndMissingFiles() {
    const auto newer = planFromJson(nlohmann::json::parse(R"({"schema": "fieldtrue.plan/2"})"), "lab");
    QVERIFY(!newer && newer.error().code == ErrorCode::kNewerVersion);
    QTemporaryDir folder;
    const auto missing = readPlan(folder.filePath("none.plan.json").toStdString());
    QVERIFY(!missing && missing.error().code == ErrorCode::kIo);
    const std::string path = folder.filePath("broken.plan.json").toStdString();
    std::ofstream(path) << "{\"grid\": ";
    const auto broken = readPlan(path);
    QVERIFY(!broken);
    FT_VERIFY_MATCH(testing::holdsAll(broken.error().message, {"broken.plan.json, line 1", "not valid JSON"}));
  }
};

FIELDTRUE_TEST(PlanTest)
#include "plan_test.moc"
