#include "calib/recording/sample_spectrum.h"

#include <QTest>
#include <cmath>
#include <numbers>

#include "calib/field/coupling_noise.h"
#include "calib/recording/line_sources.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

struct Recording {
  int stops = 100;
  int readings = 60;
  double rate_hz = 120.0;
  double sd_m = 0.001;
  double line_hz = 0.0;
  double line_sd = 0.0;      ///< Amplitude in SDs.
  double correlation = 0.0;  ///< First order.
  int box = 1;               ///< Readings averaged by the tracker's filter.
  double sway_hz = 0.0;      ///< About which a hand sways: a broad resonance beside as much white noise.
  double white_sds = 0.0;    ///< Beside the noise.
  double exponent = 0.0;     ///< Of noise whose power falls by it with frequency; 2 = a random walk.
  int every = 1;             ///< Only every so many readings are kept: some are lost when it is above 1.
  std::uint64_t seed = 1;
};

/// An autoregression of second order, its poles at the sway's frequency, of SD 1.4 or so.
void addSway(const Recording& recording, field::GaussianStream& stream, std::vector<Eigen::Vector3d>& raw) {
  constexpr double kRadius = 0.93;
  const double turn = 2.0 * std::numbers::pi * recording.sway_hz / recording.rate_hz;
  Eigen::Vector3d now = Eigen::Vector3d::Zero();
  Eigen::Vector3d before = now;
  for (int i = -200; i < static_cast<int>(raw.size()); ++i) {
    const Eigen::Vector3d next =
        2.0 * kRadius * std::cos(turn) * now - kRadius * kRadius * before + 0.05 * stream.nextVector();
    before = now;
    now = next;
    if (i >= 0) raw[static_cast<std::size_t>(i)] += now;
  }
}

/// Weights of white noise by age whose sum falls by an exponent of the frequency (Kasdin 1995, eq. 116).
std::vector<double> weightsByAge(double exponent, std::size_t oldest) {
  std::vector<double> weights = {1.0};
  for (std::size_t age = 1; age < oldest; ++age)
    weights.push_back(weights.back() * (static_cast<double>(age) - 1.0 + 0.5 * exponent) / static_cast<double>(age));
  return weights;
}

void addPowerLaw(double exponent, field::GaussianStream& stream, std::vector<Eigen::Vector3d>& raw) {
  constexpr std::size_t kOldest = 1000;
  const std::vector<double> weights = weightsByAge(exponent, kOldest);
  std::vector<Eigen::Vector3d> white;
  for (std::size_t i = 0; i < raw.size() + kOldest; ++i) white.push_back(stream.nextVector());
  for (std::size_t i = 0; i < raw.size(); ++i)
    for (std::size_t age = 0; age < kOldest; ++age) raw[i] += weights[age] * white[i + kOldest - age];
}

