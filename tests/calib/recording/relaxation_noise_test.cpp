#include "calib/recording/relaxation_noise.h"

#include <QTest>
#include <cmath>
#include <numbers>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

constexpr Eigen::Index kReadings = 41;
constexpr int kLeft = 40;  ///< By prewhitening.

Eigen::MatrixXd powersAtHarmonics(double correlation) {
  std::vector<double> frequencies;
  for (int k = 1; k <= kLeft / 2; ++k) frequencies.push_back(static_cast<double>(k) / kLeft);
  return relaxationPowers(Eigen::VectorXd::LinSpaced(kReadings, 0.0, kReadings - 1.0), correlation, frequencies);
}

}  // namespace

class RelaxationNoiseTest : public QObject {
  Q_OBJECT
 private slots:
  void whatPrewhiteningMakesWhiteShowsWhite_data() {
    QTest::addColumn<int>("column");
    QTest::addColumn<double>("correlation");
    const auto columns = static_cast<int>(powersAtHarmonics(0.0).cols());
    QTest::newRow("white") << 0 << 0.0;
    QTest::newRow("memory of half a reading") << 1 << std::exp(-2.0);
    QTest::newRow("memory of 8 readings") << 5 << std::exp(-1.0 / 8.0);
    QTest::newRow("walk") << columns - 2 << 1.0;
    QTest::newRow("shying away") << columns - 1 << -0.4;
  }
  /// A line through m white values takes 3 / ((m^2 - 1) sin^2(pi k/m)) of the power at their k-th harmonic: the mean
  /// nothing, the slope |sum t exp(-i 2 pi k t/m)|^2 = m^2 / (4 sin^2(pi k/m)) over m sum t^2 = m^2 (m^2 - 1) / 12.
  void whatPrewhiteningMakesWhiteShowsWhite() {
    QFETCH(int, column);
    QFETCH(double, correlation);
    const Eigen::VectorXd power = powersAtHarmonics(correlation).col(column);
    FT_VERIFY_MATCH(near(power.mean(), 1.0, 1e-12));
    const auto expected = [](int k) {
      const double sine = std::sin(std::numbers::pi * k / kLeft);
      return 1.0 - 3.0 / ((kLeft * kLeft - 1.0) * sine * sine);
    };
    for (int k = 1; k < kLeft / 2; ++k)
      FT_VERIFY_MATCH(near(power[k - 1] / power[kLeft / 2 - 1], expected(k) / expected(kLeft / 2), 1e-9));
  }

  /// Fractional noise of d = 0.4, which falls by the 0.8th power of the frequency, is none of the shapes but a sum of
  /// them. Its covariances follow g_k = g_(k-1) (k - 1 + d) / (k - d) (Hosking 1981, theorem 1).
  void aPowerLawIsASum() {
    constexpr double kD = 0.4;
    constexpr Eigen::Index n = 128;
    std::vector<double> g = {1.0};
    for (int k = 1; k < n; ++k) g.push_back(g.back() * (k - 1.0 + kD) / (k - kD));
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) covariance(i, j) = g[static_cast<std::size_t>(std::abs(i - j))];
    std::vector<double> frequencies;
    for (int k = 1; k <= 40; ++k) frequencies.push_back(k / 254.0);
    const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(n, 0.0, n - 1.0);
    const Eigen::VectorXd left = times.tail(n - 1);
    const Eigen::MatrixXd half = detrended(left, covariance.bottomRightCorner(n - 1, n - 1));
    const Eigen::MatrixXd shown = detrended(left, half.transpose());
    Eigen::VectorXd power(40);
    for (Eigen::Index k = 0; k < 40; ++k) {
      const Eigen::ArrayXd angles_rad = 2.0 * std::numbers::pi * frequencies[static_cast<std::size_t>(k)] * left;
      const Eigen::VectorXd cosine = angles_rad.cos();
      const Eigen::VectorXd sine = angles_rad.sin();
      power[k] = (cosine.dot(shown * cosine) + sine.dot(shown * sine)) / (n - 1.0);
    }
    const Eigen::MatrixXd shapes = relaxationPowers(times, 0.0, frequencies);
    const Eigen::VectorXd weights = likeliestSum(shapes, power);
    QVERIFY(weights.minCoeff() >= 0.0);
    const Eigen::VectorXd fitted = shapes * weights;
    for (Eigen::Index k = 0; k < 40; ++k) FT_VERIFY_MATCH(near(fitted[k] / power[k], 1.0, 0.01));
  }

  /// Of two shapes that overlap nowhere each has the mean of what it covers; what none can meet turns none negative.
  void sumsAreLikeliestAndNotNegative() {
    Eigen::MatrixXd apart(4, 2);
    apart << 1.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 2.0;
    const Eigen::VectorXd two = likeliestSum(apart, Eigen::Vector4d(1.0, 3.0, 4.0, 8.0));
    FT_VERIFY_MATCH(near(two[0], 2.0, 1e-9));
    FT_VERIFY_MATCH(near(two[1], 3.0, 1e-9));
    Eigen::MatrixXd falling(3, 2);
    falling << 1.0, 4.0, 1.0, 2.0, 1.0, 1.0;
    const Eigen::VectorXd flat = likeliestSum(falling, Eigen::Vector3d(1.0, 2.0, 4.0));
    QVERIFY(flat.minCoeff() >= 0.0);
    FT_VERIFY_MATCH(near(flat[1], 0.0, 1e-3));
  }
};

FIELDTRUE_TEST(RelaxationNoiseTest)
#include "relaxation_noise_test.moc"
