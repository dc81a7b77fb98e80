#include <vtkRenderer.h>

#include <QElapsedTimer>
#include <QHBoxLayout>
#include <QOpenGLContext>
#include <QSignalSpy>
#include <QVBoxLayout>
#include <memory>
#include <numbers>

#include "acquisition/plan/place_state.h"
#include "tests/widgets/views/view_test.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/charts/chart_views.h"
#include "widgets/views/draw_picture.h"
#include "widgets/views/field/field_view.h"
#include "widgets/views/host/projection.h"
#include "widgets/views/room/room_view.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::widgets::test;

namespace {

constexpr int kLegend_px = 130;  ///< Width at the right that the legend may use.

template <class View>
void show(View& view, QSize size = {800, 600}) {
  view.resize(size);
  view.show();
  QVERIFY(QTest::qWaitForWindowExposed(&view));
  QTRY_VERIFY(!view.picture().isNull());
}

/// What a view shows, in logical pixels: on dense screens too the same places of the picture can be asked.
QImage shot(VtkHost& view) {
  const QImage image = view.picture();
  return image.scaled(image.size() / view.pixelRatio(), Qt::IgnoreAspectRatio, Qt::FastTransformation);
}

QRect scenePart(const QImage& image) { return {0, 60, image.width() - kLegend_px, image.height() - 60}; }
QRect legendPart(const QImage& image) { return {image.width() - 110, 0, 110, image.height()}; }

QPoint onScreen(const VtkHost& view, const Eigen::Vector3d& at_m) {
  const auto px = Projection(view.renderer()).toPixels(at_m);
  const double ratio = view.pixelRatio();
  return QPoint(static_cast<int>(px->x() / ratio), static_cast<int>(view.height() - px->y() / ratio));
}

}  // namespace

class ViewsDisplayTest : public QObject {
  Q_OBJECT
 private slots:
  void init() {
    if (!hasDisplay()) QSKIP("needs a display: run under xvfb-run");
  }

  void arrowHasTheColorOfItsMagnitude_data() {
    QTest::addColumn<double>("error_mm");
    QTest::addColumn<QColor>("color");
    QTest::newRow("a third of the scale") << 20.0 << QColor(0x31, 0x68, 0x8e);
    QTest::newRow("two thirds") << 40.0 << QColor(0x35, 0xb7, 0x79);
    QTest::newRow("all of it") << 60.0 << QColor(0xfd, 0xe7, 0x25);
    QTest::newRow("beyond it") << 90.0 << QColor(0xfd, 0xe7, 0x25);
  }
  void arrowHasTheColorOfItsMagnitude() {
    QFETCH(double, error_mm);
    QFETCH(QColor, color);
    FieldView view;
    view.setScaleMax_mm(60.0);
    view.setMagnification(2.0);
    view.setField(uniformField({0.0, error_mm / 1000.0, 0.0}));
    show(view);
    const QImage image = shot(view);
    QVERIFY(countColor(image, color, 2, scenePart(image)) > 150);
    view.setScaleMax_mm(1000.0);
    const QImage rescaled = shot(view);
    QVERIFY(countColor(rescaled, color, 2, scenePart(rescaled)) < 20);
  }

  void axesFollowTheUnitOfThePlaces() {
    const LengthUnit before = placingUnit();
    setPlacingUnit(LengthUnit::kMetre);
    FieldView field;
    field.setField(uniformField({0.0, 0.001, 0.0}));
    RoomView room;
    room.setPlaces(gridPlaces());
    room.setTransmitter(Pose{});
    for (VtkHost* view : {static_cast<VtkHost*>(&field), static_cast<VtkHost*>(&room)}) {
      show(*view);
      const QImage metres = shot(*view);
      QCOMPARE(shot(*view), metres);
      setPlacingUnit(LengthUnit::kFoot);
      QVERIFY(shot(*view) != metres);
      setPlacingUnit(LengthUnit::kMetre);
      QCOMPARE(shot(*view), metres);
      view->hide();
    }
    setPlacingUnit(before);
  }

