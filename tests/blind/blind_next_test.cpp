#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <filesystem>

#include "tests/blind/generate.h"
#include "tests/blind/next.h"
#include "tests/blind/next_figures.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/blind/sha256.h"
#include "tests/blind/suggestion.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// Three by two by two places a fifth of a metre apart, far from the transmitter; node 4 was seen twice.
Setup smallGrid() {
  Setup setup;
  setup.counts = {3, 2, 2};
  setup.pitch_m = 0.2;
  setup.middle_m = Vector3d(0.2, 0.1, 0.1);
  setup.jig_in_tracker_m = Vector3d(1, 0, 0);
  for (int node = 0; node < 12; ++node) {
    Row row;
    row.node = node;
    row.i = node % 3, row.j = node / 3 % 2, row.k = node / 6;
    row.place_m = 0.2 * Vector3d(row.i, row.j, row.k);
    row.start_s = 10 * node;
    row.end_s = row.start_s + 0.5;
    setup.rows.push_back(row);
  }
  setup.rows.push_back(setup.rows[4]);
  setup.rows.back().visit = 1;
  setup.rows.back().start_s = 120;
  setup.latest_s = 120.5;
  return setup;
}

bool isAfterEachOther(const Setup& setup, const std::vector<Row>& rows) {
  double time_s = setup.latest_s;
  for (const Row& row : rows) {
    if (row.start_s <= time_s || row.end_s < row.start_s) return false;
    time_s = row.end_s;
  }
  return true;
}

json cause(const char* effect, double probability, json widths) {
  return {{"effect", effect}, {"probability", probability}, {"widths90", std::move(widths)}};
}

Session openSession() {
  Session session;
  session.shelf = "single";
  session.effects = {{"global_gain", 1.4, std::nullopt, "", 0.0}};
  session.classes = {{"global_gain", "grid_scale"}, {"jig_tilt"}, {"none"}};
  return session;
}

/// A report that leaves open what it is, and suggests to turn the sensor at two places.
json openReport() {
  return {{"verdict", "explained"},
          {"candidates",
           {{{"effect", "jig_tilt"},
             {"class", {"jig_tilt"}},
             {"probability", 0.6},
             {"parameters", {{"tilt_rad", {{"value", 1.0}, {"low90", 0.5}, {"high90", 2.0}}}}}}}},
          {"next_measurement",
           {{"text",
             "To tell A from B, turn the sensor by 90 degrees about the rig's x axis and measure A1, pipe 1 and B1, "
             "pipe 1 again."},
            {"separates", {"a", "b"}}}}};
}

}  // namespace

class BlindNextTest : public QObject {
  Q_OBJECT
 private slots:
  void outerPlacesAreOneStepBeyond();
  void turnedPlacesAreSeenAgain();
  void firstPlacesComeAgainLater();
  void otherSentencesMakeNoRows_data();
  void otherSentencesMakeNoRows();
  void randomRowsKeepToTheGrownBox();
  void openAnswersByHand();
  void volumeAndEntropyByHand();
  void figuresByHand();
  /// Both tables hold the recording as it was and the further rows behind it.
  void tablesAreExtendedAndDiagnosed();
};

void BlindNextTest::outerPlacesAreOneStepBeyond() {
  const Setup setup = smallGrid();
  const Suggestion suggestion = suggestionIn(
      "To tell Coil gains from Compact metal body, measure 2 more places one step (0.25 m) beyond C1, pipe 1 and C2, "
      "pipe 2, towards -z.",
      setup);
  QCOMPARE(suggestion.kind, std::string("outer"));
  QCOMPARE(suggestion.rows.size(), std::size_t(2));
  QVERIFY((suggestion.rows[0].place_m - Vector3d(0.4, 0, -0.25)).norm() < 1e-12);
  QVERIFY((suggestion.rows[1].place_m - Vector3d(0.4, 0.2, -0.05)).norm() < 1e-12);
  QCOMPARE(suggestion.rows[0].node, 12);
  QCOMPARE(suggestion.rows[1].node, 13);
  QVERIFY(isAfterEachOther(setup, suggestion.rows));
}

