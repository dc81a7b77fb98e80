#include <QTemporaryDir>
#include <QTest>
#include <filesystem>
#include <set>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/judgement.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"
#include "tests/blind/subprocess.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

#ifdef __SANITIZE_ADDRESS__
const std::string kLimit_s = "900";  // A diagnosis takes ten to twenty times as long.
#else
const std::string kLimit_s = "60";
#endif

std::string programFrom(const char* name) { return qEnvironmentVariable(name).toStdString(); }

/// One set as a user makes it: generated, answered by the built fieldtrue-cli and scored by the built program.
struct Round {
  fs::path path;
  Finished generated, answered, foretold, scored;

  Round(const fs::path& folder, std::vector<std::string> words) : path(folder) {
    const std::string blind = programFrom("FIELDTRUE_BLIND"), cli = programFrom("FIELDTRUE_CLI");
    std::vector<std::string> all = {blind, "generate", "--out", path.string(), "--cli", cli, "--max-rows", "80"};
    all.insert(all.end(), words.begin(), words.end());
    generated = runProgram(all);
    answered = runProgram({blind, "answer", "--in", path.string(), "--cli", cli, "--jobs", "2", "--limit", kLimit_s});
    foretold = runProgram({blind, "foretell", "--in", path.string(), "--cli", cli, "--jobs", "2"});
    scored = runProgram({blind, "score", "--in", path.string(), "--json", (path / "score.json").string()});
  }
  std::vector<Session> sessions() const { return sessionsOf(openSealed(path), path); }
};

/// What a report lacks of the contract; empty when it is whole.
std::string faultOf(const json& report) {
  if (report.value("schema", "") != "fieldtrue.gap/1") return "schema";
  for (const char* key : {"software", "input", "alignment", "verdict", "text", "smallest_detectable", "gap", "where",
                          "findings", "candidates", "selected", "remaining", "isolability", "next_measurement"})
    if (!report.contains(key)) return std::string("no ") + key;
  for (const char* key : {"position_rms_mm", "floor_position_mm", "ratio_to_floor", "p_value"})
    if (!report["gap"].contains(key)) return std::string("no gap.") + key;
  double probability = 0;
  std::set<std::string> named;
  for (const json& candidate : report["candidates"]) {
    const std::string id = candidate.value("effect", "");
    if (!named.insert(id).second) return "candidate twice: " + id;
    for (const char* key : {"class", "probability", "bic_gain", "parameters", "location_m", "material", "shrinkage"})
      if (!candidate.contains(key)) return id + " has no " + key;
    const double share = candidate["probability"].get<double>();
    if (!(share >= 0 && share <= 1)) return "probability of " + id;
    probability += share;
    for (const auto& [name, parameter] : candidate["parameters"].items()) {
      if (!parameter.contains("low90") || !parameter.contains("high90"))
        return std::string(id).append(".").append(name).append(" has no interval");
      if (parameter["low90"].is_number() && parameter["high90"].is_number() &&
          parameter["low90"].get<double>() > parameter["high90"].get<double>())
        return std::string("interval of ").append(id).append(".").append(name);
    }
  }
  if (named.count("none") == 0) return "none is no candidate";
  if (std::abs(probability - 1) > 1e-6) return "probabilities sum to " + std::to_string(probability);
  const bool is_explained = report["verdict"] == "explained" || report["verdict"] == "partly_explained";
  if (is_explained && report["selected"].empty()) return "explained by nothing";
  return "";
}

}  // namespace

/// Slow for a test, quick for what it runs: about half a minute on two cores.
class BlindSmallSetTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase();
  void theSealMatches();
  void everySessionIsAnswered();
  void everyAnswerIsAValidReport();
  void theScoreboardIsPrinted();
  void strongEffectsAreNamed();
  void whatWasFoundIsPutToTheTest();
  void changedScenesAreFound();
  void bothTrackersAreOne();
  void tamperedTruthIsFound();
  void helpTellsEveryCommand_data();
  void helpTellsEveryCommand();

 private:
  QTemporaryDir holder_;
  std::unique_ptr<Round> mixed_;
  std::unique_ptr<Round> strong_;
};