  void legendShowsTheWholeScale() {
    FieldView view;
    view.setField(uniformField({0.0, 0.001, 0.0}));
    view.setScaleMax_mm(60.0);
    show(view);
    const QImage image = shot(view);
    for (const QRgb color : {0x440154U, 0x31688eU, 0x26828eU, 0x35b779U, 0xfde725U})
      QVERIFY2(countColor(image, QColor(color), 8, legendPart(image)) > 10, qPrintable(QColor(color).name()));
  }

  void legendSaysTheMagnification() {
    FieldView view;
    view.setField(uniformField({0.0, 0.001, 0.0}));
    view.setMagnification(10.0);
    show(view);
    const QImage ten = shot(view);
    view.setMagnification(25.0);
    const QImage twenty_five = shot(view);
    QVERIFY(ten.copy(legendPart(ten)) != twenty_five.copy(legendPart(twenty_five)));
  }

  void comparedViewsShareScaleAndCamera() {
    QWidget window;
    auto* layout = new QHBoxLayout(&window);
    auto* before = new FieldView(&window);
    auto* after = new FieldView(&window);
    for (FieldView* view : {before, after}) {
      view->setFixedSize(500, 500);
      layout->addWidget(view);
    }
    before->setField(uniformField({0.0, 0.05, 0.0}, "Before"));
    after->setField(uniformField({0.0, 0.005, 0.0}, "After"));
    for (FieldView* view : {before, after}) view->setScaleMax_mm(60.0);
    before->linkCamera(after);
    window.show();
    QVERIFY(QTest::qWaitForWindowExposed(&window));
    QTRY_VERIFY(!after->picture().isNull());
    QCOMPARE(shot(*before).size(), shot(*after).size());
    const QImage a = shot(*before), b = shot(*after);
    const QRect bar(400, 160, 8, 180);  // of the colour scale; the scene shows through around it
    QVERIFY(countColor(a, QColor(0x35, 0xb7, 0x79), 8, bar) > 10);
    QCOMPARE(a.copy(bar), b.copy(bar));
    before->setScaleMax_mm(30.0);
    const QImage other_scale = shot(*before);
    QVERIFY(other_scale.copy(legendPart(a)) != a.copy(legendPart(a)));
    before->setScaleMax_mm(60.0);

    CameraPose pose = before->cameraPose();
    pose.azimuth_rad += 0.7;
    before->setCameraPose(pose);
    QVERIFY(after->cameraPose() == before->cameraPose());
    QVERIFY(shot(*after) != b);

    const CameraPose dragged_from = before->cameraPose();
    QTest::mousePress(after, Qt::LeftButton, {}, {200, 250});
    QTest::mouseMove(after, {260, 250});
    QTest::mouseMove(after, {300, 260});
    QTest::mouseRelease(after, Qt::LeftButton, {}, {300, 260});
    QVERIFY(before->cameraPose() != dragged_from);

    after->linkCamera(nullptr);
    const CameraPose left_alone = after->cameraPose();
    pose.azimuth_rad += 0.7;
    before->setCameraPose(pose);
    QVERIFY(after->cameraPose() == left_alone);
  }

  void presetEasesInUnderThreeTenthsOfASecond() {
    FieldView view;
    view.setField(uniformField({0.0, 0.02, 0.0}));
    show(view);
    const CameraPose start = view.cameraPose();
    view.setCamera(FieldView::Camera::kTop);
    QVERIFY(std::abs(view.cameraPose().elevation_rad - start.elevation_rad) < 0.2);  // no jump
    QElapsedTimer clock;
    clock.start();
    QTRY_VERIFY(std::abs(view.cameraPose().elevation_rad - 0.5 * std::numbers::pi) < 1e-6);
    QVERIFY2(clock.elapsed() < 2000, "far beyond 0.3 s, even on a busy machine");
  }

