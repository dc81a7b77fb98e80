#include <vtkCamera.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include <QTest>

#include "calib/core/number_text.h"
#include "calib/core/units.h"
#include "tests/support/test_main.h"
#include "widgets/figures/scene_space.h"
#include "widgets/views/charts/histogram_scene.h"
#include "widgets/views/host/camera.h"
#include "widgets/views/host/overlay.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;

namespace {

std::vector<Eigen::Vector3d> grid(int nx, int ny, int nz, const Eigen::Vector3d& pitch) {
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) points.push_back(Eigen::Vector3d(i, j, k).cwiseProduct(pitch));
  return points;
}

/// Pinhole projection written out by hand: half pictures from the middle of the picture.
Eigen::Vector2d project(vtkCamera* camera, double aspect, const Eigen::Vector3d& point) {
  const Eigen::Vector3d eye(camera->GetPosition()), focus(camera->GetFocalPoint()), up(camera->GetViewUp());
  const Eigen::Vector3d forward = (focus - eye).normalized(), right = forward.cross(up).normalized();
  const double slope = std::tan(camera->GetViewAngle() * kPi / 360.0);
  const Eigen::Vector3d from_eye = point - eye;
  const double depth = from_eye.dot(forward);
  return Eigen::Vector2d(from_eye.dot(right) / (depth * slope * aspect),
                         from_eye.dot(right.cross(forward)) / (depth * slope)) -
         Eigen::Vector2d(camera->GetWindowCenter());
}

}  // namespace

class ViewsSceneTest : public QObject {
  Q_OBJECT
 private slots:
  void pitchIsTheDistanceOfNeighbours() {
    const Eigen::Vector3d pitch(0.3048, 0.25, 0.4);
    QVERIFY((gridPitch_m(grid(5, 4, 3, pitch)) - pitch).norm() < 1e-12);
  }

  void flatGridBorrowsThePitchItLacks() {
    const Eigen::Vector3d pitch = gridPitch_m(grid(5, 4, 1, {0.1, 0.1, 0.0}));
    QVERIFY(std::abs(pitch.z() - 0.1) < 1e-12);
  }

