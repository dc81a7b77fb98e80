#include <QTest>
#include <cmath>

#include "tests/blind/is_near.h"
#include "tests/blind/plates.h"
#include "tests/blind/pose_solver.h"
#include "tests/support/test_main.h"

using namespace blind;

namespace {

bool isNear(const Matrix3d& value, const Matrix3d& expected, double share) {
  const double away = (value - expected).norm() / expected.norm();
  if (away > share) qWarning("away by %.4g of the norm", away);
  return away <= share;
}

/// Polarizability over volume of a sphere, magnetisation per applied H.
/// @source Wait 1951, Geophysics 16, 666, in the form with tanh of electromagnetic text books
Complex waitSphere(double radius_m, double relative_permeability, double conductivity_s_m, double frequency_hz) {
  const double mu0 = 4e-7 * kPi;
  const double mu = mu0 * relative_permeability;
  const Complex a = radius_m * std::sqrt(Complex(0, 2 * kPi * frequency_hz * mu * conductivity_s_m));
  const Complex t = std::tanh(a);
  const Complex inner = a * a * t - a + t;
  return 1.5 * (2 * mu * (a - t) - mu0 * inner) / (mu * (a - t) + mu0 * inner);
}

/// Image of a transmitter at the origin in a perfectly conducting plane below it, normal z.
Matrix3d imageField(const Vector3d& p_m, double height_m) {
  const Vector3d image_m(0, 0, -2 * height_m);
  return dipoleField(p_m - image_m) * Vector3d(1, 1, -1).asDiagonal();
}

}  // namespace

class BlindPhysicsTest : public QObject {
  Q_OBJECT
 private slots:
  void dipoleByHand_data();
  void dipoleByHand();
  void roundLoopOnItsAxis_data();
  void roundLoopOnItsAxis();
  void squareLoopAtItsCentre();
  void squareCoilsOnTheAxis_data();
  void squareCoilsOnTheAxis();
  void finiteCoilsBecomeDipolesWithTheSquareOfRange();
  void sphereAgreesWithWait_data();
  void sphereAgreesWithWait();
  void sphereAsAPublishedTableHasIt();
  void latticeOfASphereIsASphere_data();
  void latticeOfASphereIsASphere();
  void latticeScattersAsOneDipole();
  void wideFloorActsAsAnImage_data();
  void wideFloorActsAsAnImage();
  void squarePlateAsPublished();
  void meshHasItsResistanceAndInductance();
  void closedLoopHasItsResistanceAndInductance();
  void poseIsRecovered_data();
  void poseIsRecovered();
  void noiseEllipsoidIsFlat();
};

void BlindPhysicsTest::dipoleByHand_data() {
  QTest::addColumn<double>("x");
  QTest::addColumn<double>("y");
  QTest::addColumn<int>("row");
  QTest::addColumn<int>("column");
  QTest::addColumn<double>("field");
  QTest::newRow("on the axis: 2 / r^3") << 0.5 << 0.0 << 0 << 0 << 16.0;
  QTest::newRow("on the equator: -1 / r^3") << 0.5 << 0.0 << 1 << 1 << -8.0;
  QTest::newRow("across") << 0.5 << 0.0 << 0 << 1 << 0.0;
  QTest::newRow("at 45 degrees: 3/2 / r^3") << std::sqrt(0.5) << std::sqrt(0.5) << 1 << 0 << 1.5;
  QTest::newRow("at 45 degrees, along: 1/2 / r^3") << std::sqrt(0.5) << std::sqrt(0.5) << 0 << 0 << 0.5;
}

void BlindPhysicsTest::dipoleByHand() {
  QFETCH(double, x);
  QFETCH(double, y);
  QFETCH(int, row);
  QFETCH(int, column);
  QFETCH(double, field);
  QVERIFY(std::abs(dipoleField({x, y, 0})(row, column) - field) < 1e-12);
}

void BlindPhysicsTest::roundLoopOnItsAxis_data() {
  QTest::addColumn<double>("z_m");
  QTest::newRow("centre") << 0.0;
  QTest::newRow("one radius") << 0.3;
  QTest::newRow("far") << 2.0;
}

void BlindPhysicsTest::roundLoopOnItsAxis() {
  QFETCH(double, z_m);
  const double a = 0.3;
  const Polygon loop = roundLoop({0.1, -0.2, 0.4}, Vector3d::UnitZ(), a, 400);
  QVERIFY(isNear(areaVector(loop).z(), kPi * a * a, 1e-9));
  // Biot and Savart: mu0 I a^2 / (2 (a^2 + z^2)^(3/2)).
  const double expected = 2 * kPi * a * a / std::pow(a * a + z_m * z_m, 1.5);
  QVERIFY(isNear(loopField(loop, {0.1, -0.2, 0.4 + z_m}).z(), expected, 1e-4));
}