  void hoverNamesAPlaceAndClickSelectsIt() {
    FieldView view;
    ErrorField field = uniformField({0.0, 0.0123, 0.0});
    field.arrows[26].angle_deg = 1.5;
    view.setField(field);
    show(view);
    QSignalSpy hovered(&view, &FieldView::nodeHovered), clicked(&view, &FieldView::nodeClicked);
    const QPoint at = onScreen(view, field.arrows[26].from_m);
    QTest::mouseMove(&view, at);
    QTRY_VERIFY(!hovered.isEmpty());
    QCOMPARE(hovered.last().at(0).toInt(), 26);
    for (const char* word : {"P26", "12.3 mm", "1.5"}) QVERIFY2(hovered.last().at(1).toString().contains(word), word);
    QTest::mouseClick(&view, Qt::LeftButton, {}, at);
    QCOMPARE(clicked.size(), 1);
    QCOMPARE(clicked.last().at(0).toInt(), 26);
    QTest::mouseMove(&view, {3, 3});
    QTRY_COMPARE(hovered.last().at(0).toInt(), -1);
    QTest::mouseClick(&view, Qt::LeftButton, {}, {3, 3});
    QCOMPARE(clicked.size(), 1);

    const QImage before = shot(view);
    view.setSelected(26);
    const QImage image = shot(view);
    QVERIFY(countColor(image, theme().accent, 3, scenePart(image)) >
            countColor(before, theme().accent, 3, scenePart(before)) + 30);
  }

  void orientationIsSwitchable() {
    FieldView view;
    ErrorField field = uniformField(Eigen::Vector3d::Zero());
    for (FieldArrow& arrow : field.arrows) arrow.angle_deg = 6.0;
    view.setField(field);
    view.setAngleScaleMax_deg(9.0);
    view.setMagnification(10.0);
    show(view);
    const QColor two_thirds(0x35, 0xb7, 0x79);
    const QImage without = shot(view);
    QVERIFY(countColor(without, two_thirds, 2, scenePart(without)) < 20);
    view.setShowOrientation(true);
    const QImage with = shot(view);
    QVERIFY(countColor(with, two_thirds, 2, scenePart(with)) > 150);
  }

  void keysTurnAndZoom() {
    FieldView view;
    view.setField(uniformField({0.0, 0.02, 0.0}));
    show(view);
    const CameraPose start = view.cameraPose();
    QTest::keyClick(&view, Qt::Key_Right);
    QVERIFY(view.cameraPose().azimuth_rad > start.azimuth_rad);
    QTest::keyClick(&view, Qt::Key_Plus);
    QVERIFY(view.cameraPose().view_height_m < start.view_height_m);
    QTest::keyClick(&view, Qt::Key_Home);
    QTRY_VERIFY(std::abs(view.cameraPose().azimuth_rad - start.azimuth_rad) < 1e-6);
  }

  void viewFollowsSizeThemeAndWindow() {
    auto* view = new FieldView;
    QWidget window;
    auto* layout = new QVBoxLayout(&window);
    layout->setContentsMargins(0, 0, 0, 0);
    view->setField(uniformField({0.0, 0.04, 0.0}));
    show(*view, {640, 480});
    view->resize(500, 300);
    QTRY_COMPARE(view->picture().size(), QSize(500, 300) * view->pixelRatio());
    QVERIFY(countColor(shot(*view), theme().background, 0) > 20000);

    applyTheme(*qApp, true);
    QTRY_VERIFY(countColor(shot(*view), Theme::of(true).background, 0) > 20000);
    applyTheme(*qApp, false);

    layout->addWidget(view);
    window.resize(640, 480);
    window.show();
    QVERIFY(QTest::qWaitForWindowExposed(&window));
    QTRY_VERIFY(!view->picture().isNull());
    view->setScaleMax_mm(60.0);
    const QImage image = shot(*view);
    QVERIFY(countColor(image, QColor(0x35, 0xb7, 0x79), 2, scenePart(image)) > 80);
  }

