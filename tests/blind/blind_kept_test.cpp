#include <QTemporaryDir>
#include <QTest>
#include <filesystem>

#include "tests/blind/figures.h"
#include "tests/blind/kept.h"
#include "tests/blind/score_table.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/sha256.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

const std::string kEngine(40, 'a');

std::string fileOf(std::size_t n) { return "session_" + std::to_string(1000 + n); }

json reportOf(std::size_t n) {
  const double left = 0.1 + 0.001 * static_cast<double>(n);
  const json center = {{"value", 0.5 + 1e-9 * static_cast<double>(n)}, {"low90", 0.4}, {"high90", 0.6}, {"unit", "m"}};
  const json first = {{"effect", n % 3 == 0 ? "coil_gain" : "compact_metal"},
                      {"class", {"compact_metal"}},
                      {"probability", 0.9},
                      {"location_m", {0.5, 0.25, 1.0 / 3.0}},
                      {"parameters", {{"center_x_m", center}}},
                      {"picture", std::string(2000, 'x')}};
  return {{"verdict", n % 7 == 0 ? "no_gap" : "explained"},
          {"candidates", {first, {{"effect", "none"}, {"probability", 0.1}}}},
          {"selected", {{{"effect", first.at("effect")}}}},
          {"findings", {{{"effect", ""}, {"text", "aside"}}, {{"effect", "quantization"}}}},
          {"remaining", {{"fraction_of_start", left}, {"fraction_low90", 0.05}, {"fraction_high90", 0.3}}}};
}

/// A sealed set of effects of one kind.
void makeSet(const fs::path& folder, std::size_t n_sessions) {
  json sessions = json::array();
  for (std::size_t n = 0; n < n_sessions; ++n) {
    const json effect = {{"id", "compact_metal"}, {"rho", 1.4}, {"location_m", {0.5, 0.2, 0.3}}};
    sessions.push_back({{"file", fileOf(n)},
                        {"shelf", "single"},
                        {"effects", {effect}},
                        {"rho", 1.4},
                        {"rho_level", 1.4},
                        {"order", "random"},
                        {"classes", {{"compact_metal"}}}});
  }
  fs::create_directories(folder);
  sealTruth(folder, {{"schema", "fieldtrue.blind/1"}, {"sessions", sessions}});
}

void answerSome(const fs::path& folder, std::size_t n_answered) {
  json records = json::array(), foretold = json::array();
  for (std::size_t n = 0; n < n_answered; ++n) {
    const std::string text = reportOf(n).dump(1);
    replaceFile(folder / (fileOf(n) + ".gap.json"), text);
    records.push_back({{"file", fileOf(n)},
                       {"seconds", 1.0 + static_cast<double>(n)},
                       {"exit_status", 0},
                       {"answer_sha256", sha256Hex(text)},
                       {"scene_sha256", std::string(64, 'b')}});
    foretold.push_back({{"file", fileOf(n)}, {"inside", {{"start_m2", 2e-6}, {"after_m2", 2.5e-7}}}});
  }
  replaceFile(folder / "answers.json", json{{"sessions", records}}.dump());
  replaceFile(folder / "foretold.json", json{{"schema", "fieldtrue.blind-foretold/1"}, {"sessions", foretold}}.dump());
}

std::string boardOf(const fs::path& folder) {
  const std::vector<Session> sessions = sessionsOf(openSealed(folder), folder);
  return plainText(scoreboardOf(sessions));
}

}  // namespace

class BlindKeptTest : public QObject {
  Q_OBJECT
 private slots:
  /// Only whole hundreds are kept, the last one may be shorter.
  void keepsWholeParts();
  /// A set drawn again with what was kept scores as the answers themselves did, and its parts can be gone on with.
  void scoresWhatIsKeptAsTheAnswers();
  /// An answer that leaves its cause open keeps the sentence that `next` measures by; a sure one does not.
  void keepsTheSuggestionOfOpenAnswers();
  /// Controls have no sealed places: answered, they are kept.
  void keepsControlsThatAreNotForetold();
  /// Another set's parts, another engine's, a changed report.
  void refusesWhatIsAnothers();
};