void BlindSmallSetTest::initTestCase() {
  for (const char* name : {"FIELDTRUE_BLIND", "FIELDTRUE_CLI"})
    if (!fs::exists(programFrom(name))) QSKIP("run by ctest, which names the two programs in FIELDTRUE_BLIND and _CLI");
  const fs::path folder = holder_.path().toStdString();
  mixed_ = std::make_unique<Round>(folder / "mixed", std::vector<std::string>{"--seed", "21", "--sessions", "16"});
  strong_ = std::make_unique<Round>(
      folder / "strong",
      std::vector<std::string>{"--seed", "22", "--sessions", "8", "--shelf", "single", "--strength", "2.8"});
}

void BlindSmallSetTest::theSealMatches() {
  for (const Round* round : {mixed_.get(), strong_.get()}) {
    QCOMPARE(round->generated.exit_status, 0);
    const std::string hash = sha256Hex(textOf(round->path / "truth.json"));
    QCOMPARE(documentOf(round->path / "seal.json")["truth_sha256"].get<std::string>(), hash);
    // Published before anything is answered.
    QVERIFY(round->generated.output.find(hash) != std::string::npos);
    QCOMPARE(openSealed(round->path)["classes_from"].get<std::string>(), std::string("plan-check"));
  }
}

void BlindSmallSetTest::everySessionIsAnswered() {
  for (const Round* round : {mixed_.get(), strong_.get()}) {
    QCOMPARE(round->answered.exit_status, 0);
    for (const Session& session : round->sessions())
      QVERIFY2(session.answer.is_answered, (session.file + ": " + session.answer.trouble).c_str());
    const json answers = documentOf(round->path / "answers.json");
    for (const json& record : answers["sessions"]) QVERIFY2(record["exit_status"] == 0, record.dump().c_str());
  }
}

void BlindSmallSetTest::everyAnswerIsAValidReport() {
  for (const Round* round : {mixed_.get(), strong_.get()})
    for (const Session& session : round->sessions()) {
      QVERIFY2(session.answer.is_answered, (session.file + ": " + session.answer.trouble).c_str());
      const std::string fault = faultOf(documentOf(round->path / (session.file + ".gap.json")));
      QVERIFY2(fault.empty(), (session.file + ": " + fault).c_str());
    }
}

void BlindSmallSetTest::theScoreboardIsPrinted() {
  QCOMPARE(mixed_->scored.exit_status, 0);
  for (const char* title : {"16 sessions, 0 without an answer", "Top-1", "Detection", "Outside the catalogue",
                            "Shrinkage", "Probability", "Sets of effects", "Time", "Confusion"})
    QVERIFY2(mixed_->scored.output.find(title) != std::string::npos, title);
  const json board = documentOf(mixed_->path / "score.json");
  QVERIFY(!board["figures"].empty());
  for (const json& figure : board["figures"]) {
    QVERIFY2(figure["low95"].is_number() && figure["high95"].is_number(), figure.dump().c_str());
    QVERIFY2(figure["low95"] <= figure["value"] && figure["value"] <= figure["high95"], figure.dump().c_str());
  }
}

void BlindSmallSetTest::strongEffectsAreNamed() {
  int named = 0;
  for (const Session& session : strong_->sessions()) {
    const bool is_right = isRight(session, firstNamed(session));
    if (!is_right)
      qInfo("%s: %s, named %s", session.file.c_str(), session.effects[0].id.c_str(), firstNamed(session).c_str());
    named += is_right ? 1 : 0;
  }
  // Guessing among a dozen effects names fewer than one of eight.
  QVERIFY2(named >= 6, std::to_string(named).c_str());
}

void BlindSmallSetTest::whatWasFoundIsPutToTheTest() {
  for (const Round* round : {mixed_.get(), strong_.get()}) {
    QCOMPARE(round->foretold.exit_status, 0);
    const json foretold = documentOf(round->path / "foretold.json");
    QCOMPARE(foretold["sessions"].size(), round->sessions().size());
    for (const json& entry : foretold["sessions"]) {
      QVERIFY2(!entry.contains("trouble"), entry.dump().c_str());
      QCOMPARE(entry["inside"]["n"].get<int>(), 150);
      QCOMPARE(entry["outside"]["n"].get<int>(), 50);
    }
  }
  // An effect at 2.8 of gap to noise, named right, foretells what was not measured: in most sessions far better.
  int better = 0;
  for (const Session& session : strong_->sessions()) better += session.answer.left_inside.value_or(1.0) < 0.5 ? 1 : 0;
  QVERIFY2(better >= 5, std::to_string(better).c_str());
  QVERIFY(strong_->scored.output.find("At places that no table held") != std::string::npos);
}

