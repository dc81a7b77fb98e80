#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <filesystem>

#include "tests/blind/answer.h"
#include "tests/blind/score.h"
#include "tests/blind/sealed_folder.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// Sealed sessions s01, s02 and so on, one of each shelf.
json truthOf(const std::vector<std::string>& shelves) {
  json sessions = json::array();
  for (const std::string& shelf : shelves) {
    json effects = json::array();
    if (shelf != "none") effects.push_back({{"id", "coil_gain"}, {"rho", 1.4}});
    sessions.push_back({{"file", "s0" + std::to_string(sessions.size() + 1)}, {"shelf", shelf}, {"effects", effects}});
  }
  return {{"schema", "fieldtrue.blind/1"}, {"seed", 1}, {"role", "dev"}, {"sessions", sessions}};
}

/// A folder with two sessions and a stand-in for the diagnosis that notes its arguments.
struct Unanswered {
  QTemporaryDir holder;
  fs::path path = holder.path().toStdString();
  fs::path cli = path / "stand_in";

  Unanswered() {
    sealTruth(path, truthOf({"none", "none"}));
    for (const char* file : {"s01", "s02"}) replaceFile(path / (std::string(file) + ".nodes.csv"), "node\n1\n");
    replaceFile(path / "s02.samples.csv", "node\n1\n");
    replaceFile(cli,
                "#!/bin/sh\n"
                "echo \"$@\": $(ls) >> \"$(dirname \"$0\")/calls\"\n"
                "[ -e \"$(dirname \"$0\")/broken\" ] && exit 3\n"
                "while [ \"$1\" != --out ]; do shift; done\n"
                "echo '{\"verdict\": \"no_gap\", \"candidates\": [], \"selected\": []}' > \"$2\"\n"
                "while [ \"$1\" != --updated-scene ]; do shift; done\n"
                "echo '{}' > \"$2\"\n");
    fs::permissions(cli, fs::perms::owner_all);
  }

  int answer(std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--in", path.string(), "--cli", cli.string(), "--jobs", "2"});
    return runAnswer(more);
  }
  std::string calls() const { return fs::exists(path / "calls") ? textOf(path / "calls") : ""; }
};

}  // namespace

class BlindAnswerTest : public QObject {
  Q_OBJECT
 private slots:
  void changedAnswerIsRefused();
  void answersAreWrittenOnce();
  void theDiagnosisSeesNoLabel();
  void failuresAreRecorded();
  void aStoppedRunGoesOnWhereItStopped();
  void aDiagnosisThatTakesTooLongIsWrong();
  void onlyTheAskedSessionsAreAnswered();
};

void BlindAnswerTest::changedAnswerIsRefused() {
  const Unanswered folder;
  QCOMPARE(folder.answer(), 0);
  const std::vector<std::string> words = {"--in", folder.path.string()};
  QCOMPARE(runScore(words), 0);
  replaceFile(folder.path / "s01.gap.json", R"({"verdict": "explained", "candidates": [], "selected": []})");
  QCOMPARE(runScore(words), 1);
}

void BlindAnswerTest::answersAreWrittenOnce() {
  const Unanswered folder;
  QCOMPARE(folder.answer(), 0);
  const std::string first_calls = folder.calls();
  const std::string records = textOf(folder.path / "answers.json");
  QCOMPARE(folder.answer(), 0);
  QCOMPARE(folder.calls(), first_calls);
  QCOMPARE(textOf(folder.path / "answers.json"), records);
  QCOMPARE(folder.answer({"--again"}), 0);
  QCOMPARE(folder.calls().size(), 2 * first_calls.size());
  QCOMPARE(documentOf(folder.path / "answers.json")["sessions"].size(), std::size_t(2));
}

void BlindAnswerTest::theDiagnosisSeesNoLabel() {
  const Unanswered folder;
  QCOMPARE(folder.answer(), 0);
  // What it is told, and all that lies in the folder it works in.
  const std::string calls = folder.calls();
  QVERIFY(calls.find("diagnose --nodes nodes.csv --out report.gap.json "
                     "--updated-scene updated.scene.json --threads 1: nodes.csv\n") != std::string::npos);
  QVERIFY(calls.find("diagnose --nodes nodes.csv --samples samples.csv --out report.gap.json "
                     "--updated-scene updated.scene.json --threads 1: nodes.csv "
                     "samples.csv\n") != std::string::npos);
}

void BlindAnswerTest::failuresAreRecorded() {
  const Unanswered folder;
  replaceFile(folder.path / "broken", "");
  QCOMPARE(folder.answer(), 0);
  const json records = documentOf(folder.path / "answers.json")["sessions"];
  QCOMPARE(records.size(), std::size_t(2));
  for (const json& record : records) QVERIFY(record["exit_status"] == 3);
  const std::string calls = folder.calls();
  QCOMPARE(folder.answer(), 0);
  QCOMPARE(folder.calls(), calls);
  QCOMPARE(runScore(std::vector<std::string>{"--in", folder.path.string()}), 1);
}

void BlindAnswerTest::aStoppedRunGoesOnWhereItStopped() {
  const Unanswered folder;
  QCOMPARE(folder.answer({"--to", "1"}), 0);
  const std::string first = textOf(folder.path / "s01.gap.json");
  // The second was stopped after its report was written, before it was recorded.
  replaceFile(folder.path / "s02.gap.json", "half a rep");
  QCOMPARE(folder.answer(), 0);
  QCOMPARE(textOf(folder.path / "s01.gap.json"), first);
  QCOMPARE(documentOf(folder.path / "s02.gap.json")["verdict"].get<std::string>(), std::string("no_gap"));
  const std::string calls = folder.calls();
  QCOMPARE(std::count(calls.begin(), calls.end(), '\n'), 2);
}

void BlindAnswerTest::aDiagnosisThatTakesTooLongIsWrong() {
  const Unanswered folder;
  replaceFile(folder.cli, "#!/bin/sh\necho '{\"verdict\": \"no_gap\"}' > report.gap.json\nexec sleep 20\n");
  fs::permissions(folder.cli, fs::perms::owner_all);
  QCOMPARE(folder.answer({"--limit", "0.3"}), 0);
  const json answers = documentOf(folder.path / "answers.json");
  for (const json& record : answers["sessions"]) {
    QVERIFY(record["exit_status"] == 124);
    QVERIFY(record["seconds"].get<double>() < 10.0);
  }
  QVERIFY(!fs::exists(folder.path / "s01.gap.json"));
}

void BlindAnswerTest::onlyTheAskedSessionsAreAnswered() {
  const Unanswered folder;
  QCOMPARE(folder.answer({"--from", "2", "--to", "2"}), 0);
  QVERIFY(!fs::exists(folder.path / "s01.gap.json"));
  QVERIFY(fs::exists(folder.path / "s02.gap.json"));
  QCOMPARE(folder.answer({"--from", "1", "--to", "1"}), 0);
  QCOMPARE(documentOf(folder.path / "answers.json")["sessions"].size(), std::size_t(2));
  QCOMPARE(folder.answer({"--from", "3"}), 1);
}

FIELDTRUE_TEST(BlindAnswerTest)
#include "blind_answer_test.moc"
