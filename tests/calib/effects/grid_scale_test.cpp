#include <QTest>

#include "calib/effects/rows.h"
#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::near;
using fieldtrue::testing::settingAt;
using fieldtrue::testing::wayOf;

namespace {

/// A rig at (1, 0, 0) that is turned by 90 deg about Z: its x axis points along the tracker's y, its y along -x.
Pose turnedRig() { return {{1.0, 0.0, 0.0}, rotationFromVector({0.0, 0.0, 1.5707963267948966})}; }

Pose atInRig(double x_m, double y_m, double z_m) {
  return turnedRig() * Pose{{x_m, y_m, z_m}, Eigen::Quaterniond::Identity()};
}

}  // namespace

class GridScaleTest : public QObject {
  Q_OBJECT
 private slots:
  void stretchesTheRigAlongItsOwnAxes();
  void stretchesEvenlyFromItsOrigin();
};

// 2 % along x and -1 % along z of a place at (0.5, 0.3, -0.4) in the rig: 10 mm and 4 mm, along the tracker's y and z.
void GridScaleTest::stretchesTheRigAlongItsOwnAxes() {
  const auto effect = effectOf("grid_scale", {{"scale", {0.02, 0.0, -0.01}}});
  const field::EffectResponse response = effect->at(settingAt(atInRig(0.5, 0.3, -0.4), turnedRig()));
  FT_VERIFY_MATCH(near(response.shift_m, Eigen::Vector3d(0.0, 0.01, 0.004), 1e-15));
  QCOMPARE(response.turn_rad.norm(), 0.0);
  QCOMPARE(response.field_per_m3.norm(), 0.0);
  QCOMPARE(effect->at(settingAt(turnedRig(), turnedRig())).shift_m.norm(), 0.0);
}

// One scale for all axes moves a place straight away from the rig's origin: 1 % of (-0.3, 0.5, -0.4).
void GridScaleTest::stretchesEvenlyFromItsOrigin() {
  const auto way = wayOf("grid_scale", {}, "isotropic");
  const field::SensorSetting setting = settingAt(atInRig(0.5, 0.3, -0.4), turnedRig());
  field::EffectResponse response;
  way->respond({&setting, 1}, {}, {&response, 1});
  FT_VERIFY_MATCH(near(Eigen::Vector3d(0.01 * response.shift_m), Eigen::Vector3d(-0.003, 0.005, -0.004), 1e-15));
}

FIELDTRUE_TEST(GridScaleTest)
#include "grid_scale_test.moc"