  void roomTellsStatesByColor() {
    RoomView view;
    const std::vector<PlannedPlace> places = gridPlaces();
    view.setPlaces(places);
    show(view);
    std::vector<acquisition::PlaceState> states(places.size(), acquisition::PlaceState::kPlanned);
    const auto count = [&view](const QColor& color) {
      const QImage image = shot(view);
      return countColor(image, color, 3, QRect(150, 0, image.width() - 150, image.height()));
    };
    QCOMPARE(count(theme().done), 0);
    QCOMPARE(count(theme().accent), 0);
    states[0] = acquisition::PlaceState::kDone;
    states[1] = acquisition::PlaceState::kSuspicious;
    view.setStates(states, 2);
    QVERIFY(count(theme().done) > 50);
    QVERIFY(count(theme().attention) > 50);
    QVERIFY2(count(theme().accent) > 4 * count(theme().done), "the next place is unmistakable");
  }

  void onlyTheNextPlaceMovesByItself() {
    RoomView view;
    const std::vector<PlannedPlace> places = gridPlaces();
    view.setPlaces(places);
    show(view);
    QTest::qWait(100);
    const QImage still = shot(view);
    QTest::qWait(400);
    QCOMPARE(shot(view), still);
    view.setStates(std::vector<acquisition::PlaceState>(places.size(), acquisition::PlaceState::kPlanned), 13);
    const QImage pulse = shot(view);
    QTRY_VERIFY(shot(view) != pulse);
  }

  void jigAndSensorAppearAndGo() {
    RoomView view;
    view.setPlaces(gridPlaces());
    show(view);
    const QImage empty = shot(view);
    view.setJig(gridPlaces()[13].reference_from_sensor);
    const QImage with_jig = shot(view);
    QVERIFY(with_jig != empty);
    Pose live;
    live.position_m = Eigen::Vector3d(0.6, 0.1, 0.5);
    view.setLive(live);
    live.position_m.x() += 0.2;
    view.setLive(live);
    QVERIFY(shot(view) != with_jig);
    view.setLive(std::nullopt);
    view.setJig(std::nullopt);
    QCOMPARE(shot(view), empty);
  }

  void roomPlacesAreClickable() {
    RoomView view;
    const std::vector<PlannedPlace> places = gridPlaces();
    view.setPlaces(places);
    show(view);
    QSignalSpy clicked(&view, &RoomView::placeClicked), hovered(&view, &RoomView::placeHovered);
    const QPoint at = onScreen(view, places[24].reference_from_sensor.position_m);
    QTest::mouseMove(&view, at);
    QTRY_VERIFY(!hovered.isEmpty());
    QCOMPARE(hovered.last().at(0).toInt(), 24);
    QTest::mouseClick(&view, Qt::LeftButton, {}, at);
    QCOMPARE(clicked.last().at(0).toInt(), 24);
  }

  void picturesLeaveTheWindowsContextAlone() {
    FieldView view;
    view.setField(uniformField({0.0, 0.04, 0.0}));
    show(view);
    const QImage before = shot(view);
    view.makeCurrent();
    QString why;
    const QImage picture =
        renderPicture({FieldPicture{uniformField({0.0, 0.04, 0.0}), 60.0, 1.0}, 400, 300, false}, &why);
    QVERIFY2(!picture.isNull(), qPrintable(why));
    QCOMPARE(QOpenGLContext::currentContext(), view.context());
    view.doneCurrent();
    QCOMPARE(shot(view), before);
  }

  void histogramShowsBothSeries() {
    HistogramView view;
    view.setSeries({"Before", "After"}, {{30.0, 31.0, 32.0, 33.0}, {1.0, 1.1, 1.2, 3.0}}, "error (mm)");
    show(view, {600, 360});
    const QImage image = shot(view);
    QVERIFY(countColor(image, theme().accent, 2, QRect(0, 60, 200, 300)) > 300);
    QVERIFY(countColor(image, QColor(0x8b, 0x97, 0xa3), 2, QRect(400, 60, 200, 300)) > 300);
  }
};

VIEW_TEST(ViewsDisplayTest)
#include "views_display_test.moc"
