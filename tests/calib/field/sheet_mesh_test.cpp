#include "calib/field/sheet_mesh.h"

#include <QTest>
#include <cmath>
#include <numbers>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::field;
using fieldtrue::testing::near;

namespace {

double everything(double /*rate*/) { return 1.0; }

/// Moment per field normal to the sheet, summed over the cells [m^3].
double normalMoment_m3(const SheetMesh& mesh, double (*share)(double)) {
  const SheetModes modes = mesh.currentModes();
  const Eigen::VectorXd even = Eigen::VectorXd::Ones(modes.vectors.rows());
  return -even.dot(modes.answer(share) * even);
}

/// Moment per field along the sheet's length [m^3].
double tangentialMoment_m3(const SheetMesh& mesh, double chi_t_m) {
  const SheetModes modes = mesh.chargeModes();
  Eigen::VectorXd along_m(modes.vectors.rows());
  for (Eigen::Index i = 0; i < along_m.size(); ++i) {
    along_m[i] = mesh.chargeCenters_m()[static_cast<std::size_t>(i)].x();
  }
  const auto share = [&](double rate) { return chi_t_m * rate / (1.0 + chi_t_m * rate); };
  return along_m.dot(modes.answer(share) * along_m);
}

}  // namespace

class SheetMeshTest : public QObject {
  Q_OBJECT
 private slots:
  void squareKeepsTheFieldOut_data();
  void squareKeepsTheFieldOut();
  void stripIsExact();
  void resistanceLimitIsTheTorsionOfASquare();
  void permeableSquareIsTheDualAperture();
  void thinIronIsMagnetisedEvenly();
  void answersGrowWithTheirSize();
};

void SheetMeshTest::squareKeepsTheFieldOut_data() {
  QTest::addColumn<int>("cells");
  QTest::addColumn<double>("tolerance");
  QTest::newRow("36 cells") << 36 << 0.025;
  QTest::newRow("64 cells") << 64 << 0.015;
  QTest::newRow("256 cells") << 256 << 0.005;
}

// By Babinet's principle four times the electric polarizability of a square aperture, 0.1137 side^3 (De Meulenaere and
// Van Bladel 1977, IEEE Trans. AP-25 198); a disc has (8/3) a^3 = 4 (2/3) a^3 in the same way.
void SheetMeshTest::squareKeepsTheFieldOut() {
  QFETCH(int, cells);
  QFETCH(double, tolerance);
  const double moment_m3 = normalMoment_m3(SheetMesh(1.0, 1.0, cells), everything);
  FT_VERIFY_MATCH(near(moment_m3 / -(4.0 * 0.1137), 1.0, tolerance));
}

// A strip in a field across it has psi = 2 sqrt(a^2 - x^2), so the moment per length is pi a^2; the ends of one 20
// times as long as wide, where psi falls off over half a width, take 1/40 or so away.
void SheetMeshTest::stripIsExact() {
  const double half_width_m = 0.05;
  const double moment_m3 = normalMoment_m3(SheetMesh(2.0, 2.0 * half_width_m, 400), everything);
  FT_VERIFY_MATCH(near(moment_m3 / (-std::numbers::pi * half_width_m * half_width_m * 2.0), 0.975, 0.02));
}

// Limited by resistance psi solves Poisson's equation: its integral is a quarter of the torsion constant of a square,
// 0.1406 side^4 (Timoshenko and Goodier 1951, section 94).
void SheetMeshTest::resistanceLimitIsTheTorsionOfASquare() {
  const double moment_m4 = normalMoment_m3(SheetMesh(1.0, 1.0, 256), [](double rate) { return 1.0 / rate; });
  FT_VERIFY_MATCH(near(-moment_m4 / (0.1406 / 4.0), 1.0, 0.02));
}

// Four times the magnetic polarizability of a square aperture, 0.2598 side^3 (De Meulenaere and Van Bladel 1977).
void SheetMeshTest::permeableSquareIsTheDualAperture() {
  FT_VERIFY_MATCH(near(tangentialMoment_m3(SheetMesh(1.0, 1.0), 1e9) / (4.0 * 0.2598), 1.0, 0.01));
}

// Too thin to shield itself: M = (mu_r - 1) H everywhere, moment (mu_r - 1) thickness area.
void SheetMeshTest::thinIronIsMagnetisedEvenly() {
  FT_VERIFY_MATCH(near(tangentialMoment_m3(SheetMesh(1.0, 1.0), 1e-5) / 1e-5, 1.0, 1e-3));
  FT_VERIFY_MATCH(near(tangentialMoment_m3(SheetMesh(1.2, 0.5), 1e-5) / (1e-5 * 0.6), 1.0, 1e-3));
}

void SheetMeshTest::answersGrowWithTheirSize() {
  const double small_m3 = normalMoment_m3(SheetMesh(0.4, 0.3), everything);
  FT_VERIFY_MATCH(near(normalMoment_m3(SheetMesh(0.8, 0.6), everything) / small_m3, 8.0, 1e-9));
  const double thin_m3 = tangentialMoment_m3(SheetMesh(0.4, 0.3), 0.02);
  FT_VERIFY_MATCH(near(tangentialMoment_m3(SheetMesh(0.8, 0.6), 0.04) / thin_m3, 8.0, 1e-9));
}

FIELDTRUE_TEST(SheetMeshTest)
#include "sheet_mesh_test.moc"