/// Position noise with what is asked for; phases of the line are random by stop, for the stops are far apart.
std::vector<SampleVisit> record(const Recording& recording) {
  field::GaussianStream stream(recording.seed, 77);
  std::vector<SampleVisit> visits;
  for (int stop = 0; stop < recording.stops; ++stop) {
    SampleVisit visit;
    visit.node = stop;
    const double phase = 100.0 * stream.next();
    std::vector<Eigen::Vector3d> raw;
    Eigen::Vector3d last = stream.nextVector();
    for (int i = 0; i < recording.readings + recording.box; ++i) {
      const double kept = recording.correlation;
      last = kept * last + std::sqrt(1.0 - kept * kept) * stream.nextVector();
      raw.push_back(last);
    }
    if (recording.sway_hz > 0.0) addSway(recording, stream, raw);
    if (recording.exponent > 0.0) addPowerLaw(recording.exponent, stream, raw);
    if (recording.white_sds > 0.0)
      for (Eigen::Vector3d& value : raw) value += recording.white_sds * stream.nextVector();
    std::vector<Eigen::Vector3d> values;
    for (int i = 0; i < recording.readings; ++i) {
      if (recording.every > 1 && i % recording.every == 1) continue;
      Eigen::Vector3d value = Eigen::Vector3d::Zero();
      for (std::size_t k = 0; k < static_cast<std::size_t>(recording.box); ++k)
        value += raw[static_cast<std::size_t>(i) + k] / std::sqrt(recording.box);
      const double t_s = 5.0 * stop + i / recording.rate_hz;
      value += recording.line_sd * std::sin(2.0 * std::numbers::pi * recording.line_hz * t_s + phase) *
               Eigen::Vector3d::Ones();
      visit.times_s.push_back(t_s);
      values.push_back(recording.sd_m * value);
    }
    visit.deviations = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(values.size()), 6);
    for (std::size_t i = 0; i < values.size(); ++i) {
      visit.deviations.row(static_cast<Eigen::Index>(i)).head<3>() = values[i].transpose();
    }
    visit.deviations.rowwise() -= visit.deviations.colwise().mean().eval();
    visits.push_back(std::move(visit));
  }
  return visits;
}

}  // namespace

class SampleSpectrumTest : public QObject {
  Q_OBJECT

 private slots:
  void aliasesFallWhereSamplingPutsThem_data() {
    QTest::addColumn<double>("source_hz");
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<double>("seen_hz");
    QTest::newRow("50 at 120") << 50.0 << 120.0 << 50.0;
    QTest::newRow("60 at 120") << 60.0 << 120.0 << 60.0;
    QTest::newRow("100 at 120") << 100.0 << 120.0 << 20.0;
    QTest::newRow("120 at 120") << 120.0 << 120.0 << 0.0;
    QTest::newRow("60 at 103.3") << 60.0 << 103.3 << 43.3;
    QTest::newRow("100 at 103.3") << 100.0 << 103.3 << 3.3;
    QTest::newRow("120 at 103.3") << 120.0 << 103.3 << 16.7;
    QTest::newRow("50 at 60") << 50.0 << 60.0 << 10.0;
    QTest::newRow("100 at 50") << 100.0 << 50.0 << 0.0;
  }

  void aliasesFallWhereSamplingPutsThem() {
    QFETCH(double, source_hz);
    QFETCH(double, rate_hz);
    QFETCH(double, seen_hz);
    FT_VERIFY_MATCH(near(aliasOf_hz(source_hz, rate_hz), seen_hz, 1e-9));
    const auto sources = lineSources(seen_hz, rate_hz, 0.01);
    QVERIFY(std::any_of(sources.begin(), sources.end(),
                        [&](const LineSource& source) { return source.frequency_hz == source_hz; }));
  }