void BlindPhysicsTest::squareLoopAtItsCentre() {
  // 2 sqrt(2) mu0 I / (pi side).
  const Polygon square = rectangle(Vector3d::Zero(), {0.25, 0, 0}, {0, 0.25, 0});
  QVERIFY(isNear(loopField(square, Vector3d::Zero()).z(), 8 * std::sqrt(2.0) / 0.5, 1e-12));
}

void BlindPhysicsTest::squareCoilsOnTheAxis_data() {
  QTest::addColumn<double>("half_m");
  QTest::addColumn<double>("range_m");
  QTest::newRow("small") << 0.02 << 0.8;
  QTest::newRow("near") << 0.05 << 0.5;
  QTest::newRow("large") << 0.15 << 1.0;
}

void BlindPhysicsTest::squareCoilsOnTheAxis() {
  QFETCH(double, half_m);
  QFETCH(double, range_m);
  const double h2 = half_m * half_m, z2 = range_m * range_m;
  // Four straight wires, on the axis: mu0 I side^2 / (2 pi (z^2 + h^2) sqrt(z^2 + 2 h^2)), divided by the moment.
  const double expected = 2 / ((z2 + h2) * std::sqrt(z2 + 2 * h2));
  const Vector3d p(range_m, 0, 0);
  QVERIFY(isNear(coilCouplings(p, Matrix3d::Identity(), half_m, 0)(0, 0), expected, 1e-10));
  // Reciprocity: a receiver of that size hears a dipole as strongly. Four points of Gauss leave (half / range)^4.
  const double left = 2 * h2 * h2 / (z2 * z2) + 1e-9;
  QVERIFY(isNear(coilCouplings(p, Matrix3d::Identity(), 0, half_m)(0, 0), expected, left));
}

void BlindPhysicsTest::finiteCoilsBecomeDipolesWithTheSquareOfRange() {
  const Vector3d toward = Vector3d(0.6, -0.5, 0.4).normalized();
  for (const bool transmitter : {true, false}) {
    const auto away = [&](double r) {
      const Vector3d p = r * toward;
      const double t = transmitter ? 0.04 : 0.0, s = transmitter ? 0.0 : 0.04;
      return (coilCouplings(p, Matrix3d::Identity(), t, s) - dipoleField(p)).norm() / dipoleField(p).norm();
    };
    QVERIFY(isNear(away(1.0) / away(2.0), 4.0, 0.02));
  }
}

void BlindPhysicsTest::sphereAgreesWithWait_data() {
  QTest::addColumn<double>("radius_m");
  QTest::addColumn<double>("permeability");
  QTest::addColumn<double>("conductivity");
  for (const auto& [name, mu, sigma] :
       {std::tuple("aluminium", 1.0, 3.5e7), std::tuple("steel", 100.0, 6e6), std::tuple("stainless", 1.0, 1.4e6)})
    for (double radius_m : {0.0125, 0.05, 0.2}) QTest::addRow("%s %.4f m", name, radius_m) << radius_m << mu << sigma;
}

void BlindPhysicsTest::sphereAgreesWithWait() {
  QFETCH(double, radius_m);
  QFETCH(double, permeability);
  QFETCH(double, conductivity);
  for (double hz : {100.0, 1000.0}) {
    const Complex mu = apparentPermeability(radius_m, permeability, conductivity, hz);
    const Complex chi = 3.0 * (mu - 1.0) / (mu + 2.0);
    const Complex expected = waitSphere(radius_m, permeability, conductivity, hz);
    QVERIFY2(
        std::abs(chi - expected) < 1e-6 * std::abs(expected),
        qPrintable(
            QString("%1 %2i, Wait %3 %4i").arg(chi.real()).arg(chi.imag()).arg(expected.real()).arg(expected.imag())));
  }
  // Limits: at rest 3 (mu - 1) / (mu + 2), at high frequency -3/2.
  const Complex still = apparentPermeability(radius_m, permeability, conductivity, 1e-6);
  QVERIFY(std::abs(3.0 * (still - 1.0) / (still + 2.0) - 3 * (permeability - 1) / (permeability + 2)) < 1e-3);
  const Complex fast = apparentPermeability(radius_m, permeability, conductivity, 1e12);
  QVERIFY(std::abs(3.0 * (fast - 1.0) / (fast + 2.0) + 1.5) < 0.02);
}

void BlindPhysicsTest::sphereAsAPublishedTableHasIt() {
  // Steel, relative permeability 100, 6e6 S/m, evaluated from Wait's formula to two decimals.
  struct Line {
    double radius_m, hz;
    Complex chi;
  };
  for (const Line& line : {Line{0.0125, 1e3, {2.18, -0.59}}, Line{0.05, 1e3, {0.64, -0.93}},
                           Line{0.05, 1e4, {-0.63, -0.62}}, Line{0.1, 100, {1.23, -0.90}}}) {
    const Complex mu = apparentPermeability(line.radius_m, 100, 6e6, line.hz);
    QVERIFY(std::abs(3.0 * (mu - 1.0) / (mu + 2.0) - line.chi) < 0.008);
  }
}

