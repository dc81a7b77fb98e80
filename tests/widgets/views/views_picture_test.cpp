#include "acquisition/plan/place_state.h"
#include "tests/support/test_main.h"
#include "tests/widgets/views/view_test.h"
#include "widgets/views/draw_picture.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::widgets::test;

namespace {

const QSize kSize(800, 500);

QImage fieldPicture(const ErrorField& field, double scale_max_mm = 60.0, bool dark = false, QString* why = nullptr) {
  return renderPicture({FieldPicture{field, scale_max_mm, 3.0}, kSize.width(), kSize.height(), dark}, why);
}

}  // namespace

/// Runs without an application object and without a display, as the command line's report does.
class ViewsPictureTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QString why;
    if (fieldPicture(uniformField({0.02, 0.0, 0.0}), 60.0, false, &why).isNull())
      QSKIP(qPrintable("no pictures here: " + why));
  }

  void fieldPictureShowsArrowsAndScale() {
    const QImage image = fieldPicture(uniformField({0.0, 0.04, 0.0}));
    QCOMPARE(image.size(), kSize);
    const QColor two_thirds(0x35, 0xb7, 0x79);  // viridis at 40 of 60 mm
    QVERIFY2(countColor(image, two_thirds, 3, QRect(0, 0, 660, 500)) > 200, "arrows");
    for (const QRgb color : {0x440154U, 0x31688eU, 0x35b779U, 0xfde725U})
      QVERIFY2(countColor(image, QColor(color), 8, QRect(660, 0, 140, 500)) > 10, qPrintable(QColor(color).name()));
    QVERIFY(countColor(image, Theme::of(false).background, 0) > 50000);
  }

  void beforeAndAfterDiffer() {
    const QImage before = fieldPicture(uniformField({0.0, 0.04, 0.0}));
    const QImage after = fieldPicture(uniformField({0.0, 0.004, 0.0}));
    QVERIFY(before != after);
    QCOMPARE(before.copy(QRect(700, 0, 100, 500)), after.copy(QRect(700, 0, 100, 500)));  // one scale
  }

  void samePictureTwice() {
    const ErrorField field = uniformField({0.01, 0.02, 0.0});
    QCOMPARE(fieldPicture(field), fieldPicture(field));
  }

  void darkPictureHasADarkGround() {
    const QImage image = fieldPicture(uniformField({0.0, 0.04, 0.0}), 60.0, true);
    QVERIFY(countColor(image, Theme::of(true).background, 0) > 50000);
  }

  void emptyAndNotFiniteFieldsDraw() {
    QCOMPARE(fieldPicture(ErrorField{}).size(), kSize);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    QCOMPARE(fieldPicture(uniformField({nan, 0.0, 0.0})).size(), kSize);
  }

  void roomPictureTellsStates() {
    const std::vector<PlannedPlace> places = gridPlaces();
    std::vector<acquisition::PlaceState> states(places.size(), acquisition::PlaceState::kPlanned);
    const auto count = [&](const QColor& color) {
      return countColor(renderPicture({RoomPicture{places, states, Pose{}}, kSize.width(), kSize.height(), false}),
                        color, 3, QRect(150, 0, 650, 500));
    };
    const Theme& t = Theme::of(false);
    QCOMPARE(count(t.done), 0);
    QCOMPARE(count(t.attention), 0);
    states[4] = acquisition::PlaceState::kDone;
    states[9] = acquisition::PlaceState::kSuspicious;
    QVERIFY(count(t.done) > 50);
    QVERIFY(count(t.attention) > 50);
  }

  void histogramPictureShowsBothSeries() {
    std::vector<double> before, after;
    for (int k = 0; k < 50; ++k) {
      before.push_back(20.0 + 0.4 * k);
      after.push_back(0.1 * k);
    }
    const QImage image = renderPicture(
        {HistogramPicture{{"Before", "After"}, {before, after}, "error (mm)"}, kSize.width(), kSize.height(), false});
    QCOMPARE(image.size(), kSize);
    QVERIFY(countColor(image, Theme::of(false).accent, 2, QRect(0, 100, 300, 400)) > 500);
    QVERIFY(countColor(image, QColor(0x8b, 0x97, 0xa3), 2, QRect(400, 100, 400, 400)) > 500);
  }

  void tooLargeIsRefusedInWords() {
    QString why;
    QVERIFY(renderPicture({FieldPicture{uniformField({0.01, 0.0, 0.0}), 60.0, 1.0}, 20000, 100, false}, &why).isNull());
    QVERIFY2(why.contains("20000"), qPrintable(why));
  }
};

FIELDTRUE_TEST(ViewsPictureTest)
#include "views_picture_test.moc"
