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
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::readingOf;
using fieldtrue::testing::settingAt;
using fieldtrue::testing::wayOf;

class CoilGainTest : public QObject {
  Q_OBJECT
 private slots:
  void scalesColumnsAndRows();
  void movesAReadingAsWorkedByHand_data();
  void movesAReadingAsWorkedByHand();
  void doubtsAGainNoTrackerHas();
};

// The couplings are S (1 + diag(g_tx)) and (1 + diag(g_rx)) S.
void CoilGainTest::scalesColumnsAndRows() {
  RandomGeometry random(1);
  const Eigen::Vector3d g(0.02, -0.01, 0.03);
  for (int i = 0; i < 50; ++i) {
    const Pose pose = random.poseInShell(0.3, 3.0);
    const Eigen::Matrix3d S = field::couplings(field::dipoleField(pose.position_m, 1.0), pose.orientation);
    const Eigen::Matrix3d gains = Eigen::Matrix3d::Identity() + Eigen::Matrix3d(g.asDiagonal());
    const auto transmitter = effectOf("coil_gain", {{"transmitter_gain", {0.02, -0.01, 0.03}}});
    const auto receiver = effectOf("coil_gain", {{"receiver_gain", {0.02, -0.01, 0.03}}});
    FT_VERIFY_MATCH(near((couplingsWith(*transmitter, settingAt(pose)) - S * gains).norm() / S.norm(), 0.0, 1e-12));
    FT_VERIFY_MATCH(near((couplingsWith(*receiver, settingAt(pose)) - gains * S).norm() / S.norm(), 0.0, 1e-12));
  }
}

// A sensor on the X axis, all coils parallel: S = k diag(2, -1, -1), and the pose of least squares has
// k' = (2 d1 + d2 + d3)/6. A gain g of the coils x makes d1 = 2 (1 + g), so k' = k (1 + 2g/3); of the coils y
// k' = k (1 + g/6). The range goes as k^(-1/3), the direction stays.
void CoilGainTest::movesAReadingAsWorkedByHand_data() {
  QTest::addColumn<int>("coil");
  QTest::addColumn<double>("share");
  QTest::newRow("x, along") << 0 << 2.0 / 3.0;
  QTest::newRow("y, across") << 1 << 1.0 / 6.0;
  QTest::newRow("z, across") << 2 << 1.0 / 6.0;
}

void CoilGainTest::movesAReadingAsWorkedByHand() {
  QFETCH(int, coil);
  QFETCH(double, share);
  const Pose truth{{1.5, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  nlohmann::json gains = {0.0, 0.0, 0.0};
  gains[static_cast<std::size_t>(coil)] = 0.03;
  for (const char* coils : {"transmitter_gain", "receiver_gain"}) {
    const Pose seen = readingOf(*effectOf("coil_gain", {{coils, gains}}), settingAt(truth));
    const double range_m = 1.5 / std::cbrt(1.0 + share * 0.03);
    FT_VERIFY_MATCH(near(seen, Pose{{range_m, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, 1e-12, 1e-9));
  }
}

void CoilGainTest::doubtsAGainNoTrackerHas() {
  const auto way = wayOf("coil_gain", {}, "receiver");
  QVERIFY(way->describe({}, Eigen::Vector3d(0.05, -0.05, 0.0)).is_plausible);
  const FittedEffect fitted = way->describe({}, Eigen::Vector3d(0.05, -0.4, 0.0));
  QVERIFY(!fitted.is_plausible);
  FT_VERIFY_MATCH(holdsAll(fitted.doubt, {"receiver gain y of -40 %", "-10 % to 10 %"}));
}

FIELDTRUE_TEST(CoilGainTest)
#include "coil_gain_test.moc"
