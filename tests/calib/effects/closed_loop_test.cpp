#include "calib/effects/closed_loop.h"

#include <QTest>
#include <cmath>
#include <numbers>

#include "calib/effects/parameters.h"
#include "tests/calib/effects/effect_geometry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::made;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

namespace {

std::unique_ptr<field::CouplingDistortion> loopAt(const Eigen::Vector3d& center_m, const Eigen::Vector3d& normal,
                                                  double radius_m) {
  return made("closed_loop",
              {{"center_m", effects::listOf(center_m)}, {"normal", effects::listOf(normal)}, {"radius_m", radius_m}});
}

/// Law of Biot and Savart, summed over many straight pieces of a ring about the z axis; exact to (1/pieces)^2.
Eigen::Vector3d biotSavart_per_m(const Eigen::Vector3d& p_m, double radius_m) {
  constexpr int kPieces = 20000;
  Eigen::Vector3d h_per_m = Eigen::Vector3d::Zero();
  for (int i = 0; i < kPieces; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + 0.5) / kPieces;
    const Eigen::Vector3d along(-std::sin(angle), std::cos(angle), 0.0);
    const Eigen::Vector3d from_m = p_m - radius_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    h_per_m += along.cross(from_m) * (2.0 * std::numbers::pi * radius_m / kPieces) /
               (4.0 * std::numbers::pi * std::pow(from_m.norm(), 3));
  }
  return h_per_m;
}

}  // namespace

class ClosedLoopTest : public QObject {
  Q_OBJECT
 private slots:
  void knowsTheFieldOnItsAxis();
  void agreesWithBiotAndSavart();
  void isSmoothNearItsAxis();
  void isADipoleFarAway();
  void isReciprocal();
  void keepsTheFluxOut();
  void answersByItsStrength();
  void copperCableIsAsStrongAsTabulated();
  void leavesNoRoomInTheWire();
  void refusesWhatMakesNoSense();
};

// H = R^2 / (2 (R^2 + z^2)^(3/2)): in the middle 1/(2R), at z = R 1/(4 sqrt(2) R).
void ClosedLoopTest::knowsTheFieldOnItsAxis() {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0;
  FT_VERIFY_MATCH(near(ringField_per_m({0, 0, 0}, axis, 0.4), Eigen::Vector3d(1.25 * axis), 1e-14));
  FT_VERIFY_MATCH(near(ringField_per_m(0.4 * axis, axis, 0.4), Eigen::Vector3d(axis / (1.6 * std::sqrt(2.0))), 1e-14));
}

void ClosedLoopTest::agreesWithBiotAndSavart() {
  RandomGeometry random(1);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d p_m = random.between(0.05, 2.0) * random.direction();
    if (std::hypot(std::hypot(p_m.x(), p_m.y()) - 0.3, p_m.z()) < 0.02) continue;
    const Eigen::Vector3d expected_per_m = biotSavart_per_m(p_m, 0.3);
    const Eigen::Vector3d seen_per_m = ringField_per_m(p_m, Eigen::Vector3d::UnitZ(), 0.3);
    FT_VERIFY_MATCH(near((seen_per_m - expected_per_m).norm() / expected_per_m.norm(), 0.0, 1e-5));
  }
}

// The series by the axis and the elliptic integrals meet.
void ClosedLoopTest::isSmoothNearItsAxis() {
  for (const double z_m : {-1.0, 0.1, 0.7}) {
    const double border_m = 1e-4 * std::hypot(0.3, z_m);
    const Eigen::Vector3d inside_per_m = ringField_per_m({0.999 * border_m, 0, z_m}, Eigen::Vector3d::UnitZ(), 0.3);
    const Eigen::Vector3d outside_per_m = ringField_per_m({1.001 * border_m, 0, z_m}, Eigen::Vector3d::UnitZ(), 0.3);
    FT_VERIFY_MATCH(near(outside_per_m.x() / inside_per_m.x(), 1.001 / 0.999, 1e-6));
    FT_VERIFY_MATCH(near(outside_per_m.z() / inside_per_m.z(), 1.0, 1e-7));
  }
}

// A ring seen from 100 radii is a body of polarizability -pi^2 R^3 / (ln(8R/a) - 2) along its axis: moment pi R^2 I,
// flux mu_0 pi R^2 H. The next term is of the order (R/r)^2.
void ClosedLoopTest::isADipoleFarAway() {
  const Eigen::Vector3d n = Eigen::Vector3d(2.0, -1.0, 2.0) / 3.0;
  const Eigen::Vector3d center_m(3.0, 2.0, -4.0);
  const Eigen::Vector3d p_m(-2.0, 3.0, 1.0);
  const double a_m3 = -std::pow(std::numbers::pi, 2) * 1.25e-4 / (std::log(8.0 * 0.05 / 0.001) - 2.0);
  const Eigen::Matrix3d polarizability_m3 = a_m3 * n * n.transpose();
  const auto loop = made("closed_loop", {{"center_m", effects::listOf(center_m)},
                                         {"normal", effects::listOf(n)},
                                         {"radius_m", 0.05},
                                         {"wire_radius_m", 0.001}});
  const Eigen::Matrix3d expected = field::dipoleField(p_m - center_m, 1.0 / (4.0 * std::numbers::pi)) *
                                   polarizability_m3 * field::dipoleField(center_m, 1.0);
  FT_VERIFY_MATCH(near((loop->fieldChange(p_m, 1.0, 0.0) - expected).norm() / expected.norm(), 0.0, 1e-3));
}