void BlindKeptTest::keepsWholeParts() {
  const QTemporaryDir folder;
  const fs::path set = folder.path().toStdString() + "/set", kept = folder.path().toStdString() + "/kept";
  makeSet(set, 230);
  answerSome(set, 199);
  QCOMPARE(keepParts(set, kept, kEngine), 1U);
  QVERIFY(fs::exists(kept / "part_01.json") && !fs::exists(kept / "part_02.json"));
  answerSome(set, 230);
  QCOMPARE(keepParts(set, kept, kEngine), 2U);
  QCOMPARE(documentOf(kept / "part_03.json").at("sessions").size(), 30U);
  QCOMPARE(keepParts(set, kept, kEngine), 0U);
  QVERIFY(fs::file_size(kept / "part_01.json") < 150'000U);
}

void BlindKeptTest::scoresWhatIsKeptAsTheAnswers() {
  const QTemporaryDir folder;
  const fs::path set = folder.path().toStdString() + "/set", again = folder.path().toStdString() + "/again";
  const fs::path kept = folder.path().toStdString() + "/kept";
  makeSet(set, 130);
  answerSome(set, 130);
  keepParts(set, kept, kEngine);
  makeSet(again, 130);
  QVERIFY(boardOf(again) != boardOf(set));
  QCOMPARE(restoreParts(again, kept), 130U);
  QCOMPARE(QString::fromStdString(boardOf(again)), QString::fromStdString(boardOf(set)));
  QCOMPARE(restoreParts(again, kept), 0U);
  // Kept once more from there it is the same, hashes of the reports as they were answered included.
  const fs::path kept_again = folder.path().toStdString() + "/kept_again";
  keepParts(again, kept_again, kEngine);
  const json first = documentOf(kept / "part_01.json").at("sessions").at(5);
  const json second = documentOf(kept_again / "part_01.json").at("sessions").at(5);
  QCOMPARE(QString::fromStdString(second.at("report_sha256")), QString::fromStdString(first.at("report_sha256")));
  QCOMPARE(QString::fromStdString(second.at("report").dump()), QString::fromStdString(first.at("report").dump()));
}

void BlindKeptTest::keepsTheSuggestionOfOpenAnswers() {
  const json sentence = {{"text", "Turn the sensor at three places."}, {"separates", {"a", "b"}}};
  json report = reportOf(1);
  report["next_measurement"] = sentence;
  QVERIFY(!reducedReport(report).contains("next_measurement"));
  report["candidates"][0]["probability"] = 0.6;
  QCOMPARE(QString::fromStdString(reducedReport(report).at("next_measurement").at("text")),
           QString("Turn the sensor at three places."));
}

void BlindKeptTest::keepsControlsThatAreNotForetold() {
  const QTemporaryDir folder;
  const fs::path set = folder.path().toStdString() + "/set", kept = folder.path().toStdString() + "/kept";
  makeSet(set, 10);
  answerSome(set, 10);
  fs::remove(set / "foretold.json");
  QCOMPARE(keepParts(set, kept, kEngine), 0U);
  json truth = openSealed(set);
  for (json& session : truth["sessions"]) session["control"] = "shuffled";
  sealTruth(set, truth);
  QCOMPARE(keepParts(set, kept, kEngine), 1U);
}

void BlindKeptTest::refusesWhatIsAnothers() {
  const QTemporaryDir folder;
  const fs::path set = folder.path().toStdString() + "/set", other = folder.path().toStdString() + "/other";
  const fs::path kept = folder.path().toStdString() + "/kept";
  makeSet(set, 100);
  answerSome(set, 100);
  keepParts(set, kept, kEngine);
  makeSet(other, 101);
  QVERIFY_EXCEPTION_THROWN(restoreParts(other, kept), std::runtime_error);
  QVERIFY_EXCEPTION_THROWN(keepParts(set, kept, std::string(40, 'c')), std::runtime_error);
  fs::remove(kept / "part_01.json");
  replaceFile(set / (fileOf(3) + ".gap.json"), reportOf(4).dump(1));
  QVERIFY_EXCEPTION_THROWN(keepParts(set, kept, kEngine), std::runtime_error);
  const std::vector<std::string> short_id = {"--in", set.string(), "--kept", kept.string(), "--engine", "abc"};
  QCOMPARE(runKeep(short_id), 2);
}

FIELDTRUE_TEST(BlindKeptTest)
#include "blind_kept_test.moc"
