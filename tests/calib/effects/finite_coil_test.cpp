#include <QTest>
#include <cmath>
#include <numbers>

#include "calib/effects/registry.h"
#include "calib/effects/rows.h"
#include "calib/field/pose_solver.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

namespace {

Eigen::Matrix3d changeAt(const Pose& tracker_from_sensor, const nlohmann::json& parameters) {
  const auto effect = makeEffect("finite_coil", parameters);
  field::SensorSetting setting;
  setting.tracker_from_sensor = tracker_from_sensor;
  return effect.value()->at(setting).field_per_m3;
}

nlohmann::json rings(const char* coil, double radius_m) {
  return {{"coil", coil}, {"radius_m", {radius_m, radius_m, radius_m}}};
}

}  // namespace

class FiniteCoilTest : public QObject {
  Q_OBJECT
 private slots:
  void ringOnItsAxis();
  void receiverIsTheTransmitterTurnedRound();
  void receiverReadsTheMeanFieldOverItsDisc();
  void leadingTermIsWhatIsLeftOfSmallRings_data();
  void leadingTermIsWhatIsLeftOfSmallRings();
  void squareHasTheSecondMomentOfItsRing();
  void errsAsItsSizeSquaredOverRange();
  void isFittedEitherWay();
};

// On the axis of a ring of moment 1 the field is 2/(z^2 + a^2)^(3/2) where the dipole's is 2/z^3.
void FiniteCoilTest::ringOnItsAxis() {
  const Pose pose{{0.0, 0.0, 0.3}, Eigen::Quaterniond::Identity()};
  const Eigen::Matrix3d change = changeAt(pose, rings("transmitter", 0.1));
  FT_VERIFY_MATCH(near(change(2, 2), 2.0 / std::pow(0.1, 1.5) - 2.0 / 0.027, 1e-10));
}

// The coupling of two coils is one number: big receiver rings at p, turned as the sensor, are big transmitter rings
// seen from there.
void FiniteCoilTest::receiverIsTheTransmitterTurnedRound() {
  RandomGeometry random(1);
  for (int i = 0; i < 50; ++i) {
    const Pose pose = random.poseInShell(0.3, 1.0);
    const Pose turned = inverse(pose);
    const Eigen::Matrix3d R = pose.orientation.toRotationMatrix();
    const Eigen::Matrix3d received = R.transpose() * changeAt(pose, rings("receiver", 0.08));
    const Eigen::Matrix3d sent = R * changeAt(turned, rings("transmitter", 0.08));
    FT_VERIFY_MATCH(near((received - sent.transpose()).norm() / received.norm(), 0.0, 1e-10));
  }
}

// A coil reads the flux through it: the dipole field averaged over a disc, summed here ring by ring.
void FiniteCoilTest::receiverReadsTheMeanFieldOverItsDisc() {
  const double radius_m = 0.1;
  const Pose pose{{0.5, 0.2, -0.3}, rotationFromVector(Eigen::Vector3d(0.4, -0.3, 0.8))};
  const Eigen::Matrix3d R = pose.orientation.toRotationMatrix();
  const Eigen::Matrix3d change = R.transpose() * changeAt(pose, rings("receiver", radius_m));
  constexpr int kRings = 60;
  constexpr int kAngles = 60;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
    for (int i = 0; i < kRings; ++i) {
      const double rho_m = radius_m * std::sqrt((i + 0.5) / kRings);
      for (int j = 0; j < kAngles; ++j) {
        const double angle = 2.0 * std::numbers::pi * j / kAngles;
        const Eigen::Vector3d from_m =
            rho_m * (std::cos(angle) * R.col((axis + 1) % 3) + std::sin(angle) * R.col((axis + 2) % 3));
        mean += R.col(axis).transpose() * field::dipoleField(pose.position_m + from_m, 1.0) / (kRings * kAngles);
      }
    }
    const Eigen::RowVector3d dipole = R.col(axis).transpose() * field::dipoleField(pose.position_m, 1.0);
    FT_VERIFY_MATCH(near((mean - dipole - change.row(axis)).norm() / change.row(axis).norm(), 0.0, 2e-3));
  }
}

