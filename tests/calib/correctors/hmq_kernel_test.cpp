#include "calib/correctors/multiquadric/hmq_kernel.h"

#include <QTest>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "calib/correctors/multiquadric/hmq_field.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// Centres and coefficients of a multiquadric, drawn with a seed.
struct Drawn {
  std::vector<double> x, y, z, ax, ay, az;
  MultiquadricArrays arrays(double r2_m2) const { return {x.data(), y.data(), z.data(), x.size(), r2_m2}; }
  std::array<const double*, 3> alpha() const { return {ax.data(), ay.data(), az.data()}; }
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

struct Expected {
  double f[3];
  double magnitude;  ///< Sum of the weights; drawn coefficients are at most 1.
};

Expected expectedSums(const Drawn& drawn, const double* p_m, double r2_m2) {
  long double f[3] = {0, 0, 0};
  long double magnitude = 0;
  for (std::size_t j = 0; j < drawn.x.size(); ++j) {
    const long double w = weight(drawn, j, p_m, r2_m2);
    magnitude += w;
    f[0] += drawn.ax[j] * w;
    f[1] += drawn.ay[j] * w;
    f[2] += drawn.az[j] * w;
  }
  return {{static_cast<double>(f[0]), static_cast<double>(f[1]), static_cast<double>(f[2])},
          static_cast<double>(magnitude)};
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
    QTest::newRow("beyond single precision") << 1e25 << 0.1;
    QTest::newRow("sharp") << 0.3 << 1e-12;
    QTest::newRow("sharper than single precision") << 0.3 << 1e-50;
  }
  void sumsAreThoseOfTheEquations() {
    QFETCH(double, distance_m);
    QFETCH(double, r2_m2);
    const double p_m[] = {0.05, distance_m, -0.4};
    for (std::size_t count = 1; count <= 140; ++count) {
      const Drawn drawn = draw(count);
      double f[3];
      multiquadricSums(drawn.arrays(r2_m2), drawn.alpha().data(), p_m, f);
      const Expected expected = expectedSums(drawn, p_m, r2_m2);
      // A few units in the last place of each term, in whatever order they are summed.
      for (int axis = 0; axis < 3; ++axis) FT_VERIFY_MATCH(near(f[axis], expected.f[axis], 8e-16 * expected.magnitude));
    }
  }

  /// Else a calibration would correct a pose differently each time that it is loaded.
  void sumsAreTheSameBitsWhereverTheyLieInMemory() {
    const double p_m[] = {0.4, -0.1, 0.7};
    const Drawn drawn = draw(567);
    double expected[3];
    multiquadricSums(drawn.arrays(0.01), drawn.alpha().data(), p_m, expected);
    const double product = dotProduct(drawn.ax.data(), drawn.x.data(), drawn.x.size());
    for (std::size_t shift = 1; shift < 9; ++shift) {
      Drawn moved = drawn;
      for (std::vector<double>* values : {&moved.x, &moved.y, &moved.z, &moved.ax, &moved.ay, &moved.az})
        values->insert(values->begin(), shift, 0.0);
      const MultiquadricArrays arrays{moved.x.data() + shift, moved.y.data() + shift, moved.z.data() + shift, 567,
                                      0.01};
      const double* const alpha[] = {moved.ax.data() + shift, moved.ay.data() + shift, moved.az.data() + shift};
      double f[3];
      multiquadricSums(arrays, alpha, p_m, f);
      for (int axis = 0; axis < 3; ++axis) FT_VERIFY_MATCH(sameBits(f[axis], expected[axis]));
      FT_VERIFY_MATCH(sameBits(dotProduct(alpha[0], arrays.x_m, arrays.count), product));
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

  /// Coefficients as a fit gives them: of a grid of 1000 places bent as a room bends it, at both ends of R squared.
  void staysBelowANanometreOnFittedCoefficients_data() {
    QTest::addColumn<double>("r2_cm2");
    QTest::newRow("lowest") << 10.0;
    QTest::newRow("default") << 100.0;
    QTest::newRow("highest") << 1000.0;
  }
  void staysBelowANanometreOnFittedCoefficients() {
    QFETCH(double, r2_cm2);
    const FitData data = fitDataOf(shakenGrid({10, 10, 10}, 0.15, 0.005), [](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(0.05 * Eigen::Vector3d(std::sin(2.0 * p.y()), std::cos(1.5 * p.z()), p.x() * p.y()));
    });
    const Places places = mergePlaces(data);
    const auto field = MultiquadricField::fit("Multiquadric", places, truthMatrix(places), 1e-4 * r2_cm2, {});
    FT_VERIFY_OK(field);
    const auto column = [](const auto& matrix, Eigen::Index k) {
      return std::vector<double>(matrix.col(k).begin(), matrix.col(k).end());
    };
    const Drawn fitted{column(field->centers_m(), 0), column(field->centers_m(), 1), column(field->centers_m(), 2),
                       column(field->alpha(), 0),     column(field->alpha(), 1),     column(field->alpha(), 2)};
    for (const Eigen::Vector3d& p_m : randomPoints(60)) {
      const Expected expected = expectedSums(fitted, p_m.data(), 1e-4 * r2_cm2);
      const Eigen::Vector3d f = field->value3(p_m);
      for (int axis = 0; axis < 3; ++axis) FT_VERIFY_MATCH(near(f[axis], expected.f[axis], 1e-9));
    }
  }
};

FIELDTRUE_TEST(HmqKernelTest)
#include "hmq_kernel_test.moc"
