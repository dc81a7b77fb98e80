#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkTriangle.h>
#include <vtkUnsignedCharArray.h>

#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include "tests/support/test_main.h"
#include "tests/widgets/views/view_test.h"
#include "widgets/style/color_scale.h"
#include "widgets/views/charts/curve_scene.h"
#include "widgets/views/charts/histogram_scene.h"
#include "widgets/views/field/field_scene.h"
#include "widgets/views/field/volume_field.h"
#include "widgets/views/host/camera.h"
#include "widgets/views/host/offscreen_gl.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::widgets::test;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A lattice over the cube of half edge 1 m, filled with a function of the place.
VolumeField cube(int n, const std::function<double(const Eigen::Vector3d&)>& value) {
  VolumeField field;
  field.count = {n, n, n};
  field.low_m = Eigen::Vector3d::Constant(-1.0);
  field.step_m = Eigen::Vector3d::Constant(2.0 / (n - 1));
  for (std::size_t i = 0; i < field.size(); ++i) field.values_mm.push_back(value(field.point_m(i)));
  return field;
}

double area_m2(vtkPolyData* surface) {
  double area = 0.0;
  for (vtkIdType k = 0; k < surface->GetNumberOfCells(); ++k)
    area += vtkTriangle::SafeDownCast(surface->GetCell(k))->ComputeArea();
  return area;
}

/// The scene of a volume seen straight from above, without a window.
QImage pictureFromAbove(const VolumeField& volume, const std::optional<SlicePlane>& plane,
                        const std::optional<double>& iso_mm, const ErrorField& field = uniformField({0.0, 0.0, 0.0}),
                        const std::optional<OpacityRange>& range = std::nullopt, QString* why = nullptr) {
  const QSize size(600, 600);
  const auto build = [&](vtkRenderer* renderer) {
    auto scene = std::make_shared<FieldScene>(renderer);
    scene->setField(field);
    scene->setScaleMax_mm(60.0);
    scene->setMagnification(2.0);
    scene->setVolume(volume);
    scene->setSlice(plane);
    scene->setIso(iso_mm);
    scene->setOpacityRange(range);
    scene->setLegendShown(false);
    scene->update();
    apply(presetPose(CameraPreset::kTop, scene->space(), ViewFrame{600, 600, 60, 30, 30, 50}),
          renderer->GetActiveCamera());
    scene->faceCamera();
    renderer->ResetCameraClippingRange();
    return scene;
  };
  const Result<QImage> image = drawOffscreen(size, 72, build);
  if (image) return *image;
  if (why != nullptr) *why = QString::fromStdString(image.error().message);
  return {};
}

/// 10 mm low in x, 50 mm high, over the places of the test grid.
VolumeField ramp() {
  VolumeField field;
  field.count = {9, 9, 9};
  field.low_m = Eigen::Vector3d(0.4, -0.3, 0.0);
  field.step_m = Eigen::Vector3d(0.6, 0.6, 0.6) / 8.0;
  for (std::size_t i = 0; i < field.size(); ++i)
    field.values_mm.push_back(10.0 + 40.0 * (field.point_m(i).x() - 0.4) / 0.6);
  return field;
}

}  // namespace

class ViewsVolumeTest : public QObject {
  Q_OBJECT
 private slots:
  void valuesBetweenPointsAreTrilinear() {
    // x y z is trilinear itself: exact everywhere between the points.
    const VolumeField field = cube(5, [](const Eigen::Vector3d& p) { return p.x() * p.y() * p.z() + p.x(); });
    const Eigen::Vector3d at(0.31, -0.77, 0.12);
    QVERIFY(std::abs(field.valueAt(at) - (at.prod() + at.x())) < 1e-12);
    QVERIFY(std::isnan(field.valueAt({1.2, 0.0, 0.0})));
    QVERIFY(std::abs(field.valueAt({1.0, 1.0, 1.0}) - 2.0) < 1e-12);
    QCOMPARE(*field.largest_mm(), 2.0);
  }

