#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "tests/blind/control_changes.h"
#include "tests/blind/controls.h"
#include "tests/blind/made_readings.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

constexpr const char* kNodes =
    "# frame: jig\n# jig_tolerance_m: 0.001\n# jig_tolerance_rad: 0.002\n"
    "node,visit,t_start_s,t_end_s,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,qw,qx,qy,qz,sd_x_m,sd_y_m,sd_z_m,"
    "cov_xy_m2,cov_xz_m2,cov_yz_m2\n"
    "0,0,0,1,0.1,0.2,0.3,0.11,0.21,0.31,0.9,0.1,0.2,0.3,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "1,0,2,3,0.4,0.2,0.3,0.41,0.21,0.31,0.9,0.1,-0.2,0.3,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "2,0,4,5,0.7,0.2,0.3,0.71,0.21,0.31,1,0,0,0,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "2,1,6,7,0.7,0.2,0.3,0.72,0.21,0.31,1,0,0,0,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "3,0,8,9,0.9,0.2,0.3,0.91,0.21,0.31,1,0,0,0,0.1,0.2,0.3,0.01,0.005,0.02\n";

json truthOfThree() {
  const json gain = {{"id", "coil_gain"}, {"rho", 1.4}};
  const json drift = {{"id", "gain_drift"}, {"rho", 1.4}};
  const json sessions = {{{"file", "s01"}, {"shelf", "none"}, {"effects", json::array()}},
                         {{"file", "s02"}, {"shelf", "single"}, {"effects", json::array({gain})}},
                         {{"file", "s03"}, {"shelf", "single"}, {"effects", json::array({drift})}}};
  return {{"schema", "fieldtrue.blind/1"}, {"seed", 1}, {"role", "dev"}, {"sessions", sessions}};
}

/// Of every row from where a tracker without fault would read it.
std::vector<Eigen::Matrix<double, 6, 1>> residualsOf(const SessionTable& table, const BareAlignment& truth) {
  std::vector<Eigen::Matrix<double, 6, 1>> residuals;
  for (const auto& row : table.rows) {
    const SolvedPose aligned = truth.reported(truePose(table, row)), tracked = trackedPose(table, row);
    residuals.emplace_back();
    residuals.back() << tracked.position_m - aligned.position_m,
        rotationBetween(tracked.orientation, aligned.orientation);
  }
  return residuals;
}

void scatterReadings(SessionTable& table, double sd_m, Random& random) {
  for (auto& row : table.rows)
    for (const char* name : {"x_m", "y_m", "z_m"}) {
      std::string& field = row[table.neededColumn(name)];
      field = exactText(numberIn(field) + sd_m * normal(random));
    }
}

/// Of some components of all residuals, about zero.
struct Series {
  double sd = 0.0;
  double lag_one = 0.0;
};

Series seriesOf(const std::vector<Eigen::Matrix<double, 6, 1>>& residuals, int first) {
  double squares = 0.0, products = 0.0;
  for (std::size_t at = 1; at < residuals.size(); ++at) {
    squares += residuals[at].segment<3>(first).squaredNorm();
    products += residuals[at].segment<3>(first).dot(residuals[at - 1].segment<3>(first));
  }
  return {std::sqrt(squares / (3.0 * static_cast<double>(residuals.size() - 1))), products / squares};
}

void stateTolerance(SessionTable& table, double jig_m, double jig_rad) {
  table.metadata = {"# jig_tolerance_m: " + exactText(jig_m), "# jig_tolerance_rad: " + exactText(jig_rad)};
}

}  // namespace

class BlindControlsTest : public QObject {
  Q_OBJECT
 private slots:
  void controlsChangeWhatTheySay();
  void placesAreShuffledWhole();
  void redNoiseTakesThePlaceOfWhite();
  void residualsStayInTheirShell();
  void effectFreeFamiliesHaveANumberOfTheirOwn();
};

