#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "tests/blind/answer.h"
#include "tests/blind/controls.h"
#include "tests/blind/figures.h"
#include "tests/blind/score.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/statistics.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// One hand-made session: what is true and what was answered.
struct Case {
  std::string file;
  std::string shelf;
  json effects = json::array();
  double rho = 1.4;
  double oracle = 0.0;  ///< 0: unknown.
  json answer;          ///< Null: the diagnosis left nothing.
  bool position_only = false;
  std::string control = {};
};

json trueEffect(const std::string& id, double rho = 1.4) {
  return {
      {"id", id}, {"kind", ""}, {"rho", rho}, {"location_m", nullptr}, {"material", nullptr}, {"amplitude", nullptr}};
}

json located(json effect, double x_m, double y_m, double z_m) {
  effect["location_m"] = {x_m, y_m, z_m};
  return effect;
}

json selected(const std::vector<std::string>& ids) {
  json list = json::array();
  for (const std::string& id : ids) list.push_back({{"effect", id}, {"location_m", nullptr}});
  return list;
}

/// A report whose first candidate has probability p and whose second, `none` or a coil's gain, has the rest.
json report(const std::string& verdict, const std::string& first, double p, const std::vector<std::string>& chosen,
            double remaining) {
  const std::string second = first == "none" ? "coil_gain" : "none";
  return {
      {"schema", "fieldtrue.gap/1"},
      {"verdict", verdict},
      {"candidates",
       {{{"effect", first}, {"class", {first}}, {"probability", p}, {"parameters", json::object()}},
        {{"effect", second}, {"class", {second}}, {"probability", 1.0 - p}, {"parameters", json::object()}}}},
      {"selected", selected(chosen)},
      {"findings", json::array()},
      {"remaining",
       {{"fraction_of_start", remaining}, {"fraction_low90", remaining - 0.1}, {"fraction_high90", remaining + 0.1}}}};
}

json metalReport() {
  json answer = report("partly_explained", "compact_metal", 0.8, {"compact_metal"}, 0.2);
  json& first = answer["candidates"][0];
  first["location_m"] = {1.03, 0.04, 0.0};
  first["parameters"] = {{"center_x_m", {{"value", 1.03}, {"unit", "m"}, {"low90", 0.98}, {"high90", 1.05}}},
                         {"center_y_m", {{"value", 0.04}, {"unit", "m"}, {"low90", 0.01}, {"high90", 0.07}}},
                         {"center_z_m", {{"value", 0.0}, {"unit", "m"}, {"low90", -0.01}, {"high90", 0.01}}}};
  return answer;
}

json gainReport() {
  json answer = report("explained", "coil_gain", 0.7, {"coil_gain"}, 0.1);
  answer["candidates"][0]["parameters"] = {{"gain_x", {{"value", 0.012}, {"low90", 0.005}, {"high90", 0.02}}},
                                           {"gain_y", {{"value", 0.0}, {"low90", nullptr}, {"high90", nullptr}}}};
  return answer;
}

/// Names metal, and says that it cannot tell it from gains.
json metalOrGainReport() {
  json answer = report("explained", "compact_metal", 0.5, {"coil_gain"}, 0.5);
  answer["candidates"][0]["class"] = {"compact_metal", "coil_gain"};
  return answer;
}

json flipless(const std::string& finding) {
  json answer = report("no_gap", "none", 0.9, {}, 1.0);
  if (!finding.empty()) answer["findings"].push_back({{"effect", finding}, {"text", ""}, {"nodes", json::array()}});
  return answer;
}

