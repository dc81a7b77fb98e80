#include "calib/correctors/multiquadric/hmq_kernel.h"

#include <QTest>
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
    QTest::addColumn<int>("kernel");
    QTest::addColumn<bool>("by_roots");
    QTest::addColumn<double>("distance_m");
    QTest::addColumn<double>("r2_m2");
    const auto kernels = multiquadricKernels();
    for (std::size_t k = 0; k < kernels.size(); ++k) {
      for (const bool by_roots : {false, true}) {
        const auto row = [&](const char* name, double distance_m, double r2_m2) {
          QTest::addRow("%s%s, %s", kernels[k].name, by_roots ? " by roots" : "", name)
              << static_cast<int>(k) << by_roots << distance_m << r2_m2;
        };
        row("among the centres", 0.3, 0.01);
        row("a kilometre away", 1e3, 0.01);
        row("a thousand kilometres away", 1e6, 0.1);
        row("beyond single precision", 1e25, 0.1);
        row("sharp", 0.3, 1e-12);
        row("sharper than single precision", 0.3, 1e-50);
      }
    }
  }
  void sumsAreThoseOfTheEquations() {
    QFETCH(int, kernel);
    QFETCH(bool, by_roots);
    QFETCH(double, distance_m);
    QFETCH(double, r2_m2);
    const MultiquadricKernel& tried = multiquadricKernels()[static_cast<std::size_t>(kernel)];
    const auto sums = by_roots ? tried.sums_by_roots : tried.sums;
    const double points_m[] = {distance_m, -0.2, 0.1, 0.05, distance_m, -0.4};
    for (std::size_t count = 1; count <= 140; ++count) {
      const Drawn drawn = draw(count);
      double f[6];
      sums(drawn.arrays(r2_m2), drawn.ax.data(), drawn.ay.data(), drawn.az.data(), points_m, 2, f);
      for (int point = 0; point < 2; ++point) {
        const Expected expected = expectedSums(drawn, points_m + 3 * point, r2_m2);
        // A few units in the last place of each term, in whatever order they are summed.
        for (int axis = 0; axis < 3; ++axis)
          FT_VERIFY_MATCH(near(f[3 * point + axis], expected.f[axis], 8e-16 * expected.magnitude));
      }
    }
  }

  void theSumsInUseAreThoseOfTheFastestKernel() {
    const Drawn drawn = draw(77);
    const double p_m[] = {0.3, -0.2, 0.1};
    double used[3];
    double fastest[3];
    multiquadricSums(drawn.arrays(0.01), drawn.ax.data(), drawn.ay.data(), drawn.az.data(), p_m, 1, used);
    multiquadricKernels().front().sums(drawn.arrays(0.01), drawn.ax.data(), drawn.ay.data(), drawn.az.data(), p_m, 1,
                                       fastest);
    for (int axis = 0; axis < 3; ++axis) FT_VERIFY_MATCH(sameBits(used[axis], fastest[axis]));
    QCOMPARE(multiquadricKernels().back().name, "plain");
  }

  void singlePrecisionIsWithinItsRounding_data() {
    QTest::addColumn<int>("kernel");
    for (std::size_t k = 0; k < multiquadricKernels().size(); ++k)
      QTest::newRow(multiquadricKernels()[k].name) << static_cast<int>(k);
  }
  void singlePrecisionIsWithinItsRounding() {
    QFETCH(int, kernel);
    const MultiquadricKernel& tried = multiquadricKernels()[static_cast<std::size_t>(kernel)];
    const double p_m[] = {0.25, -0.5, 0.125};
    const float p_single_m[] = {0.25F, -0.5F, 0.125F};
    for (std::size_t count = 1; count <= 80; ++count) {
      const Drawn drawn = draw(count);
      std::vector<float> single[6];
      const std::vector<double>* const doubles[] = {&drawn.x, &drawn.y, &drawn.z, &drawn.ax, &drawn.ay, &drawn.az};
      for (int k = 0; k < 6; ++k)
        for (const double value : *doubles[k]) single[k].push_back(static_cast<float>(value));
      const MultiquadricArraysSingle terms{single[0].data(),
                                           single[1].data(),
                                           single[2].data(),
                                           single[3].data(),
                                           single[4].data(),
                                           single[5].data(),
                                           count,
                                           0.01F};
      float f[3];
      tried.sums_single(terms, p_single_m, 1, f);
      const Expected expected = expectedSums(drawn, p_m, 0.01);
      // Half a unit in the last place (6e-8) of each coordinate, coefficient, root and product, and of each sum.
      for (int axis = 0; axis < 3; ++axis)
        FT_VERIFY_MATCH(near(static_cast<double>(f[axis]), expected.f[axis],
                             6e-8 * (4.0 + static_cast<double>(count) / 4.0) * expected.magnitude));
    }
  }

  void weightsAndProductsAreThoseOfTheEquations_data() { singlePrecisionIsWithinItsRounding_data(); }
  void weightsAndProductsAreThoseOfTheEquations() {
    QFETCH(int, kernel);
    const MultiquadricKernel& tried = multiquadricKernels()[static_cast<std::size_t>(kernel)];
    const double p_m[] = {0.4, -0.1, 0.7};
    for (std::size_t count = 1; count <= 40; ++count) {
      const Drawn drawn = draw(count);
      std::vector<double> w_m(count);
      tried.weights(drawn.arrays(0.01), p_m, w_m.data());
      long double product = 0;
      for (std::size_t j = 0; j < count; ++j) {
        const auto expected_m = static_cast<double>(weight(drawn, j, p_m, 0.01));
        FT_VERIFY_MATCH(near(w_m[j], expected_m, 4e-16 * expected_m));
        product += static_cast<long double>(w_m[j]) * drawn.ax[j];
      }
      FT_VERIFY_MATCH(near(tried.dot(drawn.ax.data(), w_m.data(), count), static_cast<double>(product),
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
    Eigen::MatrixXd truth(static_cast<Eigen::Index>(data.size()), 3);
    for (std::size_t i = 0; i < data.size(); ++i)
      truth.row(static_cast<Eigen::Index>(i)) = data.p_true_m[i].transpose();
    const auto field =
        MultiquadricField::fit("Multiquadric", data.p_tracked_m, data.node, data.index, truth, 1e-4 * r2_cm2, {});
    FT_VERIFY_OK(field);
    Drawn fitted;
    for (std::size_t j = 0; j < field->size(); ++j) {
      fitted.x.push_back(field->center_m(j).x());
      fitted.y.push_back(field->center_m(j).y());
      fitted.z.push_back(field->center_m(j).z());
      fitted.ax.push_back(field->alpha(0)[j]);
      fitted.ay.push_back(field->alpha(1)[j]);
      fitted.az.push_back(field->alpha(2)[j]);
    }
    for (const MultiquadricKernel& kernel : multiquadricKernels()) {
      for (const Eigen::Vector3d& p_m : randomPoints(60)) {
        double f[3];
        kernel.sums(fitted.arrays(1e-4 * r2_cm2), fitted.ax.data(), fitted.ay.data(), fitted.az.data(), p_m.data(), 1,
                    f);
        const Expected expected = expectedSums(fitted, p_m.data(), 1e-4 * r2_cm2);
        for (int axis = 0; axis < 3; ++axis) FT_VERIFY_MATCH(near(f[axis], expected.f[axis], 1e-9));
      }
    }
  }
};

FIELDTRUE_TEST(HmqKernelTest)
#include "hmq_kernel_test.moc"
