#include "calib/effects/compact_metal.h"

#include <Eigen/QR>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/calib/effects/effect_geometry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::made;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::trackedPose;

namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;

/// Symmetric with eigenvalues of both signs.
Eigen::Matrix3d someTensor(RandomGeometry& random) {
  const Eigen::Matrix3d m = random.matrix();
  return 1e-3 * (m + m.transpose());
}

}  // namespace

class CompactMetalTest : public QObject {
  Q_OBJECT
 private slots:
  void bendsTheTrackerAsPublished_data();
  void bendsTheTrackerAsPublished();
  void conductorLetsNoFieldThroughItsSurface();
  void ferromagnetTakesTheFieldAtRightAngles();
  void knowsTheSphereLimits();
  void isReciprocal();
  void adds();
  void errsByTheDistanceRule();
  void growsAndFallsWithTheDistances();
  void answersTheCarrierAndTheDelay();
  void scalesWithVolume();
  void leavesNoRoomInside();
  void refusesATransmitterInside();
};

// Perfectly conducting spheres 0.5 m below a sensor 2 m from the transmitter: figures of an independent numerical
// study.
void CompactMetalTest::bendsTheTrackerAsPublished_data() {
  QTest::addColumn<double>("radius_m");
  QTest::addColumn<double>("error_cm");
  QTest::addColumn<double>("half_digit_cm");
  QTest::addColumn<double>("error_deg");
  QTest::addColumn<double>("half_digit_deg");
  QTest::newRow("radius 10 cm") << 0.1 << 0.7 << 0.05 << 0.44 << 0.005;
  QTest::newRow("radius 20 cm") << 0.2 << 5.0 << 0.05 << 3.2 << 0.05;
  QTest::newRow("radius 30 cm") << 0.3 << 13.0 << 0.5 << 8.8 << 0.05;
}

void CompactMetalTest::bendsTheTrackerAsPublished() {
  QFETCH(double, radius_m);
  QFETCH(double, error_cm);
  QFETCH(double, half_digit_cm);
  QFETCH(double, error_deg);
  QFETCH(double, half_digit_deg);
  const auto metal = made("compact_metal", {{"center_m", {2.0, 0.0, -0.5}}, {"radius_m", radius_m}});
  const Eigen::Vector3d p_true_m(2.0, 0.0, 0.0);
  const Pose tracked = trackedPose(*metal, p_true_m);
  FT_VERIFY_MATCH(near((tracked.position_m - p_true_m).norm() * 100.0, error_cm, half_digit_cm));
  FT_VERIFY_MATCH(near(angleBetween_rad(tracked.orientation, Eigen::Quaterniond::Identity()) / kDegree_rad, error_deg,
                       half_digit_deg));
}

// In a field uniform over the body (transmitter 100 radii away) the normal field on a perfect conductor is zero.
void CompactMetalTest::conductorLetsNoFieldThroughItsSurface() {
  const Eigen::Vector3d center_m(6.0, -5.0, 6.0);
  const double radius_m = 0.1;
  const auto metal = made("compact_metal", {{"center_m", {6.0, -5.0, 6.0}}, {"radius_m", radius_m}});
  const double field = field::dipoleField(center_m, 1.0).norm();
  RandomGeometry random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = random.direction();
    const Eigen::Vector3d p_m = center_m + radius_m * n;
    const Eigen::Matrix3d total = field::dipoleField(p_m, 1.0) + metal->fieldChange(p_m, 1.0, 0.0);
    FT_VERIFY_MATCH(near((n.transpose() * total).norm() / field, 0.0, 0.05));
  }
}

// Likewise the tangential field on a very permeable sphere.
void CompactMetalTest::ferromagnetTakesTheFieldAtRightAngles() {
  const Eigen::Vector3d center_m(6.0, -5.0, 6.0);
  const double radius_m = 0.1;
  const auto metal = made("compact_metal", {{"center_m", {6.0, -5.0, 6.0}},
                                            {"radius_m", radius_m},
                                            {"material", "ferromagnetic"},
                                            {"relative_permeability", 1e6}});
  const double field = field::dipoleField(center_m, 1.0).norm();
  RandomGeometry random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = random.direction();
    const Eigen::Vector3d p_m = center_m + radius_m * n;
    const Eigen::Matrix3d total = field::dipoleField(p_m, 1.0) + metal->fieldChange(p_m, 1.0, 0.0);
    const Eigen::Matrix3d tangential = total - n * (n.transpose() * total);
    FT_VERIFY_MATCH(near(tangential.norm() / field, 0.0, 0.05));
  }
}

// V chi with chi = -3/2 (perfect conductor) and 3 (mu_r - 1)/(mu_r + 2); chi(100) = 2.9118 by hand.
void CompactMetalTest::knowsTheSphereLimits() {
  const double volume_m3 = 4.0 / 3.0 * std::numbers::pi * 0.125;
  FT_VERIFY_MATCH(near(spherePolarizability_m3(0.5, false, 100.0) / volume_m3, -1.5, 1e-12));
  FT_VERIFY_MATCH(near(spherePolarizability_m3(0.5, true, 100.0) / volume_m3, 2.911765, 1e-6));
  FT_VERIFY_MATCH(near(spherePolarizability_m3(0.5, true, 1.0), 0.0, 1e-15));
}