  void scatteredPlacesGetARoundPitch() {
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 100; ++k)
      points.emplace_back(std::fmod(0.6180339 * k, 1.0), std::fmod(0.7548777 * k, 1.0), std::fmod(0.5698403 * k, 1.0));
    const Eigen::Vector3d pitch = gridPitch_m(points);
    QCOMPARE(pitch.x(), 0.2);  // an eighth of just under 1 m, rounded up to 1, 2 or 5 times a power of ten
    QCOMPARE(pitch.y(), 0.2);
  }

  void roundSteps_data() {
    QTest::addColumn<double>("least");
    QTest::addColumn<double>("step");
    QTest::newRow("one") << 1.0 << 1.0;
    QTest::newRow("up to two") << 1.1 << 2.0;
    QTest::newRow("up to five") << 0.021 << 0.05;
    QTest::newRow("up to ten") << 6.0 << 10.0;
    QTest::newRow("a thousand") << 700.0 << 1000.0;
  }
  void roundSteps() {
    QFETCH(double, least);
    QFETCH(double, step);
    QVERIFY(std::abs(roundStep(least) - step) < 1e-12 * step);
  }

  void spaceHoldsPlacesTransmitterAndFloor() {
    const auto points = grid(3, 3, 3, {0.3, 0.3, 0.3});
    Pose reference_from_tracker;
    reference_from_tracker.position_m = Eigen::Vector3d(-0.5, 0.3, 0.3);
    const SceneSpace space = spaceAround(points, reference_from_tracker);
    for (const Eigen::Vector3d& point : points) {
      QVERIFY((point.array() >= space.low_m.array()).all());
      QVERIFY((point.array() <= space.high_m.array()).all());
    }
    QVERIFY(space.low_m.x() < -0.5);
    QVERIFY(std::abs(space.low_m.z() + 0.3) < 1e-12);  // one pitch below the lowest place
    QVERIFY(std::abs(spaceAround(points, reference_from_tracker, -1.25).low_m.z() + 1.25) < 1e-12);
    QVERIFY((spaceAround({}, reference_from_tracker).center_m() - reference_from_tracker.position_m).norm() < 1.0);
  }

  void presetsFillTheFreePartOfTheView_data() {
    QTest::addColumn<int>("preset");
    QTest::addColumn<double>("width");
    QTest::newRow("operator") << 0 << 900.0;
    QTest::newRow("operator, narrow") << 0 << 500.0;
    QTest::newRow("front") << 1 << 900.0;
    QTest::newRow("side") << 2 << 900.0;
    QTest::newRow("top") << 3 << 900.0;
  }
  void presetsFillTheFreePartOfTheView() {
    QFETCH(int, preset);
    QFETCH(double, width);
    const ViewFrame frame{width, 600.0, 60.0, 110.0, 40.0, 50.0};
    const SceneSpace space = spaceAround(grid(5, 5, 4, {0.3, 0.3, 0.3}), Pose{});
    vtkNew<vtkCamera> camera;
    apply(presetPose(static_cast<CameraPreset>(preset), space, frame), camera);
    Eigen::AlignedBox2d px;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d at((corner & 1 ? space.high_m : space.low_m).x(),
                               (corner & 2 ? space.high_m : space.low_m).y(),
                               (corner & 4 ? space.high_m : space.low_m).z());
      const Eigen::Vector2d half = project(camera, width / 600.0, at);
      px.extend(Eigen::Vector2d(0.5 * (1.0 + half.x()) * width, 0.5 * (1.0 + half.y()) * 600.0));
    }
    constexpr double kSlack_px = 2.0;
    QVERIFY2(px.min().x() > 60.0 - kSlack_px, qPrintable(QString::number(px.min().x())));
    QVERIFY2(px.max().x() < width - 110.0 + kSlack_px, qPrintable(QString::number(px.max().x())));
    QVERIFY2(px.min().y() > 50.0 - kSlack_px, qPrintable(QString::number(px.min().y())));
    QVERIFY2(px.max().y() < 560.0 + kSlack_px, qPrintable(QString::number(px.max().y())));
    const double free_width = width - 170.0, free_height = 510.0;
    QVERIFY(px.sizes().x() > free_width - 6.0 || px.sizes().y() > free_height - 6.0);
  }

  void presetsStandUpright() {
    Pose reference_from_tracker;
    reference_from_tracker.position_m = Eigen::Vector3d(-1.0, 0.6, 0.3);  // the places stand along +x before it
    const SceneSpace space = spaceAround(grid(5, 5, 4, {0.3, 0.3, 0.3}), reference_from_tracker);
    const auto rightOf = [&](CameraPreset preset, Eigen::Vector3d* up) {
      vtkNew<vtkCamera> camera;
      apply(presetPose(preset, space, ViewFrame{}), camera);
      *up = Eigen::Vector3d(camera->GetViewUp());
      const Eigen::Vector3d forward =
          (Eigen::Vector3d(camera->GetFocalPoint()) - Eigen::Vector3d(camera->GetPosition())).normalized();
      return Eigen::Vector3d(forward.cross(*up));
    };
    Eigen::Vector3d up;
    QVERIFY((rightOf(CameraPreset::kTop, &up) - Eigen::Vector3d::UnitX()).norm() < 1e-9);
    QVERIFY((up - Eigen::Vector3d::UnitY()).norm() < 1e-9);
    QVERIFY((rightOf(CameraPreset::kSide, &up) - Eigen::Vector3d::UnitX()).norm() < 1e-9);
    QVERIFY((up - Eigen::Vector3d::UnitZ()).norm() < 1e-9);
    QVERIFY((rightOf(CameraPreset::kFront, &up) - Eigen::Vector3d::UnitY()).norm() < 1e-9);
  }

  void poseOfReadsBackWhatApplySet_data() {
    QTest::addColumn<double>("azimuth");
    QTest::addColumn<double>("elevation");
    QTest::newRow("level") << 0.3 << 0.0;
    QTest::newRow("raised") << -2.5 << 0.9;
    QTest::newRow("straight above") << -0.5 * kPi << 0.5 * kPi;
    QTest::newRow("straight below") << 1.2 << -0.5 * kPi;
  }
  void poseOfReadsBackWhatApplySet() {
    QFETCH(double, azimuth);
    QFETCH(double, elevation);
    CameraPose pose;
    pose.focus_m = Eigen::Vector3d(0.2, -0.4, 1.1);
    pose.azimuth_rad = azimuth;
    pose.elevation_rad = elevation;
    pose.view_height_m = 2.5;
    pose.view_angle_rad = 0.4;
    vtkNew<vtkCamera> camera;
    apply(pose, camera);
    const CameraPose back = poseOf(camera);
    QVERIFY((back.focus_m - pose.focus_m).norm() < 1e-9);
    QVERIFY(std::abs(back.azimuth_rad - azimuth) < 1e-6);
    QVERIFY(std::abs(back.elevation_rad - elevation) < 1e-6);
    QVERIFY(std::abs(back.view_height_m - 2.5) < 1e-9);
    QVERIFY(std::abs(back.view_angle_rad - 0.4) < 1e-9);
  }

  void interpolationTurnsTheShortWay() {
    CameraPose a, b;
    a.azimuth_rad = 3.0;
    b.azimuth_rad = -3.0;
    const double middle = interpolate(a, b, 0.5).azimuth_rad;
    QVERIFY(std::abs(std::remainder(middle - kPi, 2.0 * kPi)) < 1e-9);
    b.view_height_m = 4.0;
    QVERIFY(std::abs(interpolate(a, b, 0.5).view_height_m - 2.0) < 1e-12);  // zoom is even in factors
  }

  void scaleEndsAtItsMaximum() {
    const std::vector<double> ticks = scaleTicks(41.0);
    QCOMPARE(ticks, (std::vector<double>{0.0, 10.0, 20.0, 30.0, 41.0}));  // 40 would touch 41
  }

  void numbersAreShort_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<QString>("text");
    QTest::newRow("zero") << 0.0 << "0";
    QTest::newRow("three figures") << 12.345 << "12.3";
    QTest::newRow("no trailing zeros") << 0.5 << "0.5";
    QTest::newRow("ten") << 10.0 << "10";
    QTest::newRow("large") << 1500.0 << "1500";
    QTest::newRow("negative") << -0.6096 << "-0.61";
  }
  void numbersAreShort() {
    QFETCH(double, value);
    QFETCH(QString, text);
    QCOMPARE(QString::fromStdString(shortNumber(value)), text);
  }

  void histogramCountsInCommonBins() {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Histogram histogram = histogramOf({{0.0, 0.4, 1.0, 29.9, nan}, {1.2, 1.9}});
    QCOMPARE(histogram.width_mm, 1.0);  // 29.9 in at most 30 bins of a round width
    QCOMPARE(histogram.counts.size(), std::size_t{2});
    QCOMPARE(histogram.counts[0].size(), std::size_t{30});
    QCOMPARE(histogram.counts[1].size(), std::size_t{30});
    QCOMPARE(histogram.counts[0][0], 2);
    QCOMPARE(histogram.counts[0][1], 1);
    QCOMPARE(histogram.counts[0][29], 1);
    QCOMPARE(histogram.counts[1][1], 2);
    QVERIFY(histogramOf({}).counts.empty());
    QCOMPARE(histogramOf({{}}).counts[0], std::vector<int>{0});
  }
};

FIELDTRUE_TEST(ViewsSceneTest)
#include "views_scene_test.moc"
