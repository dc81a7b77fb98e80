#include <QTest>

#include "calib/effects/rows.h"
#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::readingOf;
using fieldtrue::testing::settingAt;

class SensorOffsetTest : public QObject {
  Q_OBJECT
 private slots:
  void turnsItsLeverArmWithTheSensor();
  void isARigidMount();
};

// A sensor turned by 90 deg about Z: its x axis points along the tracker's y.
void SensorOffsetTest::turnsItsLeverArmWithTheSensor() {
  const Pose turned{{1.0, 0.2, 0.3}, rotationFromVector({0.0, 0.0, 1.5707963267948966})};
  const auto effect = effectOf("sensor_offset", {{"offset_m", {0.01, 0.0, 0.002}}});
  FT_VERIFY_MATCH(near(readingOf(*effect, settingAt(turned)).position_m, Eigen::Vector3d(1.0, 0.21, 0.302), 1e-9));
}

// stated * mount with the mount (o, exp(w)), for angles of any size.
void SensorOffsetTest::isARigidMount() {
  RandomGeometry random(1);
  const Pose mount{{0.03, -0.01, 0.02}, rotationFromVector({0.4, -0.3, 0.2})};
  const auto effect = effectOf("sensor_offset", {{"offset_m", {0.03, -0.01, 0.02}}, {"turn_rad", {0.4, -0.3, 0.2}}});
  for (int i = 0; i < 30; ++i) {
    const Pose stated = random.poseInShell(0.5, 2.0);
    FT_VERIFY_MATCH(near(readingOf(*effect, settingAt(stated)), stated * mount, 1e-9, 1e-8));
  }
}

FIELDTRUE_TEST(SensorOffsetTest)
#include "sensor_offset_test.moc"
