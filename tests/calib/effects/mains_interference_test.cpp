#include <Eigen/QR>
#include <QTest>
#include <cmath>
#include <numbers>

#include "calib/effects/rows.h"
#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;

namespace {

constexpr int kReadings = 60;

/// One coupling over 60 readings.
Eigen::VectorXd seriesOf(const field::PhysicalEffect& effect, double rate_hz) {
  Eigen::VectorXd series(kReadings);
  for (int i = 0; i < kReadings; ++i) series[i] = effect.interference_per_m3(i / rate_hz)(0, 1);
  return series;
}

/// Share of a series' energy that no wave of a frequency explains.
double unexplained(const Eigen::VectorXd& series, double frequency_hz, double rate_hz) {
  Eigen::MatrixXd waves(kReadings, 2);
  for (int i = 0; i < kReadings; ++i) {
    const double angle_rad = 2.0 * std::numbers::pi * frequency_hz * i / rate_hz;
    waves.row(i) << std::cos(angle_rad), std::sin(angle_rad);
  }
  const Eigen::VectorXd fitted = waves * waves.completeOrthogonalDecomposition().solve(series);
  return (series - fitted).squaredNorm() / series.squaredNorm();
}

}  // namespace

class MainsInterferenceTest : public QObject {
  Q_OBJECT
 private slots:
  void showsAtItsAlias_data();
  void showsAtItsAlias();
  void isAConstantWhereItsAliasIsZero();
  void reachesEachCoilAtAnotherPhase();
  void addsItsLines();
  void refusesWhatMakesNoSense();
};

// |f0 - k fs|, the nearest k; at half the rate a line shows at the highest frequency there is.
void MainsInterferenceTest::showsAtItsAlias_data() {
  QTest::addColumn<double>("rate_hz");
  QTest::addColumn<double>("line_hz");
  QTest::addColumn<double>("alias_hz");
  const auto row = [](double rate_hz, double line_hz, double alias_hz) {
    QTest::addRow("%g Hz read at %g Hz", line_hz, rate_hz) << rate_hz << line_hz << alias_hz;
  };
  row(120.0, 50.0, 50.0);
  row(120.0, 60.0, 60.0);
  row(120.0, 100.0, 20.0);
  row(103.3, 50.0, 50.0);
  row(103.3, 60.0, 43.3);
  row(103.3, 100.0, 3.3);
  row(103.3, 120.0, 16.7);
  row(60.0, 50.0, 10.0);
}

void MainsInterferenceTest::showsAtItsAlias() {
  QFETCH(double, rate_hz);
  QFETCH(double, line_hz);
  QFETCH(double, alias_hz);
  const auto effect = effectOf("mains_interference", {{"line_hz", {line_hz}}, {"amplitude_per_m3", {1e-3}}});
  const Eigen::VectorXd series = seriesOf(*effect, rate_hz);
  QVERIFY(series.norm() > 1e-4);
  QVERIFY(unexplained(series, alias_hz, rate_hz) < 1e-12);
  QVERIFY(unexplained(series, alias_hz < 30.0 ? alias_hz + 5.0 : alias_hz - 5.0, rate_hz) > 0.9);
}

void MainsInterferenceTest::isAConstantWhereItsAliasIsZero() {
  const std::vector<std::pair<double, double>> rates_and_lines_hz{
      {120.0, 120.0}, {60.0, 60.0}, {50.0, 50.0}, {50.0, 100.0}};
  for (const auto& [rate_hz, line_hz] : rates_and_lines_hz) {
    const auto effect =
        effectOf("mains_interference", {{"line_hz", {line_hz}}, {"amplitude_per_m3", {1e-3}}, {"phase_rad", 1.0}});
    const Eigen::VectorXd series = seriesOf(*effect, rate_hz);
    FT_VERIFY_MATCH(near(series.maxCoeff() - series.minCoeff(), 0.0, 1e-12));
    FT_VERIFY_MATCH(near(series[0], 1e-3 / std::sqrt(3.0) * std::cos(1.0 + 2.0 * std::numbers::pi / 3.0), 1e-12));
  }
}

// A third of a cycle from coil to coil of the transmitter: the three add up to nothing, their squares to 3/2 A^2
// whenever.
void MainsInterferenceTest::reachesEachCoilAtAnotherPhase() {
  const auto effect = effectOf("mains_interference",
                               {{"line_hz", {50.0}}, {"amplitude_per_m3", {2e-3}}, {"direction", {0.0, 0.0, 7.0}}});
  for (const double time_s : {0.0, 0.0031, 1.17, 5000.013}) {
    const Eigen::Matrix3d picked_up = effect->interference_per_m3(time_s);
    FT_VERIFY_MATCH(near(picked_up.topRows<2>().norm(), 0.0, 1e-18));
    FT_VERIFY_MATCH(near(picked_up.row(2).sum(), 0.0, 1e-12));
    FT_VERIFY_MATCH(near(picked_up.row(2).squaredNorm(), 1.5 * 4e-6, 1e-12));
  }
}

void MainsInterferenceTest::addsItsLines() {
  const auto both = effectOf("mains_interference", {{"line_hz", {50.0, 150.0}}, {"amplitude_per_m3", {1e-3, 3e-4}}});
  const auto first = effectOf("mains_interference", {{"line_hz", {50.0}}, {"amplitude_per_m3", {1e-3}}});
  const auto third = effectOf("mains_interference", {{"line_hz", {150.0}}, {"amplitude_per_m3", {3e-4}}});
  const Eigen::Matrix3d sum = first->interference_per_m3(0.0123) + third->interference_per_m3(0.0123);
  FT_VERIFY_MATCH(near((both->interference_per_m3(0.0123) - sum).norm(), 0.0, 1e-18));
}

void MainsInterferenceTest::refusesWhatMakesNoSense() {
  const auto uneven = makeEffect("mains_interference", {{"line_hz", {50.0, 100.0}}, {"amplitude_per_m3", {1e-3}}});
  QVERIFY(!uneven);
  FT_VERIFY_MATCH(holdsAll(uneven.error().message, {"line_hz has 2 numbers", "amplitude_per_m3 1"}));
  const auto nowhere = makeEffect("mains_interference", {{"direction", {0.0, 0.0, 0.0}}});
  QVERIFY(!nowhere);
  FT_VERIFY_MATCH(holdsAll(nowhere.error().message, {"direction is (0, 0, 0)"}));
}

FIELDTRUE_TEST(MainsInterferenceTest)
#include "mains_interference_test.moc"