std::vector<Case> handMade() {
  json gain = trueEffect("coil_gain");
  gain["amplitude"] = {{"name", "gain_x"}, {"value", 0.01}};
  return {
      {"s01", "none", json::array(), 0.0, 0.0, report("no_gap", "none", 0.9, {}, 1.0)},
      {"s02", "none", json::array(), 0.0, 0.0, report("explained", "coil_gain", 0.6, {"coil_gain"}, 0.1)},
      {"s03", "none", json::array(), 0.0, 0.0, report("no_gap", "none", 0.8, {}, 1.0)},
      {"s04", "single", json::array({trueEffect("global_gain")}), 1.4, 0.9,
       report("explained", "grid_scale", 0.9, {"grid_scale"}, 0.1)},
      {"s05", "single", json::array({gain}), 1.4, 1.0, metalOrGainReport()},
      {"s06", "single", json::array({located(trueEffect("compact_metal"), 1.0, 0.0, 0.0)}), 1.4, 0.8, metalReport()},
      {"s07", "single", json::array({located(trueEffect("compact_metal", 0.35), 1.0, 0.0, 0.0)}), 0.35, 0.5,
       report("no_gap", "none", 0.7, {}, 1.0)},
      {"s08", "single", json::array({gain}), 1.4, 0.9, gainReport(), true},
      {"s09", "off", json::array({trueEffect("off:capacitive", 2.8)}), 2.8, 0.0,
       report("unexplained", "coil_gain", 0.5, {}, 0.9)},
      {"s10", "off", json::array({trueEffect("off:capacitive", 0.35)}), 0.35, 0.0,
       report("explained", "coil_gain", 0.5, {"coil_gain"}, 0.1)},
      {"s11", "pairs", json::array({gain, trueEffect("gain_drift")}), 2.0, 0.0,
       report("explained", "coil_gain", 0.9, {"coil_gain", "gain_drift", "compact_metal"}, 0.1)},
      {"s12", "pairs", json::array({trueEffect("global_gain"), trueEffect("closed_loop")}), 2.0, 0.0,
       report("explained", "closed_loop", 0.9, {"closed_loop", "grid_scale"}, 0.1)},
      {"s13", "signals", json::array({trueEffect("quantization")}), 1.4, 0.0, flipless("quantization")},
      {"s14", "signals", json::array({trueEffect("hemisphere_flip")}), 1.4, 0.0, flipless("")},
      {"s15", "single", json::array({gain}), 1.4, 0.0, report("unexplained", "compact_metal", 0.5, {}, 0.9), false,
       "shuffled"},
      {"s16", "none", json::array(), 0.0, 0.0, report("explained", "range_noise", 0.5, {"range_noise"}, 0.1), false,
       "floor_-20%"},
      {"s17", "single", json::array({gain}), 1.4, 0.0,
       report("explained", "compact_metal", 0.9, {"compact_metal"}, 0.1), false, "mirrored"},
      {"s18", "single", json::array({gain}), 1.4, 0.8, nullptr},
  };
}

json truthOf(const std::vector<Case>& cases) {
  json sessions = json::array();
  for (const Case& one : cases) {
    json session = {{"file", one.file},
                    {"shelf", one.shelf},
                    {"effects", one.effects},
                    {"rho", one.rho},
                    {"rho_level", one.rho},
                    {"position_only", one.position_only},
                    {"order", "random"},
                    {"classes", {{"global_gain", "grid_scale"}, {"coil_gain"}, {"compact_metal"}}},
                    {"oracle", {{"fraction", one.oracle > 0.0 ? json(one.oracle) : json()}}}};
    if (!one.control.empty()) session["control"] = one.control;
    sessions.push_back(session);
  }
  return {{"schema", "fieldtrue.blind/1"}, {"seed", 1}, {"role", "dev"}, {"sessions", sessions}};
}

/// A sealed and answered folder of the hand-made cases.
struct Folder {
  QTemporaryDir holder;
  fs::path path = holder.path().toStdString();

  Folder() {
    const std::vector<Case> cases = handMade();
    sealTruth(path, truthOf(cases));
    json records = json::array();
    for (const Case& one : cases) {
      if (!one.answer.is_null()) replaceFile(path / (one.file + ".gap.json"), one.answer.dump());
      records.push_back({{"file", one.file}, {"seconds", 2.0}, {"exit_status", one.answer.is_null() ? 1 : 0}});
    }
    replaceFile(path / "answers.json", json{{"sessions", records}}.dump());
    json foretold = json::array();
    const std::vector<std::pair<const char*, double>> left = {{"s04", 0.15}, {"s05", 0.75}, {"s06", 0.2},
                                                              {"s07", 1.0},  {"s08", 0.3},  {"s10", 0.6}};
    for (const auto& [file, after_m2] : left)
      foretold.push_back({{"file", file}, {"inside", {{"n", 150}, {"start_m2", 1.0}, {"after_m2", after_m2}}}});
    replaceFile(path / "foretold.json", json{{"sessions", foretold}}.dump());
  }
};

json scored(const fs::path& folder) {
  const fs::path out = folder / "score.json";
  const std::vector<std::string> words = {"--in",       folder.string(), "--json",
                                          out.string(), "--markdown",    (folder / "score.md").string()};
  return runScore(words) == 0 ? documentOf(out) : json();
}

}  // namespace