void BlindControlsTest::controlsChangeWhatTheySay() {
  const QTemporaryDir holder;
  const fs::path in = holder.path().toStdString();
  const fs::path out = in / "controls";
  sealTruth(in, truthOfThree());
  for (const char* file : {"s01.nodes.csv", "s02.nodes.csv"}) replaceFile(in / file, kNodes);
  std::string four_rows = kNodes;
  four_rows.resize(four_rows.rfind("3,0,8,9"));
  four_rows.replace(four_rows.find("0.4,0.2,0.3"), 11, "0.5,0.6,0.7");
  replaceFile(in / "s03.nodes.csv", four_rows);
  const std::vector<std::string> words = {"--in", in.string(), "--out", out.string(), "--count", "3"};
  QCOMPARE(runControls(words), 0);
  QCOMPARE(runControls(words), 1);
  std::map<std::string, SessionTable> made;
  const json truth = openSealed(out);
  for (const json& session : truth["sessions"]) {
    const std::string control = session["control"], source = session["source"];
    made[control] = readTable(out / (session["file"].get<std::string>() + ".nodes.csv"));
    QVERIFY(wantedOf(control).has_value());
    if (control == "drift_reversed") QCOMPARE(source, std::string("s03"));
    if (control == "other_truth" && source == "s02") {
      QCOMPARE(made[control].rows.size(), std::size_t(4));
      QCOMPARE(made[control].rows[1][4], std::string("0.5"));
      QCOMPARE(made[control].rows[1][7], std::string("0.41"));
    }
  }
  // Neither red noise nor permuted residuals: these tables do not tell how many readings a mean is worth.
  QCOMPARE(made.size(), std::size_t(9));
  QCOMPARE(made["tolerance_absent"].metadata, std::vector<std::string>{"# frame: jig"});
  QCOMPARE(made["tolerance_half"].metadata[1], std::string("# jig_tolerance_m: " + exactText(0.5 * 0.001)));
  QCOMPARE(numberIn(made["drift_reversed"].rows[0][2]), 0.0);
  QCOMPARE(made["drift_reversed"].rows[0][0], std::string("2"));
  QCOMPARE(made["floor_+20%"].metadata[1], std::string("# jig_tolerance_m: " + exactText(1.2 * 0.001)));
  QCOMPARE(made["floor_-20%"].metadata[2], std::string("# jig_tolerance_rad: " + exactText(0.8 * 0.002)));
  const std::vector<double> scatter = {0.12, 0.24, 0.36, 0.0144, 0.0072, 0.0288};
  for (std::size_t at = 0; at < scatter.size(); ++at)
    QVERIFY(std::abs(numberIn(made["floor_+20%"].rows[0][at + 14]) - scatter[at]) < 1e-12);
  const SessionTable& mirrored = made["mirrored"];
  const std::vector<double> expected = {0.1, 0.2, 0.3, -0.11, 0.21, 0.31, 0.9, 0.1, -0.2, -0.3};
  for (std::size_t at = 0; at < expected.size(); ++at) QCOMPARE(numberIn(mirrored.rows[0][at + 4]), expected[at]);
  const SessionTable& reversed = made["time_reversed"];
  QCOMPARE(reversed.rows[0][0], std::string("3"));
  QCOMPARE(numberIn(reversed.rows[0][2]), 0.0);
  QCOMPARE(numberIn(reversed.rows[4][3]), 9.0);
  QCOMPARE(numberIn(reversed.rows[4][2]), 8.0);
}

void BlindControlsTest::placesAreShuffledWhole() {
  const QTemporaryDir holder;
  const fs::path path = fs::path(holder.path().toStdString()) / "n.csv";
  replaceFile(path, kNodes);
  const SessionTable before = readTable(path);
  SessionTable after = before;
  shufflePlaces(after, 7);
  QVERIFY(after.rows != before.rows);
  QCOMPARE(after.rows[2][4], after.rows[3][4]);
  std::multiset<std::string> places_before;
  std::multiset<std::string> places_after;
  for (const std::size_t row : {0U, 1U, 2U, 4U}) {
    places_before.insert(before.rows[row][4]);
    places_after.insert(after.rows[row][4]);
    for (const std::size_t column : {0U, 7U, 8U, 9U, 10U, 13U})
      QCOMPARE(after.rows[row][column], before.rows[row][column]);
  }
  QCOMPARE(places_after, places_before);
}

