#include "calib/field/dipole_field.h"

#include <QTest>

#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using fieldtrue::field::couplings;
using fieldtrue::field::dipoleField;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

class CouplingTest : public QObject {
  Q_OBJECT
 private slots:
  void followsTheFormulaOnTheAxes();
  void isEvenSymmetricAndFreeOfSources();
  void turnsWithTheSensor();
};

// Worked by hand from C (3uu^T - I)/r^3: along the axis 2C/r^3, across it -C/r^3.
void CouplingTest::followsTheFormulaOnTheAxes() {
  const Eigen::Matrix3d on_x = dipoleField({2.0, 0.0, 0.0}, 4.0);
  const Eigen::Matrix3d expected_x = Eigen::Vector3d(1.0, -0.5, -0.5).asDiagonal();
  FT_VERIFY_MATCH(near((on_x - expected_x).norm(), 0.0, 1e-15));

  // u = (1, 1, 0)/sqrt(2), r^3 = sqrt(8): off-diagonal 1.5/sqrt(8).
  const Eigen::Matrix3d diagonal = dipoleField({1.0, 1.0, 0.0}, 1.0);
  FT_VERIFY_MATCH(near(diagonal(0, 1), 1.5 / std::sqrt(8.0), 1e-15));
  FT_VERIFY_MATCH(near(diagonal(0, 0), 0.5 / std::sqrt(8.0), 1e-15));
  FT_VERIFY_MATCH(near(diagonal(2, 2), -1.0 / std::sqrt(8.0), 1e-15));
}

// A dipole's field has no divergence, so each column's derivative sums to zero; the trace of G is that of 3uu^T - I: 0.
void CouplingTest::isEvenSymmetricAndFreeOfSources() {
  RandomGeometry random(1);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p_m = random.between(0.3, 3.0) * random.direction();
    const Eigen::Matrix3d G = dipoleField(p_m, 1.0);
    const double scale = G.norm();
    FT_VERIFY_MATCH(near((G - dipoleField(-p_m, 1.0)).norm() / scale, 0.0, 1e-14));
    FT_VERIFY_MATCH(near((G - G.transpose()).norm() / scale, 0.0, 1e-14));
    FT_VERIFY_MATCH(near(G.trace() / scale, 0.0, 1e-14));

    Eigen::Vector3d divergence = Eigen::Vector3d::Zero();
    const double h_m = 1e-4 * p_m.norm();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step_m = h_m * Eigen::Vector3d::Unit(axis);
      divergence += (dipoleField(p_m + step_m, 1.0) - dipoleField(p_m - step_m, 1.0)).row(axis).transpose() / (2 * h_m);
    }
    FT_VERIFY_MATCH(near(divergence.norm() * p_m.norm() / scale, 0.0, 1e-6));
  }
}

// A sensor turned by +90 degrees about Z has its x coil along the tracker's +Y: its first row is the field's y row.
void CouplingTest::turnsWithTheSensor() {
  const Eigen::Matrix3d field = RandomGeometry(2).matrix();
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitZ()));
  const Eigen::Matrix3d seen = couplings(field, turned);
  FT_VERIFY_MATCH(near((seen.row(0) - field.row(1)).norm(), 0.0, 1e-15));
  FT_VERIFY_MATCH(near((seen.row(1) + field.row(0)).norm(), 0.0, 1e-15));
  FT_VERIFY_MATCH(near((seen.row(2) - field.row(2)).norm(), 0.0, 1e-15));
}

FIELDTRUE_TEST(CouplingTest)
#include "dipole_field_test.moc"