class BlindScoreTest : public QObject {
  Q_OBJECT
 private slots:
  void wilsonMatchesPublishedIntervals_data();
  void wilsonMatchesPublishedIntervals();
  void bootstrapOfTheMedianMatchesOrderStatistics();
  void pooledSharesVaryBySession();
  void quantilesInterpolate();
  void countsByHand_data();
  void countsByHand();
  void confusionByHand();
  void unansweredSessionsAreListed();
  void targetsAllowForTheInterval_data();
  void targetsAllowForTheInterval();
  void changedTruthIsRefused();
  void wrongUsageIsTold_data();
  void wrongUsageIsTold();
};

void BlindScoreTest::wilsonMatchesPublishedIntervals_data() {
  QTest::addColumn<int>("hits");
  QTest::addColumn<int>("count");
  QTest::addColumn<double>("low");
  QTest::addColumn<double>("high");
  // Newcombe 1998, Statistics in Medicine 17, 857, table I, method 3.
  QTest::newRow("81 of 263") << 81 << 263 << 0.2553 << 0.3662;
  QTest::newRow("15 of 148") << 15 << 148 << 0.0624 << 0.1605;
  QTest::newRow("0 of 20") << 0 << 20 << 0.0 << 0.1611;
  QTest::newRow("1 of 29") << 1 << 29 << 0.0061 << 0.1718;
}

void BlindScoreTest::wilsonMatchesPublishedIntervals() {
  QFETCH(int, hits);
  QFETCH(int, count);
  const Interval interval = wilson(static_cast<std::size_t>(hits), static_cast<std::size_t>(count));
  QTEST(std::round(interval.low * 1e4) / 1e4, "low");
  QTEST(std::round(interval.high * 1e4) / 1e4, "high");
}

void BlindScoreTest::bootstrapOfTheMedianMatchesOrderStatistics() {
  std::vector<double> values(100);
  std::iota(values.begin(), values.end(), 1.0);
  const auto median = [](std::span<const double> some) { return quantileOf(some, 0.5); };
  const Interval interval = bootstrap(values, median);
  QCOMPARE(interval.value, 50.5);
  // Exact interval from the binomial: 40th to 61st of 100 order statistics (Conover 1999, section 3.2).
  QVERIFY(std::abs(interval.low - 40.5) <= 2.0);
  QVERIFY(std::abs(interval.high - 60.5) <= 2.0);
  const Interval again = bootstrap(values, median);
  QCOMPARE(again.low, interval.low);
}

void BlindScoreTest::pooledSharesVaryBySession() {
  // 300 hits of 400 in all: four alike of each session are one draw of 100, not 400 draws.
  std::vector<Tally> sessions(75, Tally{4, 4});
  sessions.resize(100, Tally{0, 4});
  sessions.push_back({0, 0});
  const Interval interval = pooledShare(sessions);
  QCOMPARE(interval.value, 0.75);
  QCOMPARE(interval.count, std::size_t(400));
  // Standard error sqrt(0.75 * 0.25 / 100) = 0.0433, 95 % within 1.96 of it.
  QVERIFY(std::abs(interval.high - interval.low - 2 * 1.96 * 0.0433) < 0.02);
}

void BlindScoreTest::quantilesInterpolate() {
  const std::vector<double> values = {4.0, 1.0, 3.0, 2.0};
  QCOMPARE(quantileOf(values, 0.5), 2.5);
  QCOMPARE(quantileOf(values, 0.9), 3.7);
  QCOMPARE(quantileOf(values, 1.0), 4.0);
  QVERIFY(std::isnan(quantileOf({}, 0.5)));
}

