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

class TransmitterMisalignmentTest : public QObject {
  Q_OBJECT
 private slots:
  void movesEverythingTheOtherWay();
  void isARigidTransformToFirstOrder();
};

// A transmitter shifted by 5 cm along x sees everything 5 cm less far along x; turned by a about z it sees a sensor on
// the x axis at -a to the side.
void TransmitterMisalignmentTest::movesEverythingTheOtherWay() {
  const Pose place{{1.5, 0.4, -0.2}, Eigen::Quaterniond::Identity()};
  const auto shifted = effectOf("transmitter_misalignment", {{"shift_m", {0.05, 0.0, 0.0}}});
  FT_VERIFY_MATCH(near(readingOf(*shifted, settingAt(place)).position_m, Eigen::Vector3d(1.45, 0.4, -0.2), 1e-9));
  const Pose on_axis{{2.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const auto turned = effectOf("transmitter_misalignment", {{"turn_rad", {0.0, 0.0, 0.001}}});
  FT_VERIFY_MATCH(near(readingOf(*turned, settingAt(on_axis)).position_m, Eigen::Vector3d(2.0, -0.002, 0.0), 1e-9));
}

// The inverse of (d, exp(w)) applied to the stated pose; what is left is of second order, 1e-8.
void TransmitterMisalignmentTest::isARigidTransformToFirstOrder() {
  RandomGeometry random(1);
  const Pose stated_from_real{{1e-4, -2e-4, 3e-4}, rotationFromVector({2e-4, 1e-4, -1e-4})};
  const auto effect =
      effectOf("transmitter_misalignment", {{"shift_m", {1e-4, -2e-4, 3e-4}}, {"turn_rad", {2e-4, 1e-4, -1e-4}}});
  for (int i = 0; i < 30; ++i) {
    const Pose stated = random.poseInShell(0.5, 2.0);
    FT_VERIFY_MATCH(near(readingOf(*effect, settingAt(stated)), inverse(stated_from_real) * stated, 3e-7, 3e-8));
  }
}

FIELDTRUE_TEST(TransmitterMisalignmentTest)
#include "transmitter_misalignment_test.moc"