// Transmitter and sensor exchanged, the couplings are the transpose: seen from p the body is at b - p, the other at -p.
void CompactMetalTest::isReciprocal() {
  RandomGeometry random(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p_m = random.between(0.5, 3.0) * random.direction();
    const Eigen::Vector3d b_m = p_m + random.between(0.5, 3.0) * random.direction();
    const Eigen::Matrix3d A = someTensor(random);
    const Eigen::Matrix3d forward = makeCompactMetal(b_m, A, 0.0)->fieldChange(p_m, 1.0, 0.0);
    const Eigen::Matrix3d backward = makeCompactMetal(b_m - p_m, A, 0.0)->fieldChange(-p_m, 1.0, 0.0);
    FT_VERIFY_MATCH(near((forward - backward.transpose()).norm() / forward.norm(), 0.0, 1e-12));
  }
}

// Linear in the tensor and in C; a sphere is its tensor.
void CompactMetalTest::adds() {
  RandomGeometry random(4);
  const Eigen::Vector3d b_m(1.0, 0.5, -0.7);
  const Eigen::Vector3d p_m(1.5, -0.3, 0.2);
  const Eigen::Matrix3d A = someTensor(random);
  const Eigen::Matrix3d B = someTensor(random);
  const auto change = [&](const Eigen::Matrix3d& tensor, double C) {
    return makeCompactMetal(b_m, tensor, 0.0)->fieldChange(p_m, C, 0.0);
  };
  FT_VERIFY_MATCH(near((change(A + 2.0 * B, 3.0) - 3.0 * change(A, 1.0) - 6.0 * change(B, 1.0)).norm(), 0.0, 1e-15));

  const double a = -2.0 * std::numbers::pi * 0.008;
  const auto sphere = made("compact_metal", {{"center_m", {1.0, 0.5, -0.7}}, {"radius_m", 0.2}});
  const auto tensor = made("compact_metal", {{"center_m", {1.0, 0.5, -0.7}},
                                             {"polarizability_m3", {{a, 0.0, 0.0}, {0.0, a, 0.0}, {0.0, 0.0, a}}}});
  FT_VERIFY_MATCH(near((sphere->fieldChange(p_m, 1.0, 0.0) - tensor->fieldChange(p_m, 1.0, 0.0)).norm(), 0.0, 1e-15));
}

// The law credited to Nixon 1998: error = K A/(4 pi) d_tr^4/(d_tm^3 d_mr^3). An independent study of 4,000 random
// geometries with all distances above 0.5 m has K median 1.98, 5th and 95th percentile 0.64 and 2.53; how it drew them
// is not told, so the bands are loose.
void CompactMetalTest::errsByTheDistanceRule() {
  RandomGeometry random(5);
  std::vector<double> factors;
  while (factors.size() < 4000) {
    const Eigen::Vector3d p_m = random.pointInCube_m(2.5);
    const Eigen::Vector3d b_m = random.pointInCube_m(2.5);
    const double d_tr = p_m.norm();
    const double d_tm = b_m.norm();
    const double d_mr = (p_m - b_m).norm();
    if (std::min({d_tr, d_tm, d_mr}) < 0.5) continue;
    const double A = 1e-4;
    const Pose tracked = trackedPose(*makeCompactMetal(b_m, A * Eigen::Matrix3d::Identity(), 0.0), p_m);
    const double rule_m = A / (4.0 * std::numbers::pi) * std::pow(d_tr, 4) / std::pow(d_tm * d_mr, 3);
    factors.push_back((tracked.position_m - p_m).norm() / rule_m);
  }
  std::sort(factors.begin(), factors.end());
  FT_VERIFY_MATCH(near(factors[2000], 1.98, 0.1));
  FT_VERIFY_MATCH(near(factors[200], 0.64, 0.12));
  FT_VERIFY_MATCH(near(factors[3800], 2.53, 0.12));
}

