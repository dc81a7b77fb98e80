#include <QTemporaryDir>
#include <QTest>

#include "calib/gap/diagnosis.h"
#include "calib/gap/report_json.h"
#include "calib/tables/table_io.h"
#include "tests/blind/generate.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/subprocess.h"
#include "tests/studies/rooms.h"
#include "tests/studies/staged_diagnosis.h"
#include "tests/studies/tuning.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
namespace fs = std::filesystem;

namespace {

/// Two small sessions with one strong effect each; classes by the generator's own physics.
fs::path generatedIn(const fs::path& folder) {
  const std::vector<std::string> words = {"--out",   folder.string(), "--seed",     "3",   "--sessions", "2",
                                          "--shelf", "single",        "--strength", "2.8", "--max-rows", "48",
                                          "--cli",   "/nowhere"};
  return blind::runGenerate(words) == 0 ? folder : fs::path();
}

/// What a diagnosis decides, as its report tells it.
nlohmann::json decidedIn(const gap::GapReport& report) {
  const nlohmann::json all = gap::toJson(report);
  nlohmann::json named = nlohmann::json::array();
  for (const gap::SelectedEffect& effect : report.selected) named.push_back({effect.effect, effect.equivalents});
  return {all.at("verdict"), all.at("candidates"), all.at("findings"), named};
}

}  // namespace

class TuningStudyTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    set_ = generatedIn(fs::path(folder_.path().toStdString()) / "set");
    QVERIFY(!set_.empty());
    table_ = orThrow(readNodeTable(set_ / "session_0001.nodes.csv")).table;
  }

  void everyFigureIsThere() {
    for (const Deciding& one : decidingOnes()) {
      identify::Thresholds thresholds;
      one.scale(thresholds, 2.0);
      QCOMPARE(one.value(thresholds), 2.0 * one.value({}));
    }
    for (const Trial& trial : trialsOf(chosen({}))) QVERIFY(!trial.name.empty());
    QVERIFY_THROWS_EXCEPTION(std::invalid_argument, chosen({"kAstray"}));
  }

  /// What is not done again is what would come out the same.
  void stagesDecideAsTheWholeDiagnosis_data() {
    QTest::addColumn<QString>("name");
    QTest::addColumn<double>("factor");
    QTest::newRow("default") << "astray" << 1.0;
    QTest::newRow("least_gain_first") << "least_gain_first" << 200.0;
    QTest::newRow("least_nats") << "least_nats" << 1000.0;
    QTest::newRow("least_share") << "least_share" << 4.0;
    QTest::newRow("stated_too_small") << "stated_too_small" << 0.3;
    QTest::newRow("astray") << "astray" << 1e-6;
  }
  void stagesDecideAsTheWholeDiagnosis() {
    QFETCH(QString, name);
    QFETCH(double, factor);
    gap::DiagnosisOptions options;
    chosen({name.toStdString()}).front().scale(options.thresholds, factor);
    StagedDiagnosis staged(table_);
    staged.under({});
    const gap::GapReport whole = gap::diagnose(table_, nullptr, nullptr, options).value();
    const std::string expected = decidedIn(whole).dump(1);
    const std::string seen = decidedIn(staged.under(options.thresholds)).dump(1);
    QCOMPARE(QString::fromStdString(seen), QString::fromStdString(expected));
  }

  /// A name that needs absurd evidence is refused, and one that needs an absurd gain is not even selected.
  void aThresholdDecides() {
    StagedDiagnosis staged(table_);
    QVERIFY(!staged.under({}).selected.empty());
    identify::Thresholds absurd;
    absurd.least_share = 1e6;
    const gap::GapReport refused = staged.under(absurd);
    QVERIFY(refused.selected.empty());
    QVERIFY(refused.verdict == gap::GapVerdict::kUnexplained);
    absurd = {};
    absurd.least_gain_first = absurd.sure_unselected = absurd.sure_nats = 1e9;
    absurd.sure_of_structure = 0.0;
    absurd.stated_too_small = 1e3;
    QVERIFY(staged.under(absurd).verdict == gap::GapVerdict::kNoGap);
    QVERIFY(!staged.under({}).selected.empty());
  }

  void theProgramPrintsATable() {
    const std::string program = qEnvironmentVariable("TUNING_STUDY").toStdString();
    if (program.empty()) QSKIP("TUNING_STUDY names no program");
    const std::vector<std::string> words = {program, "--only", "temperature", "--only", "sure_nats", set_.string()};
    const blind::Finished first = blind::runProgram(words);
    QCOMPARE(first.exit_status, 0);
    QVERIFY(first.output.find("first right, of 2") != std::string::npos);
    QVERIFY(first.output.find("| `temperature` | 2.5 |") != std::string::npos);
    QVERIFY(first.output.find("Nothing changes with half and double of `sure_nats`.") != std::string::npos);
    QCOMPARE(blind::runProgram(words).output, first.output);
    QCOMPARE(blind::runProgram({program, "--only", "nonsense", set_.string()}).exit_status, 2);
  }

 private:
  QTemporaryDir folder_;
  fs::path set_;
  CalibrationTable table_;
};

FIELDTRUE_TEST(TuningStudyTest)
#include "tuning_study_test.moc"