void BlindPhysicsTest::latticeOfASphereIsASphere_data() {
  QTest::addColumn<double>("permeability");
  QTest::addColumn<double>("allowed");
  // A staircase of nine cells is not round: the more it is magnetised, the more its corners carry.
  QTest::newRow("perfect conductor") << 0.0 << 0.05;
  QTest::newRow("weak") << 3.0 << 0.05;
  QTest::newRow("ferrite") << 50.0 << 0.12;
}

void BlindPhysicsTest::latticeOfASphereIsASphere() {
  QFETCH(double, permeability);
  QFETCH(double, allowed);
  const double a = 0.15;
  Lattice sphere = makeLattice(BodyShape::kSphere, {1, 2, 3}, Quaterniond::Identity(), Vector3d::Constant(2 * a), 9);
  sphere.permeability = permeability;
  const Eigen::Matrix3cd response = uniformResponse({sphere});
  const double expected = a * a * a * (permeability - 1) / (permeability + 2);
  QVERIFY(isNear(Matrix3d(response.real()), expected * Matrix3d::Identity(), allowed));
}

void BlindPhysicsTest::latticeScattersAsOneDipole() {
  const Vector3d at(0.3, 1.2, -0.8), sensor(1.4, 0.6, 0.2);
  Lattice sphere = makeLattice(BodyShape::kSphere, at, Quaterniond::Identity(), Vector3d::Constant(0.1), 7);
  sphere.permeability = 0;
  const Scatterer metal = solveLattices({sphere});
  const double polarizability = -0.5 * std::pow(0.05, 3);
  const Matrix3d expected = dipoleField(sensor - at) * polarizability * dipoleField(at);
  QVERIFY(isNear(metal.fieldAt(sensor), expected, 0.06));
  // Reciprocity: what passes from the source to the sensor passes back.
  const Scatterer back = solveLattices({sphere}, sensor);
  QVERIFY(isNear(Matrix3d(back.fieldAt(Vector3d::Zero()).transpose()), metal.fieldAt(sensor), 1e-9));
}

void BlindPhysicsTest::wideFloorActsAsAnImage_data() {
  QTest::addColumn<double>("height_m");
  QTest::addColumn<double>("range_m");
  QTest::newRow("1 m high, sensor beside") << 1.0 << 0.6;
  QTest::newRow("1 m high, sensor away") << 1.0 << 1.2;
  QTest::newRow("1.3 m high") << 1.3 << 0.8;
}

void BlindPhysicsTest::wideFloorActsAsAnImage() {
  QFETCH(double, height_m);
  QFETCH(double, range_m);
  const MeshedSheet sheet(26, 26, 0.3, 1e-9, 10000);
  const Vector3d p(range_m, 0, 0.1);
  const Matrix3d field = sheet.solve({0.5 * range_m, 0, -height_m}, Quaterniond::Identity()).fieldAt(p);
  QVERIFY(isNear(field, imageField(p, height_m), 0.06));
}

void BlindPhysicsTest::squarePlateAsPublished() {
  // A square plate of perfect conductor across a uniform field: moment -4 * 0.1126 side^3 of H by duality with the
  // electric polarizability of a square aperture (De Meulenaere and Van Bladel 1977, IEEE Trans. AP-25, 198).
  const double side_m = 0.5, away_m = 40;
  const double applied = 2 / std::pow(away_m, 3);
  const auto momentOf = [&](int cells) {
    const MeshedSheet plate(cells, cells, side_m / cells, 1e-9, 10000);
    Matrix3d moment = Matrix3d::Zero();
    for (const Matrix3d& one : plate.solve({0, 0, away_m}, Quaterniond::Identity()).moment) moment += one;
    return moment;
  };
  // The outermost strip of current, as wide as a mesh, stands over the edge: the plate acts as one larger by a mesh,
  // the cube root of its moment by 1 / cells. Extrapolated to no mesh at all:
  const double root = 2 * std::cbrt(-momentOf(20)(2, 2)) - std::cbrt(-momentOf(10)(2, 2));
  QVERIFY(isNear(std::pow(root, 3), 4 * 0.1126 * std::pow(side_m, 3) / (4 * kPi) * applied, 0.03));
  QVERIFY(std::abs(momentOf(10)(0, 0)) < 1e-6 * std::abs(momentOf(10)(2, 2)));
}