void BlindNextTest::turnedPlacesAreSeenAgain() {
  const Setup setup = smallGrid();
  const Suggestion suggestion = suggestionIn(
      "turn the sensor by 90 degrees about the rig's z axis and measure B2, pipe 1 and A1, pipe 2 again", setup);
  QCOMPARE(suggestion.kind, std::string("turned"));
  QCOMPARE(suggestion.rows.size(), std::size_t(2));
  QCOMPARE(suggestion.rows[0].node, 4);
  QCOMPARE(suggestion.rows[0].visit, 2);
  QCOMPARE(suggestion.rows[1].node, 6);
  QCOMPARE(suggestion.rows[1].visit, 1);
  QVERIFY((suggestion.rows[0].attitude * Vector3d::UnitX() - Vector3d::UnitY()).norm() < 1e-12);
  QVERIFY((suggestion.rows[0].place_m - setup.rows[4].place_m).norm() == 0);
  QVERIFY(isAfterEachOther(setup, suggestion.rows));
}

void BlindNextTest::firstPlacesComeAgainLater() {
  const Setup setup = smallGrid();
  const Suggestion suggestion = suggestionIn("measure the first places again, now at the end: P0; P3 and P11.", setup);
  QCOMPARE(suggestion.kind, std::string("later"));
  QCOMPARE(suggestion.rows.size(), std::size_t(3));
  QCOMPARE(suggestion.rows[2].node, 11);
  QVERIFY(isAfterEachOther(setup, suggestion.rows));
}

void BlindNextTest::otherSentencesMakeNoRows_data() {
  QTest::addColumn<QString>("text");
  QTest::newRow("a check") << "Check Leaning rig at its source, put it right or add it to the simulation.";
  QTest::newRow("nothing") << "No extra place or turn of the sensor would tell Coil gains from Scale of the rig.";
  QTest::newRow("no such place") << "measure 1 more places one step (0.25 m) beyond Z9, pipe 7, towards +x.";
}

void BlindNextTest::otherSentencesMakeNoRows() {
  QFETCH(QString, text);
  const Suggestion suggestion = suggestionIn(text.toStdString(), smallGrid());
  QCOMPARE(suggestion.kind, std::string());
  QVERIFY(suggestion.rows.empty());
}

void BlindNextTest::randomRowsKeepToTheGrownBox() {
  const Setup setup = smallGrid();
  Random random(3), same(3);
  const std::vector<Row> rows = randomRows(setup, std::vector<Row>(40), random);
  QCOMPARE(rows.size(), std::size_t(40));
  const Eigen::AlignedBox3d grown(Vector3d(-0.2, -0.2, -0.2), Vector3d(0.6, 0.4, 0.4));
  Eigen::AlignedBox3d reached;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    QVERIFY(grown.contains(rows[n].place_m));
    QVERIFY(rows[n].i >= 0 && rows[n].i < 3 && rows[n].k >= 0 && rows[n].k < 2);
    QCOMPARE(rows[n].node, 12 + static_cast<int>(n));
    reached.extend(rows[n].place_m);
  }
  QVERIFY(reached.volume() > 0.5 * grown.volume());
  QVERIFY(isAfterEachOther(setup, rows));
  QVERIFY(randomRows(setup, std::vector<Row>(40), same)[39].place_m == rows[39].place_m);
}

void BlindNextTest::openAnswersByHand() {
  json report = openReport();
  QVERIFY(leavesOpen(report));
  report["candidates"][0]["probability"] = 0.95;
  QVERIFY(!leavesOpen(report));
  report["candidates"][0]["class"] = {"jig_tilt", "grid_scale"};
  QVERIFY(leavesOpen(report));
  report["verdict"] = "no_gap";
  QVERIFY(!leavesOpen(report));
}

void BlindNextTest::volumeAndEntropyByHand() {
  const Session session = openSession();
  // The first of the truth's class is the scale; the gain comes after it.
  const json suggested = {cause("jig_tilt", 0.5, {{"a", 9.0}}), cause("grid_scale", 0.25, {{"x", 0.2}, {"y", 0.3}}),
                          cause("global_gain", 0.25, {{"x", 5.0}})};
  const json random = {cause("grid_scale", 1.0, {{"x", 0.4}, {"y", 0.1}, {"z", 7.0}})};
  QVERIFY(std::abs(*volumeRatio(session, suggested, random) - (0.2 * 0.3) / (0.4 * 0.1)) < 1e-12);
  QVERIFY(!volumeRatio(session, random, json::array({cause("global_gain", 1.0, {{"x", 1.0}})})));
  QVERIFY(!volumeRatio(session, json::array({cause("jig_tilt", 1.0, {{"a", 1.0}})}), random));
  // Half a tilt, half the class of two: ln 2.
  QVERIFY(std::abs(classEntropy(session, suggested) - std::log(2.0)) < 1e-12);
  QVERIFY(classEntropy(session, random) == 0);
}

