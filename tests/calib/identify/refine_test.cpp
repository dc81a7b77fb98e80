#include "calib/identify/refine.h"

#include <QTest>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

/// Draws of a Student t of three dimensions: a normal vector over the root of chi-square per degree of freedom.
std::vector<Vector6d> drawn(std::size_t count, double nu, double position_scale, double rotation_scale) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  std::chi_squared_distribution<double> chi_squared(nu);
  std::vector<Vector6d> rows(count);
  for (Vector6d& row : rows) {
    const double position = position_scale / std::sqrt(chi_squared(generator) / nu);
    const double rotation = rotation_scale / std::sqrt(chi_squared(generator) / nu);
    for (int k = 0; k < 6; ++k) row[k] = (k < 3 ? position : rotation) * normal(generator);
  }
  return rows;
}

/// -2 log of the density of a Student t of three dimensions (Kotz and Nadarajah 2004, eq. 1.1), summed over rows.
double minusTwiceLogDensity(std::span<const Vector6d> rows, Eigen::Index first, double nu, double scale) {
  double sum = 0.0;
  for (const Vector6d& row : rows) {
    const double d2 = row.segment<3>(first).squaredNorm() / (scale * scale);
    sum += std::lgamma(0.5 * (nu + 3.0)) - std::lgamma(0.5 * nu) - 1.5 * std::log(nu * std::numbers::pi) -
           3.0 * std::log(scale) - 0.5 * (nu + 3.0) * std::log1p(d2 / nu);
  }
  return -2.0 * sum;
}

/// Its least value over the scale, by halving a bracket of its logarithm.
double leastOverScale(std::span<const Vector6d> rows, Eigen::Index first, double nu) {
  double low = std::log(1e-3);
  double high = std::log(1e3);
  for (int step = 0; step < 200; ++step) {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    if (minusTwiceLogDensity(rows, first, nu, std::exp(a)) < minusTwiceLogDensity(rows, first, nu, std::exp(b)))
      high = b;
    else
      low = a;
  }
  return minusTwiceLogDensity(rows, first, nu, std::exp(low));
}

}  // namespace

class RefineTest : public QObject {
  Q_OBJECT
 private slots:
  void devianceIsThatOfTheDensity_data() {
    QTest::addColumn<double>("nu");
    QTest::newRow("heavy tails") << 3.0;
    QTest::newRow("light tails") << 8.0;
    QTest::newRow("nearly normal") << 100.0;
  }
  void devianceIsThatOfTheDensity() {
    QFETCH(double, nu);
    const std::vector<Vector6d> rows = drawn(300, nu, 1.7, 0.6);
    const Deviance seen = devianceOf(rows, true, {nu});
    // The power of pi is left out: the same for every model of the same rows.
    const double of_pi = 2.0 * 1.5 * std::log(std::numbers::pi) * static_cast<double>(rows.size());
    FT_VERIFY_MATCH(near(seen.value, leastOverScale(rows, 0, nu) + leastOverScale(rows, 3, nu) - 2.0 * of_pi, 1e-3));
    const Deviance positions = devianceOf(rows, false, {nu});
    FT_VERIFY_MATCH(near(positions.value, leastOverScale(rows, 0, nu) - of_pi, 1e-3));
    // 300 rows tell a scale to 4 %.
    FT_VERIFY_MATCH(near(seen.scale.position, 1.7, 0.2));
    FT_VERIFY_MATCH(near(seen.scale.rotation, 0.6, 0.07));
  }
};

FIELDTRUE_TEST(RefineTest)
#include "refine_test.moc"
