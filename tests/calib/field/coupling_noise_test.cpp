#include "calib/field/coupling_noise.h"

#include <QTest>
#include <vector>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::field;
using fieldtrue::testing::near;
using fieldtrue::testing::sameBits;

namespace {

constexpr std::uint32_t kPurpose = 7;
constexpr double kRate_hz = 100.0;

/// First coupling of successive readings.
std::vector<double> series(CouplingNoise& noise, int count, double period_s) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(noise.at(i * period_s)(0, 0));
  return values;
}

double correlationAtLag(const std::vector<double>& values, std::size_t lag) {
  double products = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    squares += values[i] * values[i];
    if (i >= lag) products += values[i] * values[i - lag];
  }
  return products / squares;
}

}  // namespace

class CouplingNoiseTest : public QObject {
  Q_OBJECT
 private slots:
  void drawsAStandardNormal();
  void keepsItsSdWhateverTheCorrelation();
  void decaysAsAFirstOrderProcess();
  void forgetsOverAPause();
  void repeatsWithItsSeedOnly();
};

// Moments of the normal distribution: 0, 1, 0, 3; their SDs at n draws are sqrt(1/n), sqrt(2/n), sqrt(15/n),
// sqrt(96/n).
void CouplingNoiseTest::drawsAStandardNormal() {
  GaussianStream stream(5, kPurpose);
  constexpr int kDraws = 200000;
  double moments[5] = {};
  for (int i = 0; i < kDraws; ++i) {
    const double x = stream.next();
    for (int power = 1; power < 5; ++power) moments[power] += std::pow(x, power) / kDraws;
  }
  const double unit = 4.0 / std::sqrt(static_cast<double>(kDraws));
  FT_VERIFY_MATCH(near(moments[1], 0.0, unit));
  FT_VERIFY_MATCH(near(moments[2], 1.0, unit * std::sqrt(2.0)));
  FT_VERIFY_MATCH(near(moments[3], 0.0, unit * std::sqrt(15.0)));
  FT_VERIFY_MATCH(near(moments[4], 3.0, unit * std::sqrt(96.0)));
}

void CouplingNoiseTest::keepsItsSdWhateverTheCorrelation() {
  for (const double rho : {0.0, 0.5, 0.9}) {
    CouplingNoise noise({0.02, rho, kRate_hz}, 1, kPurpose, 0);
    double squares = 0.0;
    double cross = 0.0;
    constexpr int kReadings = 40000;
    for (int i = 0; i < kReadings; ++i) {
      const Eigen::Matrix3d n = noise.at(i / kRate_hz);
      squares += n.squaredNorm() / (9.0 * kReadings);
      cross += n(0, 1) * n(2, 0) / kReadings;
    }
    FT_VERIFY_MATCH(near(std::sqrt(squares) / 0.02, 1.0, 0.02));
    FT_VERIFY_MATCH(near(cross / (0.02 * 0.02), 0.0, 0.07));
  }
}

// The autocorrelation of a first-order process is rho^lag.
void CouplingNoiseTest::decaysAsAFirstOrderProcess() {
  CouplingNoise noise({1.0, 0.7, kRate_hz}, 2, kPurpose, 0);
  const std::vector<double> values = series(noise, 100000, 1.0 / kRate_hz);
  for (std::size_t lag = 1; lag < 5; ++lag) {
    FT_VERIFY_MATCH(near(correlationAtLag(values, lag), std::pow(0.7, static_cast<double>(lag)), 0.02));
  }
}

// Read every third period, neighbours are rho^3 alike; with the clock standing still they are still one period apart.
void CouplingNoiseTest::forgetsOverAPause() {
  CouplingNoise slow({1.0, 0.8, kRate_hz}, 3, kPurpose, 0);
  FT_VERIFY_MATCH(near(correlationAtLag(series(slow, 100000, 3.0 / kRate_hz), 1), 0.512, 0.02));
  CouplingNoise still({1.0, 0.8, kRate_hz}, 3, kPurpose, 0);
  FT_VERIFY_MATCH(near(correlationAtLag(series(still, 100000, 0.0), 1), 0.8, 0.02));

  double products = 0.0;
  CouplingNoise interrupted({1.0, 0.99, kRate_hz}, 4, kPurpose, 0);
  constexpr int kPairs = 20000;
  for (int i = 0; i < kPairs; ++i) {
    const double before = interrupted.at(0.0)(1, 1);
    interrupted.forget();
    products += before * interrupted.at(0.0)(1, 1) / kPairs;
    interrupted.forget();
  }
  FT_VERIFY_MATCH(near(products, 0.0, 0.03));
}

void CouplingNoiseTest::repeatsWithItsSeedOnly() {
  const auto first = [](std::uint64_t seed, std::uint32_t sensor) {
    return CouplingNoise({1.0, 0.5, kRate_hz}, seed, kPurpose, sensor).at(0.0);
  };
  FT_VERIFY_MATCH(sameBits(first(1, 0)(2, 2), first(1, 0)(2, 2)));
  QVERIFY(first(1, 0) != first(2, 0));
  QVERIFY(first(1, 0) != first(1, 1));
  QVERIFY(first(1, 0) != first(1ULL << 32U, 0));
  QVERIFY(GaussianStream(1, 1).next() != GaussianStream(1, 2).next());
}

FIELDTRUE_TEST(CouplingNoiseTest)
#include "coupling_noise_test.moc"
