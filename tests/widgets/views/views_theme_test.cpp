#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QRegularExpression>
#include <QSignalSpy>
#include <cmath>
#include <limits>

#include "tests/widgets/views/view_test.h"
#include "widgets/style/color_scale.h"
#include "widgets/style/icons.h"
#include "widgets/style/units.h"
#include "widgets/views/room/sample_ring.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;

namespace {

/// Contrast ratio of two colours. @source WCAG 2.1, relative luminance and contrast ratio
double contrast(const QColor& a, const QColor& b) {
  const auto luminance = [](const QColor& color) {
    const auto linear = [](double s) { return s <= 0.03928 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4); };
    return 0.2126 * linear(color.redF()) + 0.7152 * linear(color.greenF()) + 0.0722 * linear(color.blueF());
  };
  const double la = luminance(a), lb = luminance(b);
  return (std::max(la, lb) + 0.05) / (std::min(la, lb) + 0.05);
}

}  // namespace

class ViewsThemeTest : public QObject {
  Q_OBJECT
 private slots:
  void lengths_data() {
    QTest::addColumn<double>("metres");
    QTest::addColumn<int>("unit");
    QTest::addColumn<int>("significant");
    QTest::addColumn<QString>("text");
    const auto unit = [](LengthUnit u) { return static_cast<int>(u); };
    QTest::newRow("metres") << 0.3048 << unit(LengthUnit::kMetre) << 3 << "0.305 m";
    QTest::newRow("a foot") << 0.3048 << unit(LengthUnit::kFoot) << 3 << "1.00 ft";
    QTest::newRow("twelve inches") << 0.3048 << unit(LengthUnit::kInch) << 3 << "12.0 in";
    QTest::newRow("millimetres") << 0.3048 << unit(LengthUnit::kMillimetre) << 3 << "305 mm";
    QTest::newRow("rounds up a digit") << 0.9996 << unit(LengthUnit::kMetre) << 3 << "1.00 m";
    QTest::newRow("large") << 1234.4 << unit(LengthUnit::kMetre) << 3 << "1230 m";
    QTest::newRow("no thousands mark") << 12.3456 << unit(LengthUnit::kMillimetre) << 5 << "12346 mm";
    QTest::newRow("negative") << -1.2192 << unit(LengthUnit::kFoot) << 3 << "-4.00 ft";
    QTest::newRow("two figures") << 0.0254 << unit(LengthUnit::kMetre) << 2 << "0.025 m";
    QTest::newRow("one figure") << 0.27 << unit(LengthUnit::kMetre) << 1 << "0.3 m";
    QTest::newRow("zero") << 0.0 << unit(LengthUnit::kInch) << 3 << "0 in";
    QTest::newRow("noise around zero") << -1e-17 << unit(LengthUnit::kMetre) << 3 << "0 m";
    QTest::newRow("unknown") << std::numeric_limits<double>::quiet_NaN() << unit(LengthUnit::kMetre) << 3 << "unknown";
  }
  void lengths() {
    QFETCH(double, metres);
    QFETCH(int, unit);
    QFETCH(int, significant);
    QFETCH(QString, text);
    QCOMPARE(formatLength(metres, static_cast<LengthUnit>(unit), significant), text);
  }

  void magnitudeColors_data() {
    QTest::addColumn<double>("fraction");
    QTest::addColumn<QColor>("color");
    QTest::newRow("low end of viridis") << 0.0 << QColor(0x44, 0x01, 0x54);
    QTest::newRow("a third") << 1.0 / 3.0 << QColor(0x31, 0x68, 0x8e);
    QTest::newRow("two thirds") << 2.0 / 3.0 << QColor(0x35, 0xb7, 0x79);
    QTest::newRow("high end") << 1.0 << QColor(0xfd, 0xe7, 0x25);
    QTest::newRow("below clamps") << -3.0 << QColor(0x44, 0x01, 0x54);
    QTest::newRow("above clamps") << 7.0 << QColor(0xfd, 0xe7, 0x25);
  }
  void magnitudeColors() {
    QFETCH(double, fraction);
    QFETCH(QColor, color);
    QCOMPARE(magnitudeColor(fraction).rgb(), color.rgb());
  }

  void magnitudeScaleGetsLighterAllTheWay() {
    double before = -1.0;
    for (int k = 0; k <= 100; ++k) {
      const QColor color = magnitudeColor(k / 100.0);
      const double luminance = 0.2126 * color.red() + 0.7152 * color.green() + 0.0722 * color.blue();
      QVERIFY2(luminance > before, qPrintable(QString::number(k)));
      before = luminance;
    }
  }

  void unknownMagnitudeIsGrey() {
    const QColor color = magnitudeColor(std::numeric_limits<double>::quiet_NaN());
    QCOMPARE(color.red(), color.green());
    QCOMPARE(color.green(), color.blue());
  }

  void wordsCanBeRead_data() {
    QTest::addColumn<bool>("dark");
    QTest::newRow("light") << false;
    QTest::newRow("dark") << true;
  }
  void wordsCanBeRead() {
    QFETCH(bool, dark);
    const Theme& t = Theme::of(dark);
    for (const QColor& ground : {t.background, t.surface})
      for (const QColor& word : {t.text, t.text_muted, t.accent, t.attention, t.danger, t.done})
        QVERIFY2(contrast(word, ground) >= 4.5, qPrintable(word.name() + " on " + ground.name()));
    QVERIFY(contrast(t.on_accent, t.accent) >= 4.5);
    QVERIFY((t.background.lightness() < 128) == dark);
  }

