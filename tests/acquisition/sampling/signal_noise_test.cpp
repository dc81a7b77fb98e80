#include <QTest>
#include <cmath>
#include <numbers>
#include <random>

#include "acquisition/sampling/signal_report.h"
#include "tests/support/test_main.h"

/// What the page Signal says of noise that is slow, and of lines: expected is what theory says of a first-order
/// autoregression, and the frequency that was planted.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

namespace {

constexpr double kStand_s = 31.0;
constexpr double kHeard_s = 30.0;

/// Noise of a sensor that lies: first-order autoregressive on each axis, and white beside it.
struct PlantedNoise {
  double rate_hz = 20.0;
  double phi = 0.0;
  double sd_m = 1e-3;
  double white_sd_m = 0.0;
  double line_hz = 0.0;
  double line_m = 0.0;
};

SignalReport reportOf(const PlantedNoise& noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto three = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const double begin_rad = 2.0 * std::numbers::pi * std::uniform_real_distribution<double>()(random);
  Eigen::Vector3d slow = three();
  SignalWindow window;
  for (int i = 0; i < kStand_s * noise.rate_hz; ++i) {
    const double t_s = i / noise.rate_hz;
    const double wave = std::sin(2.0 * std::numbers::pi * noise.line_hz * t_s + begin_rad);
    const Eigen::Vector3d p_m = Eigen::Vector3d(0.4, 0.0, 0.3) + noise.sd_m * slow + noise.white_sd_m * three() +
                                noise.line_m * wave * Eigen::Vector3d(1.0, 0.5, -0.7);
    window.add({t_s, 0, {p_m, Eigen::Quaterniond::Identity()}, {}});
    slow = noise.phi * slow + std::sqrt(1.0 - noise.phi * noise.phi) * three();
  }
  return signalReport(window.sensors().at(0));
}

}  // namespace

class SignalNoiseTest : public QObject {
  Q_OBJECT
 private slots:
  void slowNoiseIsNoLine_data() {
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<double>("phi");
    QTest::addColumn<double>("white_sds");
    for (const double rate_hz : {20.0, 60.0})
      for (const double phi : {0.5, 0.9, 0.98})
        for (const double white_sds : {0.0, 0.3})
          QTest::addRow("%g Hz, %g, white noise of %g SD beside it", rate_hz, phi, white_sds)
              << rate_hz << phi << white_sds;
  }
  /// No false line in 200 bounds their rate below 1.5 % with 95 % confidence (rule of three); one in 1000 is allowed.
  void slowNoiseIsNoLine() {
    QFETCH(double, rate_hz);
    QFETCH(double, phi);
    QFETCH(double, white_sds);
    int false_lines = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      const SignalReport report = reportOf({rate_hz, phi, 1e-3, white_sds * 1e-3}, seed);
      QVERIFY(report.spectrum.has_value());
      false_lines += report.spectrum->lines.empty() ? 0 : 1;
    }
    QVERIFY2(false_lines <= 1, qPrintable(QStringLiteral("%1 false lines").arg(false_lines)));
  }

  void aLineIsNamedByItsFrequency_data() {
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<double>("line_hz");
    QTest::addColumn<double>("phi");
    for (const double phi : {0.0, 0.9})
      for (const double share : {0.16, 0.19, 0.32, 0.44, 0.48})
        for (const double rate_hz : {20.0, 120.0}) {
          const double line_hz = share * rate_hz + 0.017;
          QTest::addRow("%g of %g Hz, %g", line_hz, rate_hz, phi) << rate_hz << line_hz << phi;
        }
  }
  /// A sinusoid of amplitude A on noise of SD s, seen n times over T: 1 SD of its frequency is no less than
  /// sqrt(6/n) s / (pi T A) (Rife and Boorstyn 1974), some 0.001 Hz here; five of them, for slow noise is not white.
  void aLineIsNamedByItsFrequency() {
    QFETCH(double, rate_hz);
    QFETCH(double, line_hz);
    QFETCH(double, phi);
    const PlantedNoise noise{rate_hz, phi, 1e-3, 0.0, line_hz, 1e-3};
    const double least_hz = std::sqrt(6.0 / (kHeard_s * rate_hz)) / (std::numbers::pi * kHeard_s);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const SignalReport report = reportOf(noise, seed);
      QVERIFY(report.spectrum && report.spectrum->lines.size() == 1);
      const double off_hz = report.spectrum->lines.front().frequency_hz - line_hz;
      QVERIFY2(std::abs(off_hz) < 5.0 * least_hz, qPrintable(QStringLiteral("off by %1 Hz").arg(off_hz)));
    }
  }

  void readingsAreWorthWhatTheirNoiseSays_data() {
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<double>("phi");
    QTest::addColumn<double>("white_sds");
    for (const double phi : {0.0, 0.5, 0.9, 0.98})
      for (const double white_sds : {0.0, 1.0, 5.0})
        QTest::addRow("%g, white noise of %g SD beside it", phi, white_sds) << 120.0 << phi << white_sds;
    QTest::addRow("0.9, few readings") << 20.0 << 0.9 << 0.0;
  }
  /// The variance of the mean of n readings is s^2/n for white noise and s^2/n (1 + phi)/(1 - phi) for a first-order
  /// autoregression.
  void readingsAreWorthWhatTheirNoiseSays() {
    QFETCH(double, rate_hz);
    QFETCH(double, phi);
    QFETCH(double, white_sds);
    const double n = kHeard_s * rate_hz, white = white_sds * white_sds;
    const double expected = n * (1.0 + white) / ((1.0 + phi) / (1.0 - phi) + white);
    double mean = 0.0;
    constexpr int kSeeds = 40;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      mean += reportOf({rate_hz, phi, 1e-3, white_sds * 1e-3}, seed).worth / kSeeds;
    QVERIFY2(mean > 0.75 * expected && mean < 1.33 * expected,
             qPrintable(QStringLiteral("%1 for %2").arg(mean).arg(expected)));
  }
};

FIELDTRUE_TEST(SignalNoiseTest)
#include "signal_noise_test.moc"
