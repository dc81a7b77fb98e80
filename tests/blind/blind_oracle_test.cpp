#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <filesystem>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/batch.h"
#include "tests/blind/generate.h"
#include "tests/blind/oracle.h"
#include "tests/blind/oracle_figures.h"
#include "tests/blind/refit.h"
#include "tests/blind/remake.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_draw.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// A design that a kind of effect can be drawn on; known alignment where the kind needs it.
Setup designFor(const Kind& kind, bool knows_alignment, Random& random) {
  for (;;) {
    Setup setup = drawSetup(random, 90);
    setup.position_only = false;
    setup.heavy_tails = false;
    setup.alignment_known = knows_alignment;
    if (kind.fits(setup)) return setup;
  }
}

std::vector<SolvedPose> exactReadings(const Setup& setup, const World& world) {
  std::vector<SolvedPose> readings;
  for (const Row& row : setup.rows) readings.push_back(reported(setup, world, row));
  return readings;
}

/// Squares of position that a fit leaves at places between the rows, over those that no effect at all leaves.
double leftBetween(const Setup& setup, const World& world, const Refit& fit, Random& random) {
  double start_m2 = 0, after_m2 = 0;
  for (int n = 0; n < 60; ++n) {
    const auto any = [&] {
      return setup.rows[static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(setup.rows.size()) - 1))];
    };
    Row row = any();
    row.place_m += 0.3 * (any().place_m - row.place_m);
    const SolvedPose truth = reported(setup, world, row);
    start_m2 += (setup.expected(row).position_m - truth.position_m).squaredNorm();
    after_m2 += (reported(fit.setup, fit.world, row).position_m - truth.position_m).squaredNorm();
  }
  return after_m2 / start_m2;
}

/// Readings with all noise of a session, as its table has them.
std::vector<SolvedPose> noisyReadings(const Setup& setup, const World& world, Random& random) {
  const QTemporaryDir folder;
  const fs::path path = fs::path(folder.path().toStdString()) / "nodes.csv";
  replaceFile(path, recordSession(setup, world, Alignment(setup), {}, false, random).nodes_csv);
  const SessionTable nodes = readTable(path);
  std::vector<SolvedPose> readings;
  for (const auto& row : nodes.rows) readings.push_back(trackedPose(nodes, row));
  return readings;
}

json squares(double start_m2, double after_m2) {
  return {{"inside", {{"start_m2", start_m2}, {"after_m2", after_m2}}}};
}

Session scored(const std::string& file, double start_m2, double oracle_left, bool is_answered) {
  Session session;
  session.file = file;
  session.shelf = "single";
  session.rho_level = 1.4;
  session.effects = {{"global_gain", 1.4, std::nullopt, "", 0.0}};
  session.answer.is_answered = is_answered;
  session.answer.verdict = is_answered ? "explained" : "";
  session.results["oracle"] = squares(start_m2, oracle_left * start_m2);
  session.results["oracle"]["parameters_known"] = squares(start_m2, 0.1 * start_m2);
  return session;
}

const Figure* figureNamed(const std::vector<Figure>& figures, const std::string& name, const std::string& group) {
  for (const Figure& figure : figures)
    if (figure.group == group && figure.name.find(name) != std::string::npos) return &figure;
  return nullptr;
}

}  // namespace

class BlindOracleTest : public QObject {
  Q_OBJECT
 private slots:
  /// From parameters beside the truth, readings without noise lead back to it: every kind of every shelf.
  void findsTheTruthWithoutNoise_data();
  void findsTheTruthWithoutNoise();
  /// What is left whitened has the size that its degrees of freedom give it, and a parameter more takes one of them.
  void whitenedSquaresCountTheirFreedom();
  void heavyTailsAreWeighted();
  void recordedRowsAreFittedNoWorseThanByTheTruth();
  void sameBytesHoweverMany();
  void otherTablesAreRefused();
  void whatIsThereIsLeft();
  void failuresAreNamed();
  void shrinkageOverTheOracleByHand();
};

void BlindOracleTest::findsTheTruthWithoutNoise_data() {
  QTest::addColumn<const Kind*>("kind");
  QTest::addColumn<bool>("knows_alignment");
  for (const std::vector<Kind>* kinds : {&catalogueKinds(), &alignedKinds(), &foreignKinds()})
    for (const Kind& kind : *kinds) QTest::newRow(kind.id.c_str()) << &kind << (kinds == &alignedKinds());
}