void BlindNextTest::figuresByHand() {
  Session measured = openSession(), silent = openSession();
  measured.results["next"] = {{"kind", "outer"},
                              {"before", {cause("jig_tilt", 0.5, {}), cause("grid_scale", 0.5, {})}},
                              {"suggested", {cause("grid_scale", 1.0, {{"x", 0.1}})}},
                              {"random", {cause("grid_scale", 0.5, {{"x", 0.4}}), cause("none", 0.5, {})}}};
  silent.results["next"] = {{"kind", nullptr}};
  std::vector<Figure> figures;
  addNextFigures(figures, {&measured, &silent});
  std::map<std::string, double> all;
  for (const Figure& figure : figures)
    if (figure.group == "all") all[figure.name] = figure.interval.value;
  const std::map<std::string, double> expected = {
      {"further rows are suggested", 0.5},
      {"volume of the true cause's intervals, suggested over random, median", 0.25},
      {"entropy of the causes, suggested less random, median [nat]", -std::log(2.0)},
      {"entropy of the causes, suggested over random, of sums", 0.0},
      {"entropy of the causes, suggested over before, of sums", 0.0},
      {"named right before", 0.0},
      {"named right after the suggested rows", 1.0},
      {"named right after the random rows", 1.0}};
  QCOMPARE(all.size(), expected.size());
  for (const auto& [name, value] : expected) QVERIFY2(std::abs(all.at(name) - value) < 1e-12, name.c_str());
}

void BlindNextTest::tablesAreExtendedAndDiagnosed() {
  const QTemporaryDir holder;
  const fs::path folder = holder.path().toStdString(), set = folder / "set";
  QCOMPARE(runGenerate(std::vector<std::string>{"--seed", "9", "--sessions", "1", "--shelf", "single", "--max-rows",
                                                "60", "--cli", "/nowhere", "--out", set.string()}),
           0);
  const std::string report = openReport().dump();
  replaceFile(set / "session_0001.gap.json", report);
  replaceFile(set / "answers.json",
              json{{"sessions", {{{"file", "session_0001"}, {"answer_sha256", sha256Hex(report)}}}}}.dump());
  replaceFile(folder / "cli", "#!/bin/sh\ncp \"$3\" $(mktemp " + (folder / "seen_XXXXXX").string() + ")\ncp " +
                                  (set / "session_0001.gap.json").string() + " \"$5\"\n");
  fs::permissions(folder / "cli", fs::perms::owner_all);
  const std::vector<std::string> words = {"--in", set.string(), "--cli", (folder / "cli").string()};
  QCOMPARE(runNext(words), 0);
  const json entry = documentOf(set / "next.json")["sessions"][0];
  QCOMPARE(entry["kind"].get<std::string>(), std::string("turned"));
  QCOMPARE(entry["suggested"][0]["widths90"]["tilt_rad"].get<double>(), 1.5);
  const std::string before = textOf(set / "session_0001.nodes.csv");
  int seen = 0;
  for (const fs::directory_entry& file : fs::directory_iterator(folder)) {
    if (file.path().filename().string().rfind("seen_", 0) != 0) continue;
    ++seen;
    QCOMPARE(textOf(file.path()).substr(0, before.size()), before);
    QCOMPARE(readTable(file.path()).rows.size(), readTable(set / "session_0001.nodes.csv").rows.size() + 2);
  }
  QCOMPARE(seen, 2);
  const std::string once = textOf(set / "next.json");
  QCOMPARE(runNext(words), 0);
  QCOMPARE(textOf(set / "next.json"), once);
  fs::remove(set / "next.json");
  QCOMPARE(runNext(words), 0);
  QCOMPARE(textOf(set / "next.json"), once);
  replaceFile(set / "session_0001.gap.json", report + " ");
  QCOMPARE(runNext(words), 1);
}

FIELDTRUE_TEST(BlindNextTest)
#include "blind_next_test.moc"