// Transmitter and sensor exchanged, the couplings are the transpose.
void ClosedLoopTest::isReciprocal() {
  RandomGeometry random(2);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p_m = random.between(1.0, 3.0) * random.direction();
    const Eigen::Vector3d center_m = random.between(1.0, 3.0) * random.direction();
    const Eigen::Vector3d n = random.direction();
    const Eigen::Matrix3d forward = loopAt(center_m, n, 0.4)->fieldChange(p_m, 1.0, 0.0);
    const Eigen::Matrix3d backward = loopAt(center_m - p_m, n, 0.4)->fieldChange(-p_m, 1.0, 0.0);
    FT_VERIFY_MATCH(near((forward - backward.transpose()).norm() / forward.norm(), 0.0, 1e-9));
  }
}

// Without resistance the induced current's own flux L I cancels the transmitter's. The transmitter's flux through the
// disc is integrated here: for a coil on the axis at distance z with moment 4 pi C along it,
// the integral of C (3 cos^2 - 1)/r^3 over the disc is 2 pi C R^2/(R^2 + z^2)^(3/2).
void ClosedLoopTest::keepsTheFluxOut() {
  const double R_m = 0.5;
  const double z_m = 1.2;
  const double a_m = 0.01;
  const auto loop = made("closed_loop", {{"center_m", {0.0, 0.0, z_m}}, {"radius_m", R_m}, {"wire_radius_m", a_m}});
  const double current_m2 = 2.0 * R_m * loop->fieldChange({0.0, 0.0, z_m}, 1.0, 0.0)(2, 2);
  const double own_flux = R_m * (std::log(8.0 * R_m / a_m) - 2.0) * current_m2;
  const double flux = 2.0 * std::numbers::pi * R_m * R_m / std::pow(R_m * R_m + z_m * z_m, 1.5);
  FT_VERIFY_MATCH(near(own_flux / flux, -1.0, 1e-12));
}

void ClosedLoopTest::answersByItsStrength() {
  const Eigen::Vector3d p_m(0.8, -0.6, 0.3);
  const auto whole = made("closed_loop", nlohmann::json::object());
  const auto half = made("closed_loop", {{"strength", 0.5}});
  const auto none = made("closed_loop", {{"strength", 0.0}});
  FT_VERIFY_MATCH(
      near((half->fieldChange(p_m, 1.0, 0.0) - 0.5 * whole->fieldChange(p_m, 1.0, 0.0)).norm(), 0.0, 1e-15));
  QCOMPARE(none->fieldChange(p_m, 1.0, 0.0).norm(), 0.0);
}

// An independent study: a copper ring of 0.5 m radius and 1 mm wire answers at 10 kHz as 0.196 m^3 along its axis, a
// metal sphere of 31 cm, of which 0.995 is in phase, and on pulsed direct current is gone after about a millisecond.
void ClosedLoopTest::copperCableIsAsStrongAsTabulated() {
  const Eigen::Vector3d center_m(0.0, 0.0, 20.0);
  const auto along_m3 = [&](const field::Excitation& excitation) {
    const auto loop = makeEffect(
        "closed_loop",
        {{"center_m", {0.0, 0.0, 20.0}}, {"radius_m", 0.5}, {"wire_radius_m", 0.001}, {"conductivity_s_per_m", 5.8e7}},
        excitation);
    field::SensorSetting setting;
    setting.tracker_from_sensor.position_m = {0.0, 0.0, 40.0};
    const double unit =
        field::dipoleField(center_m, 1.0)(2, 2) * field::dipoleField(center_m, 0.25 / std::numbers::pi)(2, 2);
    return loop.value()->at(setting).field_per_m3(2, 2) / unit;
  };
  FT_VERIFY_MATCH(near(along_m3(field::Excitation{false, 1e4, 0.0}), -0.195, 0.001));
  FT_VERIFY_MATCH(near(along_m3(field::Excitation{true, 0.0, 1e-3}) / -0.196, 0.013, 0.002));
}

void ClosedLoopTest::leavesNoRoomInTheWire() {
  const auto loop = made("closed_loop", {{"center_m", {1.0, 0.0, 0.0}}, {"radius_m", 0.5}, {"wire_radius_m", 0.01}});
  QVERIFY(!loop->admits({1.505, 0.0, 0.0}));
  QVERIFY(!loop->admits({1.0, 0.5, 0.009}));
  QVERIFY(loop->admits({1.0, 0.5, 0.011}));
  QVERIFY(loop->admits({1.0, 0.0, 0.0}));
}

void ClosedLoopTest::refusesWhatMakesNoSense() {
  const auto flat = makeEffect("closed_loop", {{"normal", {0.0, 0.0, 0.0}}});
  QVERIFY(!flat && flat.error().code == ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(flat.error().message, {"closed_loop", "normal"}));
  const auto thick = makeEffect("closed_loop", {{"radius_m", 0.1}, {"wire_radius_m", 0.05}});
  QVERIFY(!thick && thick.error().code == ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(thick.error().message, {"wire_radius_m", "0.05", "0.1"}));
  const auto around = makeEffect("closed_loop", {{"center_m", {0.3, 0.0, 0.0}}, {"radius_m", 0.3}});
  QVERIFY(!around && around.error().code == ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(around.error().message, {"transmitter", "wire"}));
}

FIELDTRUE_TEST(ClosedLoopTest)
#include "closed_loop_test.moc"
