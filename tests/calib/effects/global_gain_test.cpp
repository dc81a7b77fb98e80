#include <QTest>
#include <cmath>

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

class GlobalGainTest : public QObject {
  Q_OBJECT
 private slots:
  void movesReadingsAlongTheirDirection();
  void isAThirdToFirstOrder();
  void looksLikeALargerRig();
};

// The inverse cube law: p (1 + g)^(-1/3), the orientation stays.
void GlobalGainTest::movesReadingsAlongTheirDirection() {
  RandomGeometry random(1);
  for (const double gain : {-0.2, -0.01, 0.02, 0.5}) {
    const auto effect = effectOf("global_gain", {{"gain", gain}});
    for (int i = 0; i < 20; ++i) {
      const Pose truth = random.poseInShell(0.3, 3.0);
      const Pose expected{truth.position_m / std::cbrt(1.0 + gain), truth.orientation};
      FT_VERIFY_MATCH(near(readingOf(*effect, settingAt(truth)), expected, 1e-10, 1e-8));
    }
  }
}

void GlobalGainTest::isAThirdToFirstOrder() {
  const Pose truth{{1.2, -0.9, 0.3}, Eigen::Quaterniond::Identity()};
  const Pose seen = readingOf(*effectOf("global_gain", {{"gain", 1e-5}}), settingAt(truth));
  FT_VERIFY_MATCH(near(seen.position_m, Eigen::Vector3d(truth.position_m * (1.0 - 1e-5 / 3.0)), 1e-9));
}

// A rig that is larger by s about the transmitter reads as the gain (1 + s)^-3 - 1.
void GlobalGainTest::looksLikeALargerRig() {
  RandomGeometry random(2);
  const auto larger = effectOf("grid_scale", {{"scale", {0.01, 0.01, 0.01}}});
  const auto weaker = effectOf("global_gain", {{"gain", std::pow(1.01, -3.0) - 1.0}});
  for (int i = 0; i < 20; ++i) {
    const field::SensorSetting setting = settingAt(random.poseInShell(0.3, 3.0));
    FT_VERIFY_MATCH(near(readingOf(*larger, setting), readingOf(*weaker, setting), 1e-10, 1e-8));
  }
}

FIELDTRUE_TEST(GlobalGainTest)
#include "global_gain_test.moc"
