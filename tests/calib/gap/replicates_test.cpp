#include <QTest>

#include "calib/gap/report_json.h"
#include "calib/gap/report_reader.h"
#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

/// Recordings made again under what was found tell how far to trust the name.
class ReplicatesTest : public QObject {
  Q_OBJECT
 private slots:
  void aClearCauseIsNamedAgain() {
    const Withheld made = withheldFrom("compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})");
    DiagnosisOptions options;
    options.replicates = 8;
    const auto report = diagnose(made.table, nullptr, nullptr, options);
    FT_VERIFY_OK(report);
    QVERIFY(report->replicates.has_value());
    const Replicates& replicates = *report->replicates;
    QCOMPARE(replicates.n, 8);
    QVERIFY2(replicates.named_right >= 7, replicates.text.c_str());
    QVERIFY(replicates.within_m_median && *replicates.within_m_median < 0.05);
    FT_VERIFY_MATCH(holdsAll(replicates.text, {"is named so", "times of 8", "within", "cm"}));
    const auto read = readGapReport(toJson(*report), "again.gap.json");
    FT_VERIFY_OK(read);
    QVERIFY(toJson(*read)["replicates"] == toJson(*report)["replicates"]);
  }

  void nothingStaysNothing() {
    DiagnosisOptions options;
    options.replicates = 6;
    const auto report = diagnose(recordedIn(gapScene(), gapPlan()), nullptr, nullptr, options);
    FT_VERIFY_OK(report);
    QCOMPARE(report->replicates->named_right, 6);
    QVERIFY(report->replicates->runner_up.empty());
  }

  /// A weak cause is named less surely than it was once: the same seed gives the same count, another may not.
  void isTheSameWithTheSameSeed() {
    const Withheld made = withheldFrom("compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.075})");
    DiagnosisOptions options;
    options.replicates = 4;
    const auto one = diagnose(made.table, nullptr, nullptr, options);
    const auto two = diagnose(made.table, nullptr, nullptr, options);
    FT_VERIFY_OK(one);
    QVERIFY(toJson(*one) == toJson(*two));
  }

  void canBeStopped() {
    const Withheld made = withheldFrom("compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})");
    std::stop_source source;
    RunControl control;
    control.stop = source.get_token();
    control.progress = [&](double fraction) {
      if (fraction > 0.15) source.request_stop();
    };
    DiagnosisOptions options;
    options.replicates = 50;
    const auto report = diagnose(made.table, nullptr, nullptr, options, control);
    QVERIFY(!report && report.error().code == ErrorCode::kCancelled);
  }
};

FIELDTRUE_TEST(ReplicatesTest)
#include "replicates_test.moc"