  void surfaceOfOneValueIsASphere_data() {
    QTest::addColumn<double>("radius_m");
    QTest::newRow("0.4") << 0.4;
    QTest::newRow("0.7") << 0.7;
    QTest::newRow("0.9") << 0.9;
  }
  void surfaceOfOneValueIsASphere() {
    QFETCH(double, radius_m);
    const VolumeField field = cube(25, [](const Eigen::Vector3d& p) { return p.norm(); });
    const double expected = 4.0 * std::numbers::pi * radius_m * radius_m;
    const double found = area_m2(isoSurface(field, radius_m));
    QVERIFY2(std::abs(found / expected - 1.0) < 0.02, qPrintable(QStringLiteral("%1 of %2").arg(found).arg(expected)));
    QCOMPARE(isoSurface(field, 5.0)->GetNumberOfCells(), vtkIdType{0});
  }

  void surfaceEndsWhereTheFieldIsNotKnown() {
    const VolumeField half = cube(25, [](const Eigen::Vector3d& p) { return p.x() > 0.01 ? kNan : p.norm(); });
    const auto surface = isoSurface(half, 0.7);
    const double expected = 2.0 * std::numbers::pi * 0.49;  // Half the sphere.
    QVERIFY(std::abs(area_m2(surface) / expected - 1.0) < 0.05);
    for (vtkIdType k = 0; k < surface->GetNumberOfCells(); ++k)
      QVERIFY(surface->GetCell(k)->GetPoints()->GetPoint(0)[0] < 0.01);
  }

  void sliceCarriesTheColorOfItsValues() {
    const VolumeField field = cube(11, [](const Eigen::Vector3d& p) { return 10.0 + p.z(); });
    const auto surface = sliceSurface(field, {2, 0.35}, [](double value) {
      return std::isnan(value) ? QColor(Qt::black) : QColor(qRound(100.0 * (value - 10.0)), 0, 0);
    });
    QCOMPARE(surface->GetNumberOfCells(), vtkIdType{40 * 40});
    auto* colors = vtkUnsignedCharArray::SafeDownCast(surface->GetPointData()->GetScalars());
    for (vtkIdType k = 0; k < colors->GetNumberOfTuples(); ++k) QCOMPARE(int{colors->GetValue(3 * k)}, 35);
    QCOMPARE(sliceSurface(field, {2, 1.5}, [](double) { return QColor(); })->GetNumberOfCells(), vtkIdType{0});
  }

  void slicePictureHasTheColorOfTheValue() {
    QString why;
    const QImage across = pictureFromAbove(ramp(), SlicePlane{2, 0.3}, std::nullopt, uniformField({0, 0, 0}), {}, &why);
    if (across.isNull()) QSKIP(qPrintable("no pictures here: " + why));
    // From 10 to 50 of 60 mm: both a third and two thirds of the scale lie on it, its ends do not.
    QVERIFY(countColor(across, QColor(0x31, 0x68, 0x8e), 3) > 300);
    QVERIFY(countColor(across, QColor(0x35, 0xb7, 0x79), 3) > 300);
    QVERIFY(countColor(across, QColor(0xfd, 0xe7, 0x25), 3) < 20);
    const QImage none = pictureFromAbove(ramp(), std::nullopt, std::nullopt);
    QVERIFY(countColor(none, QColor(0x35, 0xb7, 0x79), 3) < 20);
  }

  void surfacePictureStandsWhereTheValueIs() {
    QString why;
    const QImage none = pictureFromAbove(ramp(), std::nullopt, std::nullopt, uniformField({0, 0, 0}), {}, &why);
    if (none.isNull()) QSKIP(qPrintable("no pictures here: " + why));
    QVERIFY(pictureFromAbove(ramp(), std::nullopt, 30.0) != none);
    QCOMPARE(pictureFromAbove(ramp(), std::nullopt, 55.0), none);  // No place has so large a value.
  }