void BlindPhysicsTest::meshHasItsResistanceAndInductance() {
  // One square mesh: four squares of sheet in series; the in-phase current is -flux w^2 L / (R^2 + w^2 L^2).
  const double side_m = 0.2, away_m = 20, sheet_ohm = 1e-3;
  const double flux = kHenryPerUnit * side_m * side_m * 2 / std::pow(away_m, 3);
  const auto current = [&](double hz) {
    const Scatterer metal = MeshedSheet(1, 1, side_m, sheet_ohm, hz).solve({0, 0, away_m}, Quaterniond::Identity());
    return metal.moment[0](2, 2) / (side_m * side_m);
  };
  const double inductance = -flux / current(1e9);
  // Grover 1946, Inductance Calculations, chapter 8: square of side s whose conductor has the mean distance g = s
  // e^-1.5 of a strip as wide as the mesh: 8e-7 s (ln(s / g) - 0.77401 + g / s) H.
  QVERIFY(isNear(inductance, 8e-7 * side_m * (1.5 - 0.77401 + std::exp(-1.5)), 0.03));
  const double w = 2 * kPi * 500;
  const double resistance = std::sqrt(w * w * inductance * (-flux / current(500) - inductance));
  QVERIFY(isNear(resistance, 4 * sheet_ohm, 1e-3));
}

void BlindPhysicsTest::closedLoopHasItsResistanceAndInductance() {
  // mu0 a (ln(8 a / b) - 2), a = 0.5 m, b = 1 mm: 6.2832e-7 * (8.2940 - 2) H.
  const double inductance = roundLoopInductance(0.5, 0.001);
  QVERIFY(isNear(inductance, 3.9546e-6, 1e-4));
  const Polygon loop = roundLoop({0, 0, 15}, Vector3d::UnitZ(), 0.5, 64);
  const double flux = kHenryPerUnit * kPi * 0.25 * 2 / std::pow(15.0, 3);
  const double hz = 10000, reactance = 2 * kPi * hz * inductance;
  // Without resistance the flux is held out; with as much resistance as reactance half of the current is in phase.
  QVERIFY(isNear(solveClosedLoop(loop, 0, inductance, hz).current[0].z(), -flux / inductance, 0.005));
  QVERIFY(isNear(solveClosedLoop(loop, reactance, inductance, hz).current[0].z(), -0.5 * flux / inductance, 0.005));
}

void BlindPhysicsTest::poseIsRecovered_data() {
  QTest::addColumn<double>("x");
  QTest::addColumn<double>("y");
  QTest::addColumn<double>("z");
  QTest::newRow("ahead") << 1.0 << 0.0 << 0.0;
  QTest::newRow("behind and above") << -0.7 << 0.2 << 0.9;
  QTest::newRow("far") << 1.4 << -1.3 << -0.8;
  QTest::newRow("near") << 0.2 << 0.3 << -0.35;
}

void BlindPhysicsTest::poseIsRecovered() {
  QFETCH(double, x);
  QFETCH(double, y);
  QFETCH(double, z);
  const Vector3d p(x, y, z);
  Random random(5);
  for (int n = 0; n < 20; ++n) {
    const Quaterniond q = rotation(random);
    const Matrix3d couplings = q.toRotationMatrix().transpose() * dipoleField(p);
    const SolvedPose pose = solvePose(couplings, p + 0.3 * p.norm() * direction(random));
    QVERIFY((pose.position_m - p).norm() < 1e-9);
    QVERIFY(pose.orientation.angularDistance(q) < 1e-9);
  }
}

void BlindPhysicsTest::noiseEllipsoidIsFlat() {
  // Least squares from nine couplings of equal noise: radial r^4 / (3 sqrt 6), across sqrt(5) / 3 r^4, rotation
  // sqrt(3/2) r^3 (root mean square of three axes); worked from the eigenvalues of (3 u u^T - I).
  const Vector3d u = Vector3d(0.3, -0.8, 0.5).normalized();
  for (double r : {0.6, 1.0, 2.1}) {
    const auto derivative = couplingDerivative(r * u, Matrix3d::Identity());
    const Eigen::Matrix<double, 6, 6> covariance = (derivative.transpose() * derivative).inverse();
    const Matrix3d place = covariance.topLeftCorner<3, 3>();
    const Vector3d across = u.unitOrthogonal();
    QVERIFY(isNear(std::sqrt(u.dot(place * u)), std::pow(r, 4) / (3 * std::sqrt(6.0)), 1e-9));
    QVERIFY(isNear(std::sqrt(across.dot(place * across)), std::sqrt(5.0) / 3 * std::pow(r, 4), 1e-9));
    const double rotation = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3);
    QVERIFY(isNear(rotation, std::sqrt(1.5) * std::pow(r, 3), 1e-9));
  }
}

FIELDTRUE_TEST(BlindPhysicsTest)
#include "blind_physics_test.moc"