void FiniteCoilTest::leadingTermIsWhatIsLeftOfSmallRings_data() {
  QTest::addColumn<QString>("coil");
  QTest::newRow("transmitter") << "transmitter";
  QTest::newRow("receiver") << "receiver";
}

// The next term is (a/r)^2 of it, with a factor below 3.
void FiniteCoilTest::leadingTermIsWhatIsLeftOfSmallRings() {
  QFETCH(QString, coil);
  RandomGeometry random(2);
  const std::string name = coil.toStdString();
  for (int i = 0; i < 100; ++i) {
    const Pose pose = random.poseInShell(0.5, 1.5);
    const double radius_m = 0.02;
    const Eigen::Matrix3d exact = changeAt(pose, rings(name.c_str(), radius_m));
    const Eigen::Matrix3d leading = changeAt(pose, {{"coil", name}, {"radius_squared_m2", radius_m * radius_m}});
    const double next = std::pow(radius_m / pose.position_m.norm(), 2);
    FT_VERIFY_MATCH(near((exact - leading).norm() / exact.norm(), 0.0, 3.0 * next));
  }
}

// Mean square distance from an axis in the coil's plane: b^2/3 for a square of half side b, a^2/4 for a ring.
void FiniteCoilTest::squareHasTheSecondMomentOfItsRing() {
  const Pose pose{{0.4, 0.3, 0.2}, Eigen::Quaterniond::Identity()};
  nlohmann::json square = rings("transmitter", 0.03);
  square["shape"] = "square";
  const Eigen::Matrix3d ring = changeAt(pose, rings("transmitter", 0.03 * std::sqrt(4.0 / 3.0)));
  FT_VERIFY_MATCH(near((changeAt(pose, square) - ring).norm(), 0.0, 1e-12));
}

// The couplings change by (a/r)^2 of themselves, so the position does by a^2/r of a length: four times for twice the
// coil, half as much twice as far. On an axis and on a space diagonal nothing tells one side from another, so the
// position stays on its line.
void FiniteCoilTest::errsAsItsSizeSquaredOverRange() {
  const auto error_m = [](const Eigen::Vector3d& p_m, double radius_m) {
    const Eigen::Matrix3d field =
        field::dipoleField(p_m, 1.0) + changeAt({p_m, Eigen::Quaterniond::Identity()}, rings("transmitter", radius_m));
    return Eigen::Vector3d(field::solvePose(field, 1.0, p_m)->tracker_from_sensor.position_m - p_m);
  };
  const Eigen::Vector3d p_m(0.6, 0.3, -0.2);
  FT_VERIFY_MATCH(near(error_m(p_m, 0.02).norm() / error_m(p_m, 0.01).norm(), 4.0, 0.02));
  FT_VERIFY_MATCH(near(error_m(p_m, 0.02).norm() / error_m(2.0 * p_m, 0.02).norm(), 2.0, 0.02));
  for (const Eigen::Vector3d& line : {Eigen::Vector3d(0.5, 0.0, 0.0), Eigen::Vector3d(0.3, 0.3, 0.3)}) {
    const Eigen::Vector3d error = error_m(line, 0.03);
    QVERIFY(error.norm() > 1e-5);
    FT_VERIFY_MATCH(near(error.cross(line.normalized()).norm(), 0.0, 1e-12));
  }
}

void FiniteCoilTest::isFittedEitherWay() {
  const auto ways = (*findEffect("finite_coil").value()).fits(FitDesign{});
  QCOMPARE(ways.size(), std::size_t{2});
  QVERIFY(ways[0]->name() == "transmitter" && ways[1]->name() == "receiver");
  const FittedEffect fitted = ways[0]->describe(Eigen::VectorXd(), Eigen::VectorXd::Constant(1, 0.0004));
  QVERIFY(fitted.is_plausible);
  const FittedEffect inside_out = ways[0]->describe(Eigen::VectorXd(), Eigen::VectorXd::Constant(1, -0.0004));
  QVERIFY(!inside_out.is_plausible && !inside_out.doubt.empty());
}

FIELDTRUE_TEST(FiniteCoilTest)
#include "finite_coil_test.moc"
