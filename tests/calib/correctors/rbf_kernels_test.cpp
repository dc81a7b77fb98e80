#include "calib/correctors/radial/rbf_kernels.h"

#include <QTest>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

constexpr double kShapeSquared = 0.49;

/// The kernels as their definitions read, by the standard library, of the squared distance.
std::function<double(double)> definitionOf(RadialKernel kernel) {
  switch (kernel) {
    case RadialKernel::kMultiquadric:
      return [](double q) { return -std::sqrt(q + kShapeSquared); };
    case RadialKernel::kInverseMultiquadric:
      return [](double q) { return 1.0 / std::sqrt(q + kShapeSquared); };
    case RadialKernel::kCubic:
      return [](double q) { return std::pow(std::sqrt(q), 3.0); };
    case RadialKernel::kThinPlate:
      return [](double q) { return q > 0.0 ? 0.5 * q * std::log(q) : 0.0; };
    case RadialKernel::kMatern32:
      return [](double q) { return (1.0 + std::sqrt(3.0 * q)) * std::exp(-std::sqrt(3.0 * q)); };
    case RadialKernel::kMatern52:
      return [](double q) { return (1.0 + std::sqrt(5.0 * q) + 5.0 * q / 3.0) * std::exp(-std::sqrt(5.0 * q)); };
  }
  return {};
}

/// Squared distances over many decades; their number is not a multiple of any register's width.
std::vector<double> squaredDistancesToTry() {
  std::vector<double> q = {0.0};
  for (double decade = -14.0; decade < 4.0; decade += 0.0137) q.push_back(std::pow(10.0, decade));
  return q;
}

}  // namespace

class RbfKernelsTest : public QObject {
  Q_OBJECT
 private:
  void addKernels() {
    QTest::addColumn<int>("kernel");
    for (const auto& [name, kernel] : {std::pair{"multiquadric", RadialKernel::kMultiquadric},
                                       {"inverse", RadialKernel::kInverseMultiquadric},
                                       {"cubic", RadialKernel::kCubic},
                                       {"thin plate", RadialKernel::kThinPlate},
                                       {"matern 3/2", RadialKernel::kMatern32},
                                       {"matern 5/2", RadialKernel::kMatern52}})
      QTest::newRow(name) << static_cast<int>(kernel);
  }

 private slots:
  void valuesAreTheDefinitions_data() { addKernels(); }
  void valuesAreTheDefinitions() {
    QFETCH(int, kernel);
    const auto definition = definitionOf(static_cast<RadialKernel>(kernel));
    const std::vector<double> q = squaredDistancesToTry();
    std::vector<double> seen(q.size());
    radialValues(static_cast<RadialKernel>(kernel), kShapeSquared, q.data(), q.size(), seen.data());
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double expected = definition(q[i]);
      // The exponential of -200 turns the rounding of its
      // argument into 200 of its own.
      const double relative = 4e-16 * (4.0 + std::sqrt(5.0 * q[i]));
      FT_VERIFY_MATCH(near(seen[i], expected, relative * std::abs(expected) + 1e-300));
    }
  }

  void inPlaceIsTheSame_data() { addKernels(); }
  void inPlaceIsTheSame() {
    QFETCH(int, kernel);
    std::vector<double> q = squaredDistancesToTry();
    std::vector<double> apart(q.size());
    radialValues(static_cast<RadialKernel>(kernel), kShapeSquared, q.data(), q.size(), apart.data());
    radialValues(static_cast<RadialKernel>(kernel), kShapeSquared, q.data(), q.size(), q.data());
    for (std::size_t i = 0; i < q.size(); ++i) FT_VERIFY_MATCH(sameBits(q[i], apart[i]));
  }

  void slopesAreTwiceTheDerivative_data() { addKernels(); }
  void slopesAreTwiceTheDerivative() {
    QFETCH(int, kernel);
    const auto definition = definitionOf(static_cast<RadialKernel>(kernel));
    for (double q = 0.01; q < 20.0; q *= 1.3) {
      const double step = 1e-5 * q;
      const double expected = (definition(q + step) - definition(q - step)) / step;
      double seen = 0.0;
      radialSlopes(static_cast<RadialKernel>(kernel), kShapeSquared, &q, 1, &seen);
      FT_VERIFY_MATCH(near(seen, expected, 1e-7 * (1.0 + std::abs(expected))));
    }
  }

  void slopesAtACentreAreFinite_data() { addKernels(); }
  void slopesAtACentreAreFinite() {
    QFETCH(int, kernel);
    const double q = 0.0;
    double seen = NAN;
    radialSlopes(static_cast<RadialKernel>(kernel), kShapeSquared, &q, 1, &seen);
    QVERIFY(std::isfinite(seen));
  }

  void farAwayTheMaternKernelsVanish() {
    for (const double q : {1e6, 1e12, 1e20}) {
      double seen = NAN;
      radialValues(RadialKernel::kMatern52, 0.0, &q, 1, &seen);
      QVERIFY(seen >= 0.0 && seen < 1e-250);
    }
  }

  void distances() {
    const std::vector<double> x = {1.0, -2.0, 0.5}, y = {0.0, 3.0, 0.5}, z = {2.0, 1.0, 0.5};
    const std::array<double, 3> u = {0.5, 1.0, -1.0};
    std::array<double, 3> q{};
    squaredDistances({x.data(), y.data(), z.data(), 3}, u.data(), q.data());
    FT_VERIFY_MATCH(near(q[0], 0.25 + 1.0 + 9.0, 1e-15));
    FT_VERIFY_MATCH(near(q[1], 6.25 + 4.0 + 4.0, 1e-15));
    FT_VERIFY_MATCH(near(q[2], 0.0 + 0.25 + 2.25, 1e-15));
  }
};

FIELDTRUE_TEST(RbfKernelsTest)
#include "rbf_kernels_test.moc"