  void uncertainArrowsAreFaint() {
    QString why;
    ErrorField field = uniformField({0.0, 0.04, 0.0});
    const QColor two_thirds(0x35, 0xb7, 0x79);
    for (FieldArrow& arrow : field.arrows) arrow.uncertainty_mm = 1.0;
    const OpacityRange range{1.0, 3.0};
    const QImage certain = pictureFromAbove({}, std::nullopt, std::nullopt, field, range, &why);
    if (certain.isNull()) QSKIP(qPrintable("no pictures here: " + why));
    for (FieldArrow& arrow : field.arrows) arrow.uncertainty_mm = 3.0;
    const QImage uncertain = pictureFromAbove({}, std::nullopt, std::nullopt, field, range);
    const QImage ignored = pictureFromAbove({}, std::nullopt, std::nullopt, field);
    QVERIFY(countColor(certain, two_thirds, 3) > 150);
    QVERIFY(countColor(uncertain, two_thirds, 3) < 10);
    QCOMPARE(ignored, certain);
    QVERIFY(uncertain != pictureFromAbove({}, std::nullopt, std::nullopt, uniformField({0, 0, 0})));
  }

  void holesAndFoldedCellsAreDrawn() {
    const QSize size(600, 600);
    const auto picture = [&](const std::vector<SceneCell>& holes, const std::vector<SceneCell>& folds) {
      const auto build = [&](vtkRenderer* renderer) {
        auto scene = std::make_shared<FieldScene>(renderer);
        scene->setField(uniformField({0.0, 0.0, 0.0}));
        scene->setHoles(holes);
        scene->setFolds(folds);
        scene->update();
        apply(presetPose(CameraPreset::kTop, scene->space(), ViewFrame{600, 600, 60, 120, 30, 50}),
              renderer->GetActiveCamera());
        scene->faceCamera();
        renderer->ResetCameraClippingRange();
        return scene;
      };
      return drawOffscreen(size, 72, build).value_or(QImage());
    };
    const QImage none = picture({}, {});
    if (none.isNull()) QSKIP("no pictures here");
    const QColor amber = Theme::of(false).attention;
    QCOMPARE(countColor(none, amber, 3), 0);
    const SceneCell cell{Eigen::Vector3d(0.7, 0.0, 0.3), 0.3};
    QVERIFY2(countColor(picture({}, {cell}), amber, 3) > 100, "edges and the name of a folded cell");
    const QImage hole = picture({{cell.center_m, 0.15}}, {});
    QVERIFY(hole != none);
    QCOMPARE(countColor(hole, amber, 3), 0);  // Translucent: the scene shines through everywhere.
  }

  void differencesDiverge() {
    QVERIFY(differenceColor(-1.0).blue() > differenceColor(-1.0).red());
    QVERIFY(differenceColor(1.0).red() > differenceColor(1.0).blue());
    QCOMPARE(differenceColor(0.0).red(), differenceColor(0.0).blue());
    QCOMPARE(differenceColor(-3.0), differenceColor(-1.0));
  }

  void methodsHaveColorsOfTheirOwn() {
    for (const bool dark : {false, true}) {
      std::set<QRgb> colors;
      for (std::size_t series = 0; series < 32; ++series) colors.insert(seriesColor(series, Theme::of(dark)).rgb());
      QCOMPARE(colors.size(), std::size_t{32});
      QCOMPARE(seriesColor(1, Theme::of(dark)), Theme::of(dark).accent);
    }
  }

  void logTicksAreRound() {
    QCOMPARE(logTicks(0.8, 30.0), (std::vector<double>{1.0, 2.0, 5.0, 10.0, 20.0}));
    QCOMPARE(logTicks(3.1, 4.0).size(), std::size_t{2});
  }

  void labelsKeepClearOfEachOther() {
    const std::vector<double> heights = spreadLabels({50.0, 52.0, 10.0, 99.0}, 16.0, 0.0, 100.0);
    QVERIFY(std::abs(heights[1] - heights[0]) >= 16.0 - 1e-9);
    QCOMPARE(heights[2], 10.0);
    QCOMPARE(heights[3], 99.0);
    QVERIFY(spreadLabels({98.0, 99.0}, 16.0, 0.0, 100.0)[0] <= 84.0 + 1e-9);
  }
};

FIELDTRUE_TEST(ViewsVolumeTest)
#include "views_volume_test.moc"
