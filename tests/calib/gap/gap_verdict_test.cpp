#include <QTest>
#include <array>
#include <cmath>
#include <vector>

#include "calib/gap/probabilities.h"
#include "calib/gap/verdict.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

using Left = std::optional<double>;

HowFar leaving(double value, Left low90) {
  HowFar far;
  far.left_of_start = {{1.0, 1.0, 1.0}, {value, low90, low90 ? Left(2.0 * value - *low90) : Left()}};
  return far;
}

}  // namespace

class GapVerdictTest : public QObject {
  Q_OBJECT
 private slots:
  /// By what is surely left: more than 0.15 is partly, more than 0.5 is not explained. Where no interval can be told
  /// the figure itself decides: not knowing must not pass for having explained.
  void followsWhatIsSurelyLeft_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<Left>("low90");
    QTest::addColumn<int>("verdict");
    const auto row = [](const char* name, double value, Left low90, GapVerdict verdict) {
      QTest::newRow(name) << value << low90 << static_cast<int>(verdict);
    };
    row("little left", 0.05, 0.02, GapVerdict::kExplained);
    row("wide", 0.4, 0.1, GapVerdict::kExplained);
    row("more left", 0.3, 0.2, GapVerdict::kPartlyExplained);
    row("most left", 0.7, 0.6, GapVerdict::kUnexplained);
    row("less than nothing", -0.3, -0.8, GapVerdict::kExplained);
    row("unsure, little left", 0.05, {}, GapVerdict::kExplained);
    row("unsure, more left", 0.3, {}, GapVerdict::kPartlyExplained);
    row("unsure, most left", 0.97, {}, GapVerdict::kUnexplained);
  }
  void followsWhatIsSurelyLeft() {
    QFETCH(double, value);
    QFETCH(Left, low90);
    QFETCH(int, verdict);
    QCOMPARE(static_cast<int>(verdictOf(leaving(value, low90), true, true, {})), verdict);
    QVERIFY(verdictOf(leaving(value, low90), false, true, {}) == GapVerdict::kUnexplained);
    QVERIFY(verdictOf(leaving(value, low90), false, false, {}) == GapVerdict::kNoGap);
  }

  /// A wide interval leaves the verdict, and is told: half of what was there, or more than the verdict allows, may be
  /// left.
  void saysWhereMuchMayBeLeft() {
    GapReport report;
    report.verdict = GapVerdict::kExplained;
    SelectedEffect plate;
    plate.effect = "finite_plate";
    plate.equivalents = {"finite_plate"};
    report.selected.push_back(plate);
    report.remaining.excess2_before_mm2 = 400.0;
    report.remaining.fraction = 0.25;
    const QString unsure = "as far as these places can tell; on places the fit did not see";
    report.remaining.low90 = 0.0;
    for (const Left high90 : {Left(0.64), Left()}) {
      report.remaining.high90 = high90;
      QVERIFY(!isSurelyExplained(report));
      const QString text = QString::fromStdString(verdictText(report, "gap"));
      QVERIFY2(text.contains(unsure) && text.endsWith("so more than half may have another cause."), qPrintable(text));
    }
    report.remaining.high90 = 0.36;
    QVERIFY(!isSurelyExplained(report));
    const QString reserved = QString::fromStdString(verdictText(report, "gap"));
    QVERIFY2(reserved.contains(unsure) && reserved.endsWith("goes from 20 mm to 10 mm (12 mm at most, 95 % sure), so a "
                                                            "smaller part may have another cause."),
             qPrintable(reserved));
    report.remaining.fraction = 0.0625;
    report.remaining.high90 = 0.1225;
    QVERIFY(isSurelyExplained(report));
    const QString text = QString::fromStdString(verdictText(report, "gap"));
    QVERIFY2(text.endsWith("plate; on places the fit did not see, what stands above the noise goes from 20 mm to 5 mm "
                           "(7 mm at most, 95 % sure)."),
             qPrintable(text));
    report.remaining.low90 = -0.3;  // Too wide.
    QVERIFY(!isSurelyExplained(report));
    report.remaining.low90 = 0.0;
    report.selected.clear();
    QVERIFY(!isSurelyExplained(report));
  }

  void aCauseThatIsThereSeveralTimesIsNamedOnce() {
    GapReport report;
    report.verdict = GapVerdict::kPartlyExplained;
    report.remaining.excess2_before_mm2 = 400.0;
    report.remaining.fraction = 0.25;
    for (const char* effect : {"compact_metal", "finite_plate", "compact_metal", "compact_metal"}) {
      SelectedEffect one;
      one.effect = effect;
      one.equivalents = {effect};
      report.selected.push_back(one);
    }
    const QString text = QString::fromStdString(verdictText(report, "gap"));
    QVERIFY2(text.contains("Compact metal body (3 of them), and Metal plate") && text.count("Compact metal") == 1,
             qPrintable(text));
  }

  /// The figures in brackets show the gap: by size, by rotation, or neither, where only its structure does.
  void figuresShowTheGap_data() {
    QTest::addColumn<double>("position_mm");
    QTest::addColumn<double>("turned_deg");
    QTest::addColumn<QString>("shows");
    QTest::newRow("size") << 8.0 << 0.3 << "There is a gap (8 mm where noise alone would be 5 mm) that";
    QTest::newRow("size and rotation")
        << 8.0 << 0.9 << "(8 mm where noise alone would be 5 mm, and 0.9 degrees where it would be 0.3)";
    QTest::newRow("rotation") << 5.2 << 0.4 << "(of rotation, 0.4 degrees where noise alone would be 0.3 degrees)";
    QTest::newRow("structure") << 4.9 << 0.31 << "(4.9 mm, as large as noise alone, but not scattered as noise is)";
  }
  void figuresShowTheGap() {
    QFETCH(double, position_mm);
    QFETCH(double, turned_deg);
    QFETCH(QString, shows);
    GapReport report;
    report.verdict = GapVerdict::kUnexplained;
    report.position_rms_mm = position_mm;
    report.floor_position_mm = 5.0;
    report.orientation_rms_deg = turned_deg;
    report.floor_orientation_deg = 0.3;
    const QString text = QString::fromStdString(verdictText(report));
    QVERIFY2(text.contains(shows), qPrintable(text));
    report.verdict = GapVerdict::kNoGap;
    QVERIFY(QString::fromStdString(verdictText(report)).contains("mm where noise alone would be 5 mm)."));
  }

  /// No cause that is not named is likelier than the one that is: neither by more evidence of its own, nor because less
  /// is left to the unknown of an error of the instrument than of a thing in the room.
  void whatIsNamedComesFirst() {
    std::vector<GapCandidate> candidates(5);
    const std::array<const char*, 5> effects{"compact_metal", "closed_loop", "coil_gain", "none", kUnnamedSmooth};
    const std::array<double, 5> gains{69.0, 75.0, 72.0, 0.0, 37.0};
    for (std::size_t i = 0; i < 5; ++i) {
      candidates[i].effect = effects[i];
      candidates[i].bic_gain = gains[i];
      candidates[i].shrinkage.fraction = 0.5;
      if (i < 2) candidates[i].location_m = Eigen::Vector3d::Ones();
    }
    setProbabilities(true, {69.0, 57.0}, {}, candidates);
    QCOMPARE(candidates.front().effect, std::string("compact_metal"));
    double sum = 0.0;
    for (const GapCandidate& c : candidates) sum += c.probability;
    QVERIFY(std::abs(sum - 1.0) < 1e-12);
  }

  void whatCannotBeToldIsSaidOnce() {
    GapReport report;
    report.verdict = GapVerdict::kPartlyExplained;
    SelectedEffect loop;
    loop.effect = "closed_loop";
    loop.equivalents = {"closed_loop", "finite_plate", "compact_metal"};
    report.selected.push_back(loop);
    const QString text = QString::fromStdString(verdictText(report));
    QVERIFY2(text.contains(" or ") && text.count("(these readings cannot tell)") == 1, qPrintable(text));
  }

  void tellsHowFarReadingsLieOff() {
    GapReport report;
    report.floor_position_mm = 1.44;
    report.remaining.p50_mm = 2.13;
    report.remaining.p90_mm = 3.98;
    report.remaining.p95_mm = 4.57;
    report.remaining.worst_mm = 12.4;
    report.remaining.worst_node = 17;
    QCOMPARE(
        howFarOffText(report),
        std::string("Half of the readings that no fit saw lie off by less than 2.1 mm, 90 % of them by less than 4 "
                    "mm, 95 % by less than 4.6 mm, and the worst, P17, by 12 mm; noise alone would be 1.4 mm RMS."));
  }
};

FIELDTRUE_TEST(GapVerdictTest)
#include "gap_verdict_test.moc"