void BlindControlsTest::redNoiseTakesThePlaceOfWhite() {
  Random random(5);
  const BareAlignment truth{drawnPose(random, 2.0), drawnPose(random, 0.1)};
  const SessionTable exact = readings(truth, true, random, 600);
  const double mean_m = 1e-4 / std::sqrt(20.0), mean_rad = 1e-3 / std::sqrt(3.0 * 20.0);
  SessionTable all_red = exact;
  stateTolerance(all_red, 1e-9, 1e-9);
  QVERIFY(reddenNoise(all_red, 1));
  for (const int first : {0, 3}) {
    const Series series = seriesOf(residualsOf(all_red, truth), first);
    QVERIFY2(std::abs(series.lag_one - 0.9) < 0.05, std::to_string(series.lag_one).c_str());
    QVERIFY2(std::abs(series.sd / (first == 0 ? mean_m : mean_rad) - 1.0) < 0.2, std::to_string(series.sd).c_str());
  }
  // Seating as large as the noise: half of the squares are white, and the sum is what it was.
  SessionTable half_red = exact;
  stateTolerance(half_red, mean_m, mean_rad);
  scatterReadings(half_red, std::sqrt(2.0) * mean_m, random);
  QVERIFY(reddenNoise(half_red, 2));
  const Series series = seriesOf(residualsOf(half_red, truth), 0);
  QVERIFY2(std::abs(series.lag_one - 0.45) < 0.1, std::to_string(series.lag_one).c_str());
  QVERIFY2(std::abs(series.sd / (std::sqrt(2.0) * mean_m) - 1.0) < 0.2, std::to_string(series.sd).c_str());
  // Seating far larger than the noise stays as it is.
  SessionTable seated = exact;
  scatterReadings(seated, 0.05, random);
  stateTolerance(seated, 0.05, 0.1);
  const SessionTable before = seated;
  QVERIFY(reddenNoise(seated, 3));
  const auto old_residuals = residualsOf(before, truth), new_residuals = residualsOf(seated, truth);
  for (std::size_t at = 0; at < old_residuals.size(); ++at)
    QVERIFY((old_residuals[at] - new_residuals[at]).head<3>().norm() < 0.003);
  SessionTable unstated = exact;
  unstated.metadata.clear();
  QVERIFY(!reddenNoise(unstated, 1));
}

void BlindControlsTest::residualsStayInTheirShell() {
  Random random(6);
  const BareAlignment truth{drawnPose(random, 2.0), drawnPose(random, 0.1)};
  SessionTable before = readings(truth, true, random, 45);
  scatterReadings(before, 1e-3, random);
  SessionTable after = before;
  QVERIFY(permuteResiduals(after, 1));
  const BareAlignment fitted = bareAlignment(before);
  const auto old_residuals = residualsOf(before, fitted), new_residuals = residualsOf(after, fitted);
  std::vector<std::size_t> order;
  for (std::size_t at = 0; at < before.rows.size(); ++at) order.push_back(at);
  const auto range_m = [&](std::size_t at) { return trackedPose(before, before.rows[at]).position_m.norm(); };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return range_m(a) < range_m(b); });
  std::set<std::size_t> taken;
  int moved = 0;
  for (std::size_t rank = 0; rank < order.size(); ++rank)
    // 45 rows are five shells of nine.
    for (std::size_t other = rank / 9 * 9; other < rank / 9 * 9 + 9; ++other) {
      if ((new_residuals[order[rank]] - old_residuals[order[other]]).norm() > 1e-9) continue;
      taken.insert(other);
      moved += other != rank ? 1 : 0;
    }
  QCOMPARE(taken.size(), std::size_t(45));
  QVERIFY2(moved > 30, std::to_string(moved).c_str());
}

void BlindControlsTest::effectFreeFamiliesHaveANumberOfTheirOwn() {
  const QTemporaryDir holder;
  const fs::path in = holder.path().toStdString();
  json sessions = json::array();
  for (const char* file : {"s01", "s02", "s03"}) {
    sessions.push_back({{"file", file}, {"shelf", "none"}, {"effects", json::array()}});
    replaceFile(in / (std::string(file) + ".nodes.csv"), kNodes);
  }
  sealTruth(in, {{"schema", "fieldtrue.blind/1"}, {"seed", 1}, {"role", "dev"}, {"sessions", sessions}});
  const std::vector<std::string> words = {"--in",    in.string(), "--out",         (in / "controls").string(),
                                          "--count", "1",         "--effect-free", "2"};
  QCOMPARE(runControls(words), 0);
  std::map<std::string, int> counts;
  const json truth = openSealed(in / "controls");
  for (const json& session : truth["sessions"]) ++counts[session["control"]];
  const std::map<std::string, int> expected = {
      {"floor_+20%", 1}, {"floor_-20%", 1}, {"time_reversed", 1}, {"tolerance_absent", 2}, {"tolerance_half", 2}};
  QCOMPARE(counts, expected);
  QVERIFY(isEffectFreeFamily("red_noise") && !isEffectFreeFamily("floor_+20%") && !isEffectFreeFamily(""));
}

FIELDTRUE_TEST(BlindControlsTest)
#include "blind_controls_test.moc"