// Regression of the logarithms over 4,000 such geometries: for the position the law's 4, -3, -3 (the same study found
// 4.29, -3.05, -2.81), for the orientation, one power of the range less, 3.30, -2.82, -3.14 by the same study. How it
// drew its geometries is not told, and the exponents move by some tenths with that.
void CompactMetalTest::growsAndFallsWithTheDistances() {
  RandomGeometry random(6);
  constexpr int kDraws = 4000;
  Eigen::MatrixXd logs(kDraws, 4);
  Eigen::MatrixXd errors(kDraws, 2);
  for (int i = 0; i < kDraws;) {
    const Eigen::Vector3d p_m = random.pointInCube_m(2.5);
    const Eigen::Vector3d b_m = random.pointInCube_m(2.5);
    const Eigen::Vector3d distances(p_m.norm(), b_m.norm(), (p_m - b_m).norm());
    if (distances.minCoeff() < 0.5) continue;
    const auto metal = makeCompactMetal(b_m, -1e-6 * Eigen::Matrix3d::Identity(), 0.0);
    const Pose tracked = trackedPose(*metal, p_m);
    logs.row(i) << 1.0, distances.array().log().transpose();
    errors.row(i) << std::log((tracked.position_m - p_m).norm()),
        std::log(rotationVector_rad(tracked.orientation).norm());
    ++i;
  }
  const Eigen::MatrixXd exponents = logs.colPivHouseholderQr().solve(errors);
  FT_VERIFY_MATCH(near(exponents(1, 0), 4.29, 0.4));
  FT_VERIFY_MATCH(near(exponents(2, 0), -3.05, 0.4));
  FT_VERIFY_MATCH(near(exponents(3, 0), -2.81, 0.4));
  FT_VERIFY_MATCH(near(exponents(1, 1), 3.30, 0.4));
  FT_VERIFY_MATCH(near(exponents(2, 1), -2.82, 0.4));
  FT_VERIFY_MATCH(near(exponents(3, 1), -3.14, 0.4));
}

// A = (4/3) pi a^3 chi, chi of the table by Wait's formula: aluminium of 5 cm -1.46 at 10 kHz, steel -0.63; at rest
// nothing and 2.91.
void CompactMetalTest::answersTheCarrierAndTheDelay() {
  const auto chi = [](const nlohmann::json& parameters, const field::Excitation& excitation) {
    const Eigen::Vector3d center_m(1.0, 0.0, -1.0);
    const auto effect = makeEffect("compact_metal", parameters, excitation);
    field::SensorSetting setting;
    setting.tracker_from_sensor.position_m = {1.5, 0.2, 0.1};
    const Eigen::Matrix3d unit = field::dipoleField(setting.tracker_from_sensor.position_m - center_m, 1.0) *
                                 field::dipoleField(center_m, 0.000125 / 3.0);
    return effect.value()->at(setting).field_per_m3(0, 0) / unit(0, 0);
  };
  const nlohmann::json aluminium{{"radius_m", 0.05}, {"conductivity_s_per_m", 3.5e7}};
  nlohmann::json steel{{"radius_m", 0.05}, {"conductivity_s_per_m", 6e6}, {"material", "ferromagnetic"}};
  const field::Excitation carrier{false, 1e4, 0.0};
  const field::Excitation late{true, 0.0, 10.0};
  FT_VERIFY_MATCH(near(chi(aluminium, carrier), -1.46, 0.006));
  FT_VERIFY_MATCH(near(chi(steel, carrier), -0.63, 0.006));
  FT_VERIFY_MATCH(near(chi(aluminium, late), 0.0, 1e-6));
  FT_VERIFY_MATCH(near(chi(steel, late), 2.911765, 1e-4));
}

// Far from strong distortion the error is linear in the moment: twice the radius, eight times the error.
void CompactMetalTest::scalesWithVolume() {
  const Eigen::Vector3d p_m(1.5, 0.4, 0.2);
  const auto error_m = [&](double radius_m) {
    const auto metal = made("compact_metal", {{"center_m", {1.0, 0.9, -0.8}}, {"radius_m", radius_m}});
    return (trackedPose(*metal, p_m).position_m - p_m).norm();
  };
  FT_VERIFY_MATCH(near(error_m(0.02) / error_m(0.01), 8.0, 0.01));
}

void CompactMetalTest::leavesNoRoomInside() {
  const auto metal = made("compact_metal", {{"center_m", {1.0, 0.0, 0.0}}, {"radius_m", 0.2}});
  QVERIFY(!metal->admits({1.0, 0.19, 0.0}));
  QVERIFY(metal->admits({1.0, 0.21, 0.0}));
  // A permeable sphere of radius 0.2 m has at most 4 pi 0.008 m^3: nothing smaller can have this tensor.
  const double a = 4.0 * std::numbers::pi * 0.008;
  const auto tensor =
      made("compact_metal", {{"center_m", {1.0, 0.0, 0.0}}, {"polarizability_m3", {a, 0, 0, 0, a, 0, 0, 0, a}}});
  QVERIFY(!tensor->admits({1.0, 0.19, 0.0}));
  QVERIFY(tensor->admits({1.0, 0.21, 0.0}));
}

void CompactMetalTest::refusesATransmitterInside() {
  const auto metal = makeEffect("compact_metal", {{"center_m", {0.1, 0.0, 0.0}}, {"radius_m", 0.2}});
  QVERIFY(!metal.has_value());
  FT_VERIFY_MATCH(testing::holdsAll(metal.error().message, {"compact_metal", "center_m", "(0.1, 0, 0)", "0.2 m"}));
}

FIELDTRUE_TEST(CompactMetalTest)
#include "compact_metal_test.moc"