void BlindOracleTest::findsTheTruthWithoutNoise() {
  QFETCH(const Kind*, kind);
  QFETCH(bool, knows_alignment);
  Random random(11);
  const Setup setup = designFor(*kind, knows_alignment, random);
  Placed placed;
  placed.drawn = kind->draw(setup, random);
  placed.size = std::sqrt(placed.drawn.smallest * placed.drawn.largest);
  const World world = worldOf({placed});
  std::vector<RefittedEffect> start = asDrawn({placed});
  start[0].size *= 1.1;
  for (std::size_t k = 0; k < start[0].change.size(); ++k) start[0].change[k] = 0.15 * placed.drawn.scales[k];
  const auto readings = exactReadings(setup, world);
  const Refit begun = refitted(setup, {placed}, start, readings, false);
  const Refit fit = refitted(setup, {placed}, start, readings, true);
  const double begun_left = leftBetween(setup, world, begun, random), left = leftBetween(setup, world, fit, random);
  QVERIFY2(left < 1e-3 && left < 0.1 * begun_left, std::to_string(left).c_str());
}

void BlindOracleTest::whitenedSquaresCountTheirFreedom() {
  Random random(12);
  const Setup setup = designFor(catalogueKinds().front(), false, random);
  const Kind* gain = nullptr;
  for (const Kind& kind : catalogueKinds())
    if (kind.id == "global_gain") gain = &kind;
  QVERIFY(gain != nullptr);
  Placed placed;
  placed.drawn = gain->draw(setup, random);
  placed.size = 0.01;
  const World world = worldOf({placed});
  constexpr int kDraws = 40;
  double known = 0, less = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto readings = noisyReadings(setup, world, random);
    const Refit aligned = refitted(setup, {placed}, asDrawn({placed}), readings, false);
    known += aligned.cost / kDraws;
    less += (aligned.cost - refitted(setup, {placed}, asDrawn({placed}), readings, true).cost) / kDraws;
  }
  const double unknowns = setup.orientations > 1 ? 12 : 9;
  const double freedom = 6 * static_cast<double>(setup.rows.size()) - unknowns;
  QVERIFY2(std::abs(known / freedom - 1) < 0.05, std::to_string(known / freedom).c_str());
  // Chi-squared of one degree of freedom has mean 1 and variance 2.
  QVERIFY2(std::abs(less - 1) < 3.5 * std::sqrt(2.0 / kDraws), std::to_string(less).c_str());
}

void BlindOracleTest::heavyTailsAreWeighted() {
  Random random(13);
  Setup setup = designFor(catalogueKinds().front(), false, random);
  setup.orientations = 1;
  auto readings = exactReadings(setup, {});
  readings.front().position_m += Vector3d(0, 0, 0.5);
  const auto shiftOfMiddle_m = [&](bool has_heavy_tails) {
    setup.heavy_tails = has_heavy_tails;
    const Refit fit = refitted(setup, {}, {}, readings, true);
    double shift_m = 0;
    for (const Row& row : setup.rows)
      shift_m += (fit.setup.expected(row).position_m - setup.expected(row).position_m).norm();
    return shift_m / static_cast<double>(setup.rows.size());
  };
  // Least squares move the middle by half a metre over the number of rows; a row of weight 5 / (2 + r^2) by next to
  // nothing.
  QVERIFY(shiftOfMiddle_m(false) > 0.4 / static_cast<double>(setup.rows.size()));
  QVERIFY(shiftOfMiddle_m(true) < 1e-4);
}

void BlindOracleTest::recordedRowsAreFittedNoWorseThanByTheTruth() {
  const QTemporaryDir folder;
  const fs::path path = folder.path().toStdString();
  double oracle = 0, known = 0;
  constexpr int kSessions = 16;
  for (int n = 0; n < kSessions; ++n) {
    const MadeSession made = makeSession({"single", 1.4, false, 80, ""}, 100U + static_cast<std::uint64_t>(n));
    replaceFile(path / "nodes.csv", made.tables.nodes_csv);
    replaceFile(path / "unseen.csv", made.tables.unseen_csv);
    const json entry = oracleOf(made, readTable(path / "nodes.csv"), readTable(path / "unseen.csv"));
    QVERIFY2(entry["cost"] <= entry["parameters_known"]["cost"], made.effects[0].drawn.id.c_str());
    const auto left = [](const json& one) {
      return one["inside"]["after_m2"].get<double>() / one["inside"]["start_m2"].get<double>();
    };
    oracle += left(entry) / kSessions;
    known += left(entry["parameters_known"]) / kSessions;
  }
  // To know the parameters is never worse than to learn them from noisy rows, on average; both leave little at 1.4.
  QVERIFY2(known <= oracle && oracle < 0.15, (std::to_string(known) + " " + std::to_string(oracle)).c_str());
}

void BlindOracleTest::sameBytesHoweverMany() {
  const QTemporaryDir folder;
  std::vector<std::string> texts;
  for (const char* jobs : {"1", "2"}) {
    const std::string set = folder.filePath(jobs).toStdString();
    QCOMPARE(runGenerate(std::vector<std::string>{"--seed", "5", "--sessions", "6", "--shelf", "single", "--max-rows",
                                                  "60", "--cli", "/nowhere", "--out", set}),
             0);
    QCOMPARE(runOracle(std::vector<std::string>{"--in", set, "--jobs", jobs}), 0);
    texts.push_back(textOf(fs::path(set) / "oracle.json"));
  }
  QCOMPARE(json::parse(texts[0])["sessions"].size(), std::size_t(6));
  QCOMPARE(texts[0], texts[1]);
}