void BlindScoreTest::countsByHand_data() {
  QTest::addColumn<QString>("section");
  QTest::addColumn<QString>("figure");
  QTest::addColumn<QString>("group");
  QTest::addColumn<double>("value");
  QTest::addColumn<int>("count");
  const auto row = [](const char* section, const char* figure, const char* group, double value, int count) {
    QTest::addRow("%s, %s, %s", section, figure, group) << section << figure << group << value << count;
  };
  row("Top-1: ", "poses, random order", "rho 0.35", 0.0, 1);  // s07
  row("Top-1: ", "poses, random order", "rho 1.4", 0.5, 4);   // s04 s06 of s04 s05 s06 s18
  row("Top-1: ", "poses, random order", "all", 0.4, 5);
  row("Top-1: ", "poses, random order, first selected", "rho 1.4", 0.75, 4);  // and s05
  row("Top-1: ", "positions only, random order", "rho 1.4", 1.0, 1);          // s08
  row("Top-1: ", "poses, random order, or the class that is stated with the name holds the truth", "rho 1.4", 0.75, 4);
  row("Top-1: ", "the class stated with the right name holds the truth itself", "all", 2.0 / 3.0, 3);
  row("Top-1 by", "named right", "coil_gain", 1.0 / 3.0, 3);                          // s08 of s05 s08 s18
  row("Detection", "false alarms without an effect", "all", 1.0 / 3.0, 3);            // s02
  row("Detection", "effects of the catalogue missed (no_gap)", "all", 2.0 / 6.0, 6);  // s07 s18
  row("Outside", "called unexplained or partly explained", "all", 0.5, 2);            // s09
  row("Outside", "called unexplained or partly explained", "rho 1.4 and more", 1.0, 1);
  row("Outside", "called explained, and more than half is left", "all", 0.5, 2);  // s10
  row("Outside", "called explained, and more than half is left", "rho 2.8", 0.0, 1);
  row("Outside", "called no_gap", "all", 0.0, 2);
  row("Outside", "in the catalogue, but so called", "all", 2.0 / 6.0, 6);  // s06 s18
  row("Location", "compact_metal, median", "rho 1.4", 5.0, 1);             // 3-4-5 triangle
  row("Location", "these four, 90 %", "all", 5.0, 1);
  row("Shrinkage", "one effect, over the oracle's", "all", 0.75, 6);  // 0 0 0.5 1 1 1
  row("Shrinkage", "one effect, itself", "all", 0.65, 6);             // 0 0 0.5 0.8 0.9 0.9
  row("Coverage", "components of the location", "all", 2.0 / 3.0, 3);
  row("Coverage", "amplitude", "all", 1.0, 1);
  row("Probability", "Brier score", "all", 3.63 / 15.0, 15);
  row("Probability", "expected calibration error", "all", 4.3 / 15.0, 15);
  row("Probability", "90 % set holds the truth", "rho 0.7 and more", 0.6, 5);  // not s05, s18
  row("Probability", "classes in the 90 % set, mean", "rho 0.7 and more", 1.75, 4);
  row("Sets", "true effects selected (recall)", "two or three at once", 1.0, 4);
  row("Sets", "selected effects true (precision)", "two or three at once", 0.8, 5);
  row("Sets", "set exact", "two or three at once", 0.5, 2);
  row("Effects of the signal", "found", "all", 0.5, 2);
  row("Negative controls", "no cause named", "all", 2.0 / 3.0, 3);
  row("Negative controls", "no cause named", "mirrored", 0.0, 1);
  row("Negative controls", "answered as wanted", "all", 2.0 / 3.0, 3);
  row("Negative controls", "a cause named", "mirrored", 1.0, 1);
  row("Time", "median", "all", 2.0, 14);
  // 0.85, 0.25 and 0.8, nothing of s07, which saw no gap, 0.7, and nothing of s18, which was not answered.
  row("At places", "excess taken away in the hull, median", "all", 0.475, 6);
  // Stated as 0.1, 0.5, 0.2 and 0.1, each give or take 0.1, and nothing of s18.
  row("At places", "the interval of what is left holds it", "all", 0.4, 5);
  row("At places", "what is left is stated within 0.1", "all", 0.4, 5);
  row("True causes refused", "compact_metal", "all", 0.5, 2);
  row("True causes refused", "compact_metal", "rho 0.35", 0.0, 1);
  row("True causes refused", "width of the interval of what is left, median", "all", 0.2, 4);
  row("True causes refused", "no interval of what is left can be told", "all", 0.0, 4);
}

void BlindScoreTest::countsByHand() {
  QFETCH(QString, section);
  QFETCH(QString, figure);
  QFETCH(QString, group);
  QFETCH(double, value);
  QFETCH(int, count);
  static const Folder folder;
  static const json board = scored(folder.path);
  QVERIFY(!board.is_null());
  int found = 0;
  for (const json& row : board["figures"]) {
    const bool is_meant = row["section"].get<std::string>().rfind(section.toStdString(), 0) == 0 &&
                          row["figure"] == figure.toStdString() && row["sessions"] == group.toStdString();
    if (!is_meant) continue;
    ++found;
    QVERIFY2(std::abs(row["value"].get<double>() - value) < 1e-9, row.dump().c_str());
    QVERIFY2(row["n"] == count, row.dump().c_str());
  }
  QCOMPARE(found, 1);
}