void BlindSmallSetTest::changedScenesAreFound() {
  const fs::path folder = fs::path(holder_.path().toStdString()) / "changed";
  fs::copy(strong_->path, folder, fs::copy_options::recursive);
  const fs::path scene = folder / (strong_->sessions().front().file + ".scene.json");
  replaceFile(scene, textOf(scene) + " ");
  QCOMPARE(runProgram({programFrom("FIELDTRUE_BLIND"), "foretell", "--in", folder.string()}).exit_status, 1);
}

/// Without an effect the program's simulator and the check's own arithmetic are one tracker.
void BlindSmallSetTest::bothTrackersAreOne() {
  const SessionTable nodes = readTable(mixed_->path / (mixed_->sessions().front().file + ".nodes.csv"));
  const BareAlignment bare = bareAlignment(nodes);
  const SolvedPose jig_from_tracker = inverse(bare.tracker_from_jig);
  const auto turn = [](const SolvedPose& pose) {
    return json{pose.orientation.w(), pose.orientation.x(), pose.orientation.y(), pose.orientation.z()};
  };
  const auto place = [](const SolvedPose& pose) {
    return json{pose.position_m.x(), pose.position_m.y(), pose.position_m.z()};
  };
  const json scene = {
      {"schema", "fieldtrue.scene/1"},
      {"transmitter", {{"position_m", place(jig_from_tracker)}, {"orientation_wxyz", turn(jig_from_tracker)}}},
      {"sensor_mount",
       {{"position_m", place(bare.mount_from_sensor)}, {"orientation_wxyz", turn(bare.mount_from_sensor)}}}};
  const fs::path folder = holder_.path().toStdString();
  replaceFile(folder / "bare.scene.json", scene.dump());
  const Finished run =
      runProgram({programFrom("FIELDTRUE_CLI"), "simulate", "--exact", "--scene", (folder / "bare.scene.json").string(),
                  "--plan", "grid:3x3x3@0.3:origin=0.6,-0.3,-0.2", "--nodes", (folder / "bare.nodes.csv").string()});
  QCOMPARE(run.exit_status, 0);
  const SessionTable simulated = readTable(folder / "bare.nodes.csv");
  for (const auto& row : simulated.rows) {
    const SolvedPose wanted = bare.reported(truePose(simulated, row)), got = trackedPose(simulated, row);
    QVERIFY((wanted.position_m - got.position_m).norm() < 1e-5);
    QVERIFY(rotationBetween(wanted.orientation, got.orientation).norm() < 1e-5);
  }
}

void BlindSmallSetTest::tamperedTruthIsFound() {
  const fs::path folder = fs::path(holder_.path().toStdString()) / "tampered";
  fs::copy(mixed_->path, folder, fs::copy_options::recursive);
  std::string truth = textOf(folder / "truth.json");
  const std::size_t at = truth.find("\"shelf\": \"none\"");
  QVERIFY(at != std::string::npos);
  truth.replace(at, 15, "\"shelf\": \"off!\"");
  replaceFile(folder / "truth.json", truth);
  const std::string blind = programFrom("FIELDTRUE_BLIND");
  QCOMPARE(runProgram({blind, "score", "--in", folder.string()}).exit_status, 1);
  QCOMPARE(runProgram({blind, "answer", "--in", folder.string(), "--again", "--cli", "/bin/true"}).exit_status, 1);
  QCOMPARE(runProgram({blind, "score", "--in", mixed_->path.string()}).exit_status, 0);
}

void BlindSmallSetTest::helpTellsEveryCommand_data() {
  QTest::addColumn<QString>("command");
  for (const char* command : {"generate", "answer", "foretell", "oracle", "replicate", "next", "score", "controls"})
    QTest::newRow(command) << command;
}

void BlindSmallSetTest::helpTellsEveryCommand() {
  QFETCH(QString, command);
  const std::string blind = programFrom("FIELDTRUE_BLIND"), name = command.toStdString();
  QVERIFY(runProgram({blind, "--help"}).output.find("\n  " + name + " ") != std::string::npos);
  const Finished help = runProgram({blind, name, "--help"});
  QCOMPARE(help.exit_status, 0);
  QVERIFY(help.output.find("Example: fieldtrue-blind " + name) != std::string::npos);
  QCOMPARE(runProgram({blind, name, "--loud"}).exit_status, 2);
  QCOMPARE(runProgram({blind, "sing"}).exit_status, 2);
}

FIELDTRUE_TEST(BlindSmallSetTest)
#include "blind_small_set_test.moc"