void BlindOracleTest::otherTablesAreRefused() {
  const QTemporaryDir folder;
  const fs::path set = folder.filePath("set").toStdString();
  QCOMPARE(runGenerate(std::vector<std::string>{"--seed", "6", "--sessions", "2", "--shelf", "off", "--max-rows", "60",
                                                "--cli", "/nowhere", "--out", set.string()}),
           0);
  const json truth = openSealed(set);
  QCOMPARE(remadeSession(set, truth, "session_0002").tables.nodes_csv, textOf(set / "session_0002.nodes.csv"));
  replaceFile(set / "session_0002.nodes.csv", textOf(set / "session_0001.nodes.csv"));
  QCOMPARE(runOracle(std::vector<std::string>{"--in", set.string(), "--from", "1", "--to", "1"}), 0);
  QCOMPARE(runOracle(std::vector<std::string>{"--in", set.string(), "--from", "2"}), 1);
  QCOMPARE(runOracle(std::vector<std::string>{"--in", set.string(), "--jobs", "many"}), 2);
  QCOMPARE(runOracle(std::vector<std::string>{"--jobs", "1"}), 2);
}

void BlindOracleTest::whatIsThereIsLeft() {
  const QTemporaryDir folder;
  const ResultFile file(folder.filePath("made.json").toStdString(), "test/1");
  const std::vector<json> sessions = {{{"file", "b"}}, {{"file", "a"}}, {{"file", "c"}}};
  std::string changed;
  const auto made_from = [&](const json& session) { return session["file"] == changed ? "new" : "old"; };
  const auto make = [&](const json& session) { return json{{"value", session["file"]}}; };
  QCOMPARE(file.fill(2, sessions, made_from, make), std::size_t(3));
  QCOMPARE(file.fill(2, sessions, made_from, make), std::size_t(0));
  changed = "a";
  QCOMPARE(file.fill(1, sessions, made_from, make), std::size_t(1));
  const json entries = documentOf(folder.filePath("made.json").toStdString())["sessions"];
  QCOMPARE(entries.size(), std::size_t(3));
  QVERIFY(entries[0] == json({{"file", "a"}, {"made_from", "new"}, {"value", "a"}}));
  QVERIFY(entries[2] == json({{"file", "c"}, {"made_from", "old"}, {"value", "c"}}));
}

void BlindOracleTest::failuresAreNamed() {
  const QTemporaryDir folder;
  const ResultFile file(folder.filePath("made.json").toStdString(), "test/1");
  const auto make = [](const json& session) -> json {
    if (session["file"] == "bad") throw std::runtime_error("went wrong");
    return json::object();
  };
  const auto made_from = [](const json&) { return "x"; };
  std::string told;
  try {
    file.fill(1, {{{"file", "good"}}, {{"file", "bad"}}}, made_from, make);
  } catch (const std::runtime_error& problem) {
    told = problem.what();
  }
  QCOMPARE(told, std::string("bad: went wrong"));
  QCOMPARE(documentOf(folder.filePath("made.json").toStdString())["sessions"].size(), std::size_t(1));
}

void BlindOracleTest::shrinkageOverTheOracleByHand() {
  // The report leaves half where the oracle leaves a fifth, and is silent where the oracle leaves nothing.
  Session found = scored("a", 4.0, 0.2, true), silent = scored("b", 1.0, 0.0, false);
  found.results["foretold"] = squares(4.0, 2.0);
  found.answer.left_inside = 0.5;
  std::vector<Figure> figures;
  addOracleFigures(figures, {&found, &silent});
  for (const char* group : {"rho 1.4", "one effect"}) {
    const Figure* alike = figureNamed(figures, "counts alike", group);
    const Figure* summed = figureNamed(figures, "summed", group);
    QVERIFY(alike != nullptr && summed != nullptr);
    QVERIFY(std::abs(alike->interval.value - (0.5 + 0) / (0.8 + 1)) < 1e-12);
    QVERIFY(std::abs(summed->interval.value - (4 * 0.5 + 0) / (4 * 0.8 + 1)) < 1e-12);
    QCOMPARE(alike->interval.count, std::size_t(2));
  }
  QVERIFY(figureNamed(figures, "counts alike", "rho 2.8") == nullptr);
  figures.clear();
  found.results.erase("foretold");
  addOracleFigures(figures, {&found, &silent});
  QVERIFY(figures.empty());
}

FIELDTRUE_TEST(BlindOracleTest)
#include "blind_oracle_test.moc"
