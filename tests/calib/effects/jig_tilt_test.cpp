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

namespace {

/// Turned by 90 deg about Z: the rig's x axis points along the tracker's y, its y along -x.
Pose raisedRig() { return {{1.0, 0.0, 0.5}, rotationFromVector({0.0, 0.0, 1.5707963267948966})}; }

}  // namespace

class JigTiltTest : public QObject {
  Q_OBJECT
 private slots:
  void shearsByHeight();
  void leansTheSensorWithItsPipe();
};

// At (0.1, 0.2, 0.5) in the rig the shears 10, 20 and 30 mrad give x: 0.01 * 0.5 + 0.03 * 0.2 = 11 mm and y:
// 0.02 * 0.5 = 10 mm; in the tracker's axes (-10, 11, 0) mm.
void JigTiltTest::shearsByHeight() {
  const auto effect = effectOf("jig_tilt", {{"shear_rad", {0.01, 0.02, 0.03}}});
  const Pose place = raisedRig() * Pose{{0.1, 0.2, 0.5}, Eigen::Quaterniond::Identity()};
  const field::EffectResponse response = effect->at(settingAt(place, raisedRig()));
  FT_VERIFY_MATCH(near(response.shift_m, Eigen::Vector3d(-0.010, 0.011, 0.0), 1e-15));
  QCOMPARE(response.turn_rad.norm(), 0.0);
}

// A pipe that leans has its top at height h displaced by (xz, yz) h: the axis of a sensor fixed upright to it points
// along (xz, yz, 1).
void JigTiltTest::leansTheSensorWithItsPipe() {
  const auto effect = effectOf("jig_tilt", {{"shear_rad", {1e-4, -2e-4, 5e-3}}, {"turns_sensor", 1.0}});
  const field::EffectResponse response = effect->at(settingAt(raisedRig(), raisedRig()));
  const Eigen::Quaterniond actual = rotationFromVector(response.turn_rad) * raisedRig().orientation;
  const Eigen::Vector3d axis_in_rig = raisedRig().orientation.conjugate() * (actual * Eigen::Vector3d::UnitZ());
  FT_VERIFY_MATCH(near(axis_in_rig, Eigen::Vector3d(1e-4, -2e-4, 1.0), 1e-7));
  QCOMPARE(response.shift_m.norm(), 0.0);
}

FIELDTRUE_TEST(JigTiltTest)
#include "jig_tilt_test.moc"
