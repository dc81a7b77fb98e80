#include <QElapsedTimer>
#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <csignal>
#include <filesystem>

#include "tests/blind/diagnosis_run.h"
#include "tests/blind/generate.h"
#include "tests/blind/replicate.h"
#include "tests/blind/replicate_figures.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/subprocess.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// A program in the place of fieldtrue-cli: copies a report to where --out says and notes its options.
fs::path programThatReports(const fs::path& folder, const json& report) {
  replaceFile(folder / "report.json", report.dump());
  const fs::path program = folder / "cli";
  replaceFile(program, "#!/bin/sh\necho \"$@\" >> " + (folder / "options").string() +
                           "\nwhile [ \"$1\" != --out ]; do shift; done\ncp " + (folder / "report.json").string() +
                           " \"$2\"\n");
  fs::permissions(program, fs::perms::owner_all);
  return program;
}

Session replicatedSession(const char* selected, int named_so) {
  Session session;
  session.shelf = "single";
  session.effects = {{"global_gain", 1.4, std::nullopt, "", 0.0}};
  session.classes = {{"global_gain", "grid_scale"}};
  session.results["replicated"] = {{"selected", json::array({selected})}, {"n", 20}, {"named_so", named_so}};
  return session;
}

}  // namespace

class BlindReplicateTest : public QObject {
  Q_OBJECT
 private slots:
  void replicatesAreAskedForAndKept();
  void onlyOneEffectIsReplicated();
  void aFailedDiagnosisIsToldApart();
  void figuresByHand();
  /// A program that comes to no end is ended, and what it had printed is kept.
  void whatTakesForEverIsEnded();
};

void BlindReplicateTest::whatTakesForEverIsEnded() {
  QElapsedTimer timer;
  timer.start();
  const Finished ended = runProgram({"/bin/sh", "-c", "echo begun; exec sleep 600"}, 1.0);
  QVERIFY(timer.elapsed() < 300'000);
  QCOMPARE(ended.exit_status, 128 + SIGKILL);
  QCOMPARE(QString::fromStdString(ended.output), QString("begun\n"));
  QCOMPARE(runProgram({"/bin/sh", "-c", "exit 3"}, 600.0).exit_status, 3);
}

void BlindReplicateTest::replicatesAreAskedForAndKept() {
  const QTemporaryDir holder;
  const fs::path folder = holder.path().toStdString(), set = folder / "set";
  const fs::path cli = programThatReports(
      folder, {{"selected", {{{"effect", "jig_tilt"}}}}, {"replicates", {{"n", 7}, {"named_right", 5}}}});
  QCOMPARE(runGenerate(std::vector<std::string>{"--seed", "8", "--sessions", "4", "--shelf", "single", "--max-rows",
                                                "60", "--cli", "/nowhere", "--out", set.string()}),
           0);
  const std::vector<std::string> garbled = {"--in", set.string(), "--cli",        cli.string(), "--sessions",
                                            "3",    "--jobs",     "--replicates", "7"};
  QCOMPARE(runReplicate(garbled), 2);
  const std::vector<std::string> right = {"--in", set.string(), "--cli", cli.string(),   "--sessions",
                                          "3",    "--jobs",     "2",     "--replicates", "7"};
  QCOMPARE(runReplicate(right), 0);
  const std::string once = textOf(set / "replicated.json");
  const json entries = json::parse(once)["sessions"];
  QCOMPARE(entries.size(), std::size_t(3));
  for (const json& entry : entries) {
    QCOMPARE(entry["selected"].dump(), std::string("[\"jig_tilt\"]"));
    QCOMPARE(entry["n"].get<int>(), 7);
    QCOMPARE(entry["named_so"].get<int>(), 5);
  }
  const std::string options = textOf(folder / "options");
  QVERIFY2(options.find("--replicates 7") != std::string::npos, options.c_str());
  QCOMPARE(std::count(options.begin(), options.end(), '\n'), std::ptrdiff_t(3));
  QCOMPARE(runReplicate(right), 0);
  QCOMPARE(textOf(set / "replicated.json"), once);
  QCOMPARE(textOf(folder / "options"), options);
}

void BlindReplicateTest::onlyOneEffectIsReplicated() {
  const QTemporaryDir holder;
  const fs::path set = fs::path(holder.path().toStdString()) / "set";
  QCOMPARE(runGenerate(std::vector<std::string>{"--seed", "8", "--sessions", "2", "--shelf", "none", "--max-rows", "60",
                                                "--cli", "/nowhere", "--out", set.string()}),
           0);
  QCOMPARE(runReplicate(std::vector<std::string>{"--in", set.string(), "--cli", "/bin/true"}), 1);
}

void BlindReplicateTest::aFailedDiagnosisIsToldApart() {
  QVERIFY(diagnosed("/bin/false", {"nodes", ""}).is_null());
  QVERIFY(diagnosed("/bin/true", {"nodes", "samples"}).is_null());
}

void BlindReplicateTest::figuresByHand() {
  // Named as in 20, 10 and 15 of 20; the second is wrong, the first is another name of the same class.
  std::vector<Session> sessions = {replicatedSession("grid_scale", 20), replicatedSession("jig_tilt", 10),
                                   replicatedSession("global_gain", 15)};
  sessions[2].results["replicated"]["selected"].push_back("correlated_samples");  // No replicate can name it.
  Session failed = replicatedSession("global_gain", 0);
  failed.results["replicated"] = {{"trouble", "the diagnosis failed"}};
  std::vector<Figure> figures;
  addReplicateFigures(figures, {&sessions[0], &sessions[1], &sessions[2], &failed});
  QCOMPARE(figures.size(), std::size_t(5));
  const double expected[] = {0.75, 2.0 / 3, 0.75 - 2.0 / 3, (0 + 0.25 + 0.0625) / 3};
  for (std::size_t n = 0; n < 4; ++n)
    QVERIFY2(std::abs(figures[n].interval.value - expected[n]) < 1e-12, figures[n].name.c_str());
  QCOMPARE(figures[1].interval.count, std::size_t(3));
  figures.clear();
  addReplicateFigures(figures, {&failed});
  QVERIFY(figures.empty());
}

FIELDTRUE_TEST(BlindReplicateTest)
#include "blind_replicate_test.moc"