  void iconsFollowTheTheme() {
    const QStringList needed = {"connect", "plan", "acquire", "compare", "export", "home",
                                "undo",    "redo", "skip",    "take",    "retake", "auto",
                                "camera",  "info", "warning", "check",   "folder", "play"};
    for (const QString& name : needed) QVERIFY2(iconNames().contains(name), qPrintable(name));
    for (const QString& name : iconNames()) {
      const QIcon symbol = icon(name);
      for (const bool dark : {false, true}) {
        applyTheme(*qApp, dark);
        const QImage image = symbol.pixmap(48, 48).toImage().convertToFormat(QImage::Format_ARGB32);
        QVERIFY2(test::countColor(image, theme().text) > 20, qPrintable(name));
      }
    }
    applyTheme(*qApp, false);
  }

  void everyColorOfTheStyleSheetIsFilledIn() {
    QSignalSpy changes(&themeNotifier(), &ThemeNotifier::themeChanged);
    applyTheme(*qApp, true);
    QCOMPARE(changes.size(), 1);
    QVERIFY(theme().dark);
    QVERIFY(!qApp->styleSheet().isEmpty());
    static const QRegularExpression comment(QStringLiteral("/\\*.*?\\*/"),
                                            QRegularExpression::DotMatchesEverythingOption);
    const QString rules = qApp->styleSheet().remove(comment);
    QVERIFY2(!rules.contains('@'), qPrintable(rules.mid(rules.indexOf('@'), 30)));
    applyTheme(*qApp, false);
  }

  /// What cannot be changed is told from what can, and ticked from unticked, in both themes.
  void whatIsDisabledIsStillRead_data() {
    QTest::addColumn<bool>("dark");
    QTest::newRow("light") << false;
    QTest::newRow("dark") << true;
  }
  void whatIsDisabledIsStillRead() {
    QFETCH(bool, dark);
    applyTheme(*qApp, dark);
    QCheckBox box;
    box.setEnabled(false);
    const QImage unticked = box.grab().toImage();
    box.setChecked(true);
    const QImage ticked = box.grab().toImage();
    double strongest = 1.0;
    for (int y = 0; y < ticked.height(); ++y)
      for (int x = 0; x < ticked.width(); ++x)
        strongest = std::max(strongest, contrast(ticked.pixelColor(x, y), unticked.pixelColor(x, y)));
    QVERIFY2(strongest > 2.0, qPrintable(QString::number(strongest)));
    QDoubleSpinBox number;
    number.setEnabled(false);
    number.ensurePolished();
    QVERIFY(number.palette().color(QPalette::Disabled, QPalette::Text) != theme().text);
    applyTheme(*qApp, false);
  }

  void theRingsNumberStaysWithinIt_data() {
    QTest::addColumn<int>("collected");
    for (const int collected : {60, 999, 1801, 36000, 99999}) QTest::addRow("%d", collected) << collected;
  }
  void theRingsNumberStaysWithinIt() {
    QFETCH(int, collected);
    SampleRing ring;
    ring.resize(136, 136);
    // Of so many the part that is drawn is none.
    ring.setProgress(0, 2000000000, SampleRing::State::kFailed);
    const QImage before = ring.grab().toImage();
    ring.setProgress(collected, 2000000000, SampleRing::State::kFailed);
    const QImage after = ring.grab().toImage();
    for (int y = 0; y < after.height(); ++y) {
      for (int x = 0; x < after.width(); ++x) {
        const bool in_ring = std::hypot(x - 67.5, y - 67.5) > (0.5 - 0.13) * 136 - 1.0;
        QVERIFY2(!in_ring || after.pixel(x, y) == before.pixel(x, y), qPrintable(QString("%1, %2").arg(x).arg(y)));
      }
    }
  }

  void ringFillsAndFlashesOnce() {
    SampleRing ring;
    ring.resize(120, 120);
    const auto painted = [&ring](const QColor& color) { return test::countColor(ring.grab().toImage(), color); };
    ring.setProgress(15, 60, SampleRing::State::kCollecting);
    const int quarter = painted(theme().accent);
    ring.setProgress(45, 60, SampleRing::State::kCollecting);
    const double growth = static_cast<double>(painted(theme().accent)) / quarter;
    QVERIFY2(growth > 2.7 && growth < 3.3, qPrintable(QString::number(growth)));
    ring.setProgress(60, 60, SampleRing::State::kDone);
    const QRgb flashing = ring.grab().toImage().pixel(60, 90);
    QTRY_VERIFY_WITH_TIMEOUT(ring.grab().toImage().pixel(60, 90) != flashing, 2000);
    QTest::qWait(700);
    const QImage settled = ring.grab().toImage();
    QVERIFY(test::countColor(settled, theme().done) > 4 * quarter / 2);
    QTest::qWait(300);
    QCOMPARE(ring.grab().toImage(), settled);
    QVERIFY(ring.accessibleDescription().contains("60"));
  }
};

VIEW_TEST(ViewsThemeTest)
#include "views_theme_test.moc"