  /// A hand that sways slowly makes a hump at the low end of the spectrum, and no line.
  void aSwayingHandIsNoLine() {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Recording recording{.stops = 8, .readings = 89, .rate_hz = 15.0, .seed = seed};
      recording.sway_hz = 0.3;
      const auto spectrum = sampleSpectrum(record(recording), {});
      QVERIFY(spectrum.has_value());
      QVERIFY2(spectrum->lines.empty(), std::to_string(seed).c_str());
    }
  }

  void monitorsAreTheirOwnRange() {
    const auto sources = lineSources(48.0, 120.0, 0.1);  // 72 Hz at 120 readings a second
    QCOMPARE(sources.size(), std::size_t(1));
    FT_VERIFY_MATCH(near(sources[0].frequency_hz, 72.0, 1e-9));
    QVERIFY(lineSources(7.0, 120.0, 0.1).empty());
  }

  void aLineOfThreeTenthsOfTheNoiseIsAlwaysFound_data() {
    QTest::addColumn<double>("line_hz");
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<double>("correlation");
    QTest::newRow("50 Hz") << 50.0 << 120.0 << 0.0;
    QTest::newRow("100 Hz") << 100.0 << 120.0 << 0.0;
    QTest::newRow("100 Hz in filtered noise") << 100.0 << 120.0 << 0.5;
    QTest::newRow("60 Hz at another rate") << 60.0 << 103.3 << 0.0;
    QTest::newRow("50 Hz at 60") << 50.0 << 60.0 << 0.3;
  }

  void aLineOfThreeTenthsOfTheNoiseIsAlwaysFound() {
    QFETCH(double, line_hz);
    QFETCH(double, rate_hz);
    QFETCH(double, correlation);
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      Recording recording;
      recording.line_hz = line_hz;
      recording.line_sd = 0.3;
      recording.rate_hz = rate_hz;
      recording.correlation = correlation;
      recording.seed = seed;
      const auto spectrum = sampleSpectrum(record(recording), {});
      QVERIFY(spectrum.has_value());
      QCOMPARE(spectrum->lines.size(), std::size_t(1));
      FT_VERIFY_MATCH(near(spectrum->lines[0].frequency_hz, aliasOf_hz(line_hz, rate_hz), 0.15 * rate_hz / 60.0));
      FT_VERIFY_MATCH(near(spectrum->lines[0].amplitude_sd, 0.3, 0.1));
    }
  }

  void noiseIsNoLine_data() {
    QTest::addColumn<double>("correlation");
    QTest::addColumn<int>("box");
    QTest::addColumn<int>("stops");
    QTest::addColumn<int>("every");
    QTest::newRow("white") << 0.0 << 1 << 100 << 1;
    QTest::newRow("white, few stops") << 0.0 << 1 << 6 << 1;
    QTest::newRow("white, lost readings") << 0.0 << 1 << 100 << 5;
    QTest::newRow("first order 0.3") << 0.3 << 1 << 100 << 1;
    QTest::newRow("first order 0.6") << 0.6 << 1 << 300 << 1;
    QTest::newRow("first order 0.9") << 0.9 << 1 << 300 << 1;
    QTest::newRow("mean of 2") << 0.0 << 2 << 100 << 1;
    QTest::newRow("mean of 4") << 0.0 << 4 << 100 << 1;
    QTest::newRow("mean of 3 of first order") << 0.5 << 3 << 200 << 1;
  }

  void noiseIsNoLine() {
    QFETCH(double, correlation);
    QFETCH(int, box);
    QFETCH(int, stops);
    QFETCH(int, every);
    int alarms = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Recording recording;
      recording.correlation = correlation;
      recording.box = box;
      recording.stops = stops;
      recording.every = every;
      recording.seed = seed;
      const auto spectrum = sampleSpectrum(record(recording), {});
      QVERIFY(spectrum.has_value());
      if (!spectrum->lines.empty()) ++alarms;
    }
    QCOMPARE(alarms, 0);
  }

  void slowNoiseIsNoLine_data() {
    QTest::addColumn<double>("correlation");
    QTest::addColumn<double>("exponent");
    QTest::addColumn<double>("white_sds");
    QTest::addColumn<int>("readings");
    for (const int readings : {60, 120, 240}) {
      QTest::addRow("first order 0.8 and white, %d", readings) << 0.8 << 0.0 << 0.5 << readings;
      QTest::addRow("first order 0.97 and white, %d", readings) << 0.97 << 0.0 << 1.0 << readings;
      QTest::addRow("f^-1, %d", readings) << 0.0 << 1.0 << 0.0 << readings;
      QTest::addRow("f^-1.5, %d", readings) << 0.0 << 1.5 << 0.0 << readings;
      QTest::addRow("random walk and white, %d", readings) << 0.0 << 2.0 << 3.0 << readings;
    }
  }
  /// Noise that no autoregression of low order makes: its low end rises over one fitted to it, and is no line.
  void slowNoiseIsNoLine() {
    QFETCH(double, correlation);
    QFETCH(double, exponent);
    QFETCH(double, white_sds);
    QFETCH(int, readings);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Recording recording{.stops = 24, .readings = readings, .correlation = correlation, .seed = seed};
      recording.exponent = exponent;
      recording.white_sds = white_sds;
      const auto spectrum = sampleSpectrum(record(recording), {});
      QVERIFY(spectrum.has_value());
      QVERIFY2(spectrum->lines.empty(), std::to_string(seed).c_str());
    }
  }

  void aLineInSlowNoiseIsFound_data() {
    QTest::addColumn<double>("line_hz");
    QTest::addColumn<int>("readings");
    for (const int readings : {60, 120})
      for (const double line_hz : {5.0, 15.0, 50.0, 58.0})
        QTest::addRow("%g Hz, %d", line_hz, readings) << line_hz << readings;
  }
  /// Of n readings an amplitude of the white noise's SD has n/4 times its power, 15 or 30; noise of correlation c
  /// beside it has (1 - c^2) / (1 + c^2 - 2 c cos(2 pi f)): 0.9 times at 5 Hz, less above.
  void aLineInSlowNoiseIsFound() {
    QFETCH(double, line_hz);
    QFETCH(int, readings);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Recording recording{.stops = 24, .readings = readings, .line_hz = line_hz, .line_sd = 1.0, .seed = seed};
      recording.correlation = 0.97;
      recording.white_sds = 1.0;
      const auto spectrum = sampleSpectrum(record(recording), {});
      QVERIFY(spectrum.has_value());
      QCOMPARE(spectrum->lines.size(), std::size_t(1));
      FT_VERIFY_MATCH(near(spectrum->lines[0].frequency_hz, line_hz, 60.0 / readings));
    }
  }

  void correlationIsMeasuredWithoutBias_data() {
    QTest::addColumn<double>("correlation");
    QTest::addColumn<double>("line_sd");
    QTest::newRow("white") << 0.0 << 0.0;
    QTest::newRow("weak") << 0.3 << 0.0;
    QTest::newRow("strong") << 0.7 << 0.0;
    QTest::newRow("white under a line") << 0.0 << 1.0;
    QTest::newRow("weak under a line") << 0.3 << 1.0;
  }

  void correlationIsMeasuredWithoutBias() {
    QFETCH(double, correlation);
    QFETCH(double, line_sd);
    Recording recording;
    recording.correlation = correlation;
    recording.line_hz = 100.0;
    recording.line_sd = line_sd;
    recording.stops = 300;
    const auto spectrum = sampleSpectrum(record(recording), {});
    FT_VERIFY_MATCH(near(spectrum->correlation, correlation, 0.03));
    QVERIFY(spectrum->correlation_sd < 0.01);
  }

  void theStatedRateIsTakenWhereTimesAreCoarse() {
    Recording recording;
    recording.line_hz = 100.0;
    recording.line_sd = 0.5;
    std::vector<SampleVisit> visits = record(recording);
    for (SampleVisit& visit : visits) {
      for (double& t_s : visit.times_s) t_s = 0.001 * std::round(1000.0 * t_s);
    }
    TableMetadata metadata;
    metadata.rate_hz = 120.0;
    const auto spectrum = sampleSpectrum(visits, metadata);
    FT_VERIFY_MATCH(near(spectrum->rate_hz, 120.0, 1e-12));
    QCOMPARE(spectrum->lines.size(), std::size_t(1));
    FT_VERIFY_MATCH(near(spectrum->lines[0].frequency_hz, 20.0, 0.4));
  }

  void tooLittleIsNoSpectrum() {
    Recording recording;
    recording.stops = 2;
    QVERIFY(!sampleSpectrum(record(recording), {}));
    recording.stops = 50;
    recording.readings = 8;
    QVERIFY(!sampleSpectrum(record(recording), {}));
    QVERIFY(!sampleSpectrum({}, {}));
  }
};

FIELDTRUE_TEST(SampleSpectrumTest)
#include "sample_spectrum_test.moc"
