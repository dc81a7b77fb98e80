#include "calib/correctors/base/soft_box.h"

#include <QTest>
#include <cmath>

#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

const SoftBox kBox{{0.0, -1.0, 2.0}, {1.0, 1.0, 2.5}, 0.1};

}  // namespace

class SoftBoxTest : public QObject {
  Q_OBJECT
 private slots:
  void standsAroundItsPositions() {
    const SoftBox box = SoftBox::around(std::vector<Eigen::Vector3d>{{1.0, 5.0, 0.0}, {3.0, 4.0, 0.5}}, 0.1);
    FT_VERIFY_MATCH(near(box.low_m, Eigen::Vector3d(1.0, 4.0, 0.0), 0.0));
    FT_VERIFY_MATCH(near(box.high_m, Eigen::Vector3d(3.0, 5.0, 0.5), 0.0));
    FT_VERIFY_MATCH(near(box.reach_m, 0.2, 1e-15));
  }

  void leavesWhatIsInsideToTheBit() {
    RandomGeometry random(1);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d p_m(random.between(0.0, 1.0), random.between(-1.0, 1.0), random.between(2.0, 2.5));
      QVERIFY(kBox.held_m(p_m) == p_m);
      QVERIFY(kBox.slope(p_m) == Eigen::Vector3d::Ones());
    }
  }

  // 0.1 m beyond the face along x, 0.2 m below that of z.
  void goesOnByTheHyperbolicTangent() {
    const Eigen::Vector3d expected_m(1.0 + 0.1 * std::tanh(1.0), 0.5, 2.0 - 0.1 * std::tanh(2.0));
    FT_VERIFY_MATCH(near(kBox.held_m({1.1, 0.5, 1.8}), expected_m, 1e-15));
    const Eigen::Vector3d slope(std::pow(std::cosh(1.0), -2), 1.0, std::pow(std::cosh(2.0), -2));
    FT_VERIFY_MATCH(near(kBox.slope({1.1, 0.5, 1.8}), slope, 1e-14));
  }

  void neverGoesFartherThanItsReach() {
    FT_VERIFY_MATCH(near(kBox.held_m({1e6, -1e6, 1e6}), Eigen::Vector3d(1.1, -1.1, 2.6), 1e-12));
    FT_VERIFY_MATCH(near(kBox.slope({1e6, -1e6, 1e6}), Eigen::Vector3d::Zero().eval(), 1e-12));
  }

  void withoutAReachStopsAtTheFace() {
    const SoftBox box{kBox.low_m, kBox.high_m, 0.0};
    FT_VERIFY_MATCH(near(box.held_m({3.0, 0.0, 1.0}), Eigen::Vector3d(1.0, 0.0, 2.0), 0.0));
    FT_VERIFY_MATCH(near(box.slope({3.0, 0.0, 1.0}), Eigen::Vector3d(0.0, 1.0, 0.0), 0.0));
  }
};

FIELDTRUE_TEST(SoftBoxTest)
#include "soft_box_test.moc"