void BlindScoreTest::confusionByHand() {
  const Folder folder;
  const json expected = {{"none", {{"none", 2}, {"coil_gain", 1}}},
                         {"global_gain", {{"global_gain", 1}}},
                         {"coil_gain", {{"compact_metal", 1}, {"coil_gain", 1}, {"no answer", 1}}},
                         {"compact_metal", {{"compact_metal", 1}, {"none", 1}}},
                         {"outside the catalogue", {{"unexplained", 1}, {"coil_gain", 1}}}};
  QCOMPARE(scored(folder.path)["confusion"].dump(), expected.dump());
}

void BlindScoreTest::unansweredSessionsAreListed() {
  const Folder folder;
  QCOMPARE(scored(folder.path)["unanswered"].dump(), std::string(R"(["s18: exit status 1"])"));
  const std::string table = textOf(folder.path / "score.md");
  QVERIFY(table.find("| false alarms without an effect | all | 0.333 |") != std::string::npos);
  QVERIFY(table.find("missed by") != std::string::npos);
}

void BlindScoreTest::targetsAllowForTheInterval_data() {
  QTest::addColumn<int>("kind");
  QTest::addColumn<double>("value");
  QTest::addColumn<double>("low");
  QTest::addColumn<double>("high");
  QTest::addColumn<double>("missed");
  const auto row = [](const char* name, Target::Kind kind, double value, double low, double high, double missed) {
    QTest::newRow(name) << static_cast<int>(kind) << value << low << high << missed;
  };
  row("reached, 0.02 short", Target::Kind::kAtLeast, 0.88, 0.80, 0.93, 0.0);
  row("reached, but 0.03 short", Target::Kind::kAtLeast, 0.87, 0.80, 0.95, 0.03);
  row("0.01 short, but surely so", Target::Kind::kAtLeast, 0.89, 0.885, 0.895, 0.01);
  row("reached from above", Target::Kind::kAtMost, 0.92, 0.88, 0.96, 0.0);
  row("0.03 too many", Target::Kind::kAtMost, 0.93, 0.88, 0.96, 0.03);
  row("surely 0.01 too many", Target::Kind::kAtMost, 0.91, 0.905, 0.92, 0.01);
  row("inside", Target::Kind::kBetween, 0.92, 0.5, 1.0, 0.0);
  row("covers 0.01 too seldom", Target::Kind::kBetween, 0.89, 0.80, 0.95, 0.0);
  row("covers too often", Target::Kind::kBetween, 0.98, 0.94, 0.99, 0.03);
  row("surely few", Target::Kind::kSurelyAtMost, 0.85, 0.80, 0.94, 0.0);
  row("few, but not surely", Target::Kind::kSurelyAtMost, 0.89, 0.80, 0.97, 0.02);
  row("too many", Target::Kind::kSurelyAtMost, 0.93, 0.90, 0.945, 0.03);
  row("the figure itself", Target::Kind::kValueAtMost, 0.95, 0.5, 1.5, 0.05);
}

void BlindScoreTest::targetsAllowForTheInterval() {
  QFETCH(int, kind);
  QFETCH(double, value);
  QFETCH(double, low);
  QFETCH(double, high);
  QFETCH(double, missed);
  const Figure figure = {
      "", "", "", "share", {value, low, high, 50}, Target{static_cast<Target::Kind>(kind), 0.90, 0.95, 0.02}};
  QVERIFY(std::abs(missedBy(figure).value() - missed) < 1e-12);
}

void BlindScoreTest::changedTruthIsRefused() {
  const Folder folder;
  std::string truth = textOf(folder.path / "truth.json");
  const std::size_t at = truth.find("1.4");
  QVERIFY(at != std::string::npos);
  truth[at + 2] = '5';
  replaceFile(folder.path / "truth.json", truth);
  QCOMPARE(runScore(std::vector<std::string>{"--in", folder.path.string()}), 1);
  QCOMPARE(runAnswer(std::vector<std::string>{"--in", folder.path.string(), "--cli", "/bin/true", "--again"}), 1);
}

void BlindScoreTest::wrongUsageIsTold_data() {
  QTest::addColumn<QStringList>("words");
  QTest::newRow("no folder") << QStringList{};
  QTest::newRow("unknown option") << QStringList{"--in", ".", "--loud"};
  QTest::newRow("value missing") << QStringList{"--in"};
}

void BlindScoreTest::wrongUsageIsTold() {
  QFETCH(QStringList, words);
  std::vector<std::string> plain;
  for (const QString& word : words) plain.push_back(word.toStdString());
  QCOMPARE(runScore(plain), 2);
  QCOMPARE(runAnswer(plain), 2);
  QCOMPARE(runControls(plain), 2);
}

FIELDTRUE_TEST(BlindScoreTest)
#include "blind_score_test.moc"
