#include <QTest>
#include <cmath>

#include "calib/effects/rows.h"
#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::couplingsWith;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::readingOf;
using fieldtrue::testing::settingAt;

class CoilNonorthogonalityTest : public QObject {
  Q_OBJECT
 private slots:
  void mixesTheCoilsOfAPair();
  void turnsAReadingAsWorkedByHand_data();
  void turnsAReadingAsWorkedByHand();
};

// S (1 + E) and (1 + E) S with E symmetric; the coils' moments, the columns of 1 + E, then stand at 90 deg - 2 E_xy.
void CoilNonorthogonalityTest::mixesTheCoilsOfAPair() {
  RandomGeometry random(2);
  Eigen::Matrix3d E;
  E << 0.0, 0.01, -0.02, 0.01, 0.0, 0.03, -0.02, 0.03, 0.0;
  const Eigen::Matrix3d mixing = Eigen::Matrix3d::Identity() + E;
  QVERIFY(std::abs(std::acos(mixing.col(0).dot(mixing.col(1))) - (std::acos(0.0) - 0.02)) < 1e-3);
  for (int i = 0; i < 50; ++i) {
    const Pose pose = random.poseInShell(0.3, 3.0);
    const Eigen::Matrix3d S = field::couplings(field::dipoleField(pose.position_m, 1.0), pose.orientation);
    const auto transmitter = effectOf("coil_nonorthogonality", {{"transmitter_rad", {0.01, -0.02, 0.03}}});
    const auto receiver = effectOf("coil_nonorthogonality", {{"receiver_rad", {0.01, -0.02, 0.03}}});
    FT_VERIFY_MATCH(near((couplingsWith(*transmitter, settingAt(pose)) - S * mixing).norm() / S.norm(), 0.0, 1e-12));
    FT_VERIFY_MATCH(near((couplingsWith(*receiver, settingAt(pose)) - mixing * S).norm() / S.norm(), 0.0, 1e-12));
  }
}

// A sensor on the X axis, all coils parallel: S = k diag(2, -1, -1). A direction turned by a about Z changes S by
// k a (3, 3) in the places (xy, yx), a sensor turned by b by k b (-1, -2). The transmitter's e gives k e (2, -1):
// 3a - b = 2e, 3a - 2b = -e, so b = 3e and a = 5e/3. The receiver's gives k e (-1, 2): b = -3e, a = -4e/3.
void CoilNonorthogonalityTest::turnsAReadingAsWorkedByHand_data() {
  QTest::addColumn<QString>("coils");
  QTest::addColumn<double>("direction_share");
  QTest::addColumn<double>("turn_share");
  QTest::newRow("transmitter") << QString("transmitter_rad") << 5.0 / 3.0 << 3.0;
  QTest::newRow("receiver") << QString("receiver_rad") << -4.0 / 3.0 << -3.0;
}

void CoilNonorthogonalityTest::turnsAReadingAsWorkedByHand() {
  QFETCH(QString, coils);
  QFETCH(double, direction_share);
  QFETCH(double, turn_share);
  const double e_rad = 1e-4;
  const Pose truth{{2.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const auto effect = effectOf("coil_nonorthogonality", {{coils.toStdString(), {e_rad, 0.0, 0.0}}});
  const Pose seen = readingOf(*effect, settingAt(truth));
  FT_VERIFY_MATCH(near(seen.position_m, Eigen::Vector3d(2.0, 2.0 * direction_share * e_rad, 0.0), 2e-7));
  FT_VERIFY_MATCH(near(rotationVector_rad(seen.orientation), Eigen::Vector3d(0.0, 0.0, turn_share * e_rad), 2e-7));
}

FIELDTRUE_TEST(CoilNonorthogonalityTest)
#include "coil_nonorthogonality_test.moc"
