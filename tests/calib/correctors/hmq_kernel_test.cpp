#include "calib/correctors/hmq_kernel.h"

#include <QTest>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/matchers.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

/// Centres and coefficients of a multiquadric, drawn with a seed.
struct Drawn {
  std::vector<double> x, y, z, ax, ay, az;
  MultiquadricArrays arrays(double r2_m2) const { return {x.data(), y.data(), z.data(), x.size(), r2_m2}; }
};

Drawn draw(std::size_t count) {
  std::mt19937_64 generator(count + 1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Drawn drawn;
  for (std::vector<double>* values : {&drawn.x, &drawn.y, &drawn.z, &drawn.ax, &drawn.ay, &drawn.az}) {
    values->resize(count);
    for (double& value : *values) value = uniform(generator);
  }
  return drawn;
}

long double weight(const Drawn& drawn, std::size_t j, const double* p_m, double r2_m2) {
  const long double dx = p_m[0] - static_cast<long double>(drawn.x[j]);
  const long double dy = p_m[1] - static_cast<long double>(drawn.y[j]);
  const long double dz = p_m[2] - static_cast<long double>(drawn.z[j]);
  return std::sqrt(dx * dx + dy * dy + dz * dz + static_cast<long double>(r2_m2));
}

}  // namespace

/// Against the equations in extended precision, at every length around the width of the registers.
class HmqKernelTest : public QObject {
  Q_OBJECT
 private slots:
  void sumsAreThoseOfTheEquations_data() {
    QTest::addColumn<double>("distance_m");
    QTest::addColumn<double>("r2_m2");
    QTest::newRow("among the centres") << 0.3 << 0.01;
    QTest::newRow("a kilometre away") << 1e3 << 0.01;
    QTest::newRow("a thousand kilometres away") << 1e6 << 0.1;
    QTest::newRow("sharp") << 0.3 << 1e-12;
  }
  void sumsAreThoseOfTheEquations() {
    QFETCH(double, distance_m);
    QFETCH(double, r2_m2);
    const double points_m[] = {distance_m, -0.2, 0.1, 0.05, distance_m, -0.4};
    for (std::size_t count = 1; count <= 70; ++count) {
      const Drawn drawn = draw(count);
      double f[6];
      multiquadricSums(drawn.arrays(r2_m2), drawn.ax.data(), drawn.ay.data(), drawn.az.data(), points_m, 2, f);
      for (int point = 0; point < 2; ++point) {
        long double expected[3] = {0, 0, 0};
        long double magnitude = 0;
        for (std::size_t j = 0; j < count; ++j) {
          const long double w = weight(drawn, j, points_m + 3 * point, r2_m2);
          magnitude += w;
          expected[0] += drawn.ax[j] * w;
          expected[1] += drawn.ay[j] * w;
          expected[2] += drawn.az[j] * w;
        }
        // A few units in the last place of each term, in whatever order they are summed.
        for (int axis = 0; axis < 3; ++axis)
          FT_VERIFY_MATCH(
              near(f[3 * point + axis], static_cast<double>(expected[axis]), 8e-16 * static_cast<double>(magnitude)));
      }
    }
  }

  void weightsAndProductsAreThoseOfTheEquations() {
    const double p_m[] = {0.4, -0.1, 0.7};
    for (std::size_t count = 1; count <= 40; ++count) {
      const Drawn drawn = draw(count);
      std::vector<double> w_m(count);
      multiquadricWeights(drawn.arrays(0.01), p_m, w_m.data());
      long double product = 0;
      for (std::size_t j = 0; j < count; ++j) {
        const auto expected_m = static_cast<double>(weight(drawn, j, p_m, 0.01));
        FT_VERIFY_MATCH(near(w_m[j], expected_m, 4e-16 * expected_m));
        product += static_cast<long double>(w_m[j]) * drawn.ax[j];
      }
      FT_VERIFY_MATCH(near(dotProduct(drawn.ax.data(), w_m.data(), count), static_cast<double>(product),
                           4e-16 * static_cast<double>(count)));
    }
  }
};

QTEST_GUILESS_MAIN(HmqKernelTest)
#include "hmq_kernel_test.moc"
