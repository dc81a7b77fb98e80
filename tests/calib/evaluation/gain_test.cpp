#include <QTest>
#include <cmath>
#include <numeric>
#include <random>

#include "calib/evaluation/base/index_source.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/base/noise_floor.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/error_stats.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

std::vector<int> numbered(std::size_t count) {
  std::vector<int> places(count);
  std::iota(places.begin(), places.end(), 100);
  return places;
}

}  // namespace

class GainTestTest : public QObject {
  Q_OBJECT
 private slots:
  void statisticsOfFourErrorsByHand() {
    const ErrorStats stats = errorStats({1.0, 2.0, 4.0, 3.0});
    FT_VERIFY_MATCH(near(stats.mean, 2.5, 1e-12));
    FT_VERIFY_MATCH(near(stats.median, 2.5, 1e-12));
    FT_VERIFY_MATCH(near(stats.rms, std::sqrt(30.0 / 4.0), 1e-12));
    FT_VERIFY_MATCH(near(stats.p95, 3.85, 1e-12));  // Type 7: 3 + 0.85 (4 - 3).
    FT_VERIFY_MATCH(near(stats.max, 4.0, 0.0));
    QVERIFY(stats.rms_low90 < stats.rms && stats.rms < stats.rms_high90);
  }

  void equalErrorsHaveNoInterval() {
    const ErrorStats stats = errorStats(std::vector<double>(20, 0.5));
    FT_VERIFY_MATCH(near(stats.rms_low90, 0.5, 1e-12));
    FT_VERIFY_MATCH(near(stats.rms_high90, 0.5, 1e-12));
    const ErrorStats nothing = errorStats({});
    FT_VERIFY_MATCH(near(nothing.rms, 0.0, 0.0));
  }

  void intervalIsTheLargeSampleOne() {
    // Errors |N(0,1)|: the mean square has SD sqrt(2/n), so the RMS 1 has SD 1/sqrt(2n) and the interval is +-1.645 of
    // it.
    std::mt19937_64 generator(8);
    std::normal_distribution<double> normal;
    std::vector<double> errors(2000);
    for (double& error : errors) error = std::abs(normal(generator));
    const ErrorStats stats = errorStats(errors);
    const double half_width = 1.645 / std::sqrt(2.0 * 2000.0);
    FT_VERIFY_MATCH(near(stats.rms - stats.rms_low90, half_width, 0.15 * half_width));
    FT_VERIFY_MATCH(near(stats.rms_high90 - stats.rms, half_width, 0.15 * half_width));
  }

  /// Eight squares of mean 1 and variance 1 are carried by 8 / (1 + 1) = 4 places: two degrees of freedom, whose 95 %
  /// point is 2.919986 by the tables.
  void intervalByHand() {
    std::vector<double> errors;
    for (int i = 0; i < 8; ++i) errors.push_back(std::sqrt(1.0 + (i % 2 == 0 ? 1.0 : -1.0) * std::sqrt(7.0 / 8.0)));
    const double t_sd = 2.919986 / std::sqrt(8.0);
    const ErrorStats stats = errorStats(errors);
    FT_VERIFY_MATCH(near(stats.rms, 1.0, 1e-12));
    FT_VERIFY_MATCH(near(stats.rms_low90, std::exp(-0.5 * t_sd), 1e-6));
    FT_VERIFY_MATCH(near(stats.rms_high90, std::exp(0.5 * t_sd * 1.6), 1e-6));
    const ErrorStats tuned = errorStats(errors, {.is_tuned = true});
    FT_VERIFY_MATCH(near(tuned.rms_high90, std::exp(1.3 * 0.5 * t_sd * 1.6), 1e-6));
    // Beside an error of 4 at each place, the ratio of mean squares varies as these do, and is linear in them; 1.894579
    // is the 95 % point of seven degrees of freedom.
    const GainTest gain = testGain(numbered(8), std::vector<double>(8, 4.0), errors);
    FT_VERIFY_MATCH(near(gain.gain, 0.75, 1e-12));
    FT_VERIFY_MATCH(near(gain.low90, 1.0 - 0.25 * std::sqrt(1.0 + 1.75 * 1.894579 / std::sqrt(8.0)), 1e-6));
    FT_VERIFY_MATCH(near(gain.high90, 1.0 - 0.25 * std::exp(-0.5 * t_sd * 1.6), 1e-6));
    const PairedDifference difference = pairedDifference(errors, std::vector<double>(8, 4.0));
    FT_VERIFY_MATCH(near(difference.difference, -3.0, 1e-12));
    FT_VERIFY_MATCH(near(difference.high90, -3.0 + 0.5 * t_sd * 1.7, 1e-6));
    FT_VERIFY_MATCH(near(difference.low90, -3.0 - 0.5 * t_sd * 1.7, 1e-6));
  }

  /// The errors of intervalByHand, of a fit whose own variance is three times that of their mean square: 1.644854, the
  /// 95 % point of the normal distribution by the tables, times twice its SD is farther than t below (2.92), not above
  /// (2.92 times 1.6). A fit that varies by as much as no place does leaves the interval as it was.
  void aFitThatVariesItselfIsWiderKnown() {
    std::vector<double> errors;
    for (int i = 0; i < 8; ++i) errors.push_back(std::sqrt(1.0 + (i % 2 == 0 ? 1.0 : -1.0) * std::sqrt(7.0 / 8.0)));
    const double sd = 1.0 / std::sqrt(8.0);
    const ErrorStats stats = errorStats(errors, {.own_variance = 3.0 / 8.0});
    FT_VERIFY_MATCH(near(stats.rms_low90, std::exp(-0.5 * 2.0 * 1.644854 * sd), 1e-4));
    FT_VERIFY_MATCH(near(stats.rms_high90, std::exp(0.5 * 1.6 * 2.919986 * sd), 1e-6));
    const GainTest gain = testGain(numbered(8), std::vector<double>(8, 4.0), errors, {.own_variance = 15.0 / 8.0});
    FT_VERIFY_MATCH(near(gain.low90, 1.0 - 0.25 * std::exp(0.5 * 4.0 * 1.644854 * sd), 1e-4));
    FT_VERIFY_MATCH(near(gain.high90, 1.0 - 0.25 * std::exp(-0.5 * 4.0 * 1.644854 * sd), 1e-4));
    QCOMPARE(errorStats(errors, {.own_variance = 0.01 / 8.0}).rms_low90, errorStats(errors).rms_low90);
  }

  /// Where both vary: at its low end the gain is just within reach of the paired differences there.
  void lowGainIsFiellers() {
    const std::vector<double> before = {9, 7, 8, 11, 6, 10, 8, 9, 12, 7, 9, 8},
                              after = {3, 2, 4, 3, 1, 5, 2, 3, 4, 2, 3, 2};
    const GainTest test = testGain(numbered(12), before, after);
    const double ratio = std::pow(1.0 - test.low90, 2);
    double mean = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < 12; ++i) mean += (after[i] * after[i] - ratio * before[i] * before[i]) / 12.0;
    for (std::size_t i = 0; i < 12; ++i)
      sum += std::pow(after[i] * after[i] - ratio * before[i] * before[i] - mean, 2) / 11.0;
    // 1.795885: Student's t, 95 %, eleven degrees of freedom, by the tables.
    FT_VERIFY_MATCH(near(-mean / std::sqrt(sum / 12.0), 1.75 * 1.795885, 1e-5));
  }

  /// Four coefficients of eight places leave four: two of them carry the mean square, and one degree of freedom has
  /// 6.313752 for its 95 % point by the tables.
  void coefficientsOfTheFitAreTakenOff() {
    std::vector<double> errors;
    for (int i = 0; i < 8; ++i) errors.push_back(std::sqrt(1.0 + (i % 2 == 0 ? 1.0 : -1.0) * std::sqrt(7.0 / 8.0)));
    const double t_sd = 6.313752 / std::sqrt(4.0);
    const ErrorStats stats = errorStats(errors, {.coefficients_a_place = 0.5});
    FT_VERIFY_MATCH(near(stats.rms_low90, std::exp(-0.5 * t_sd), 1e-6));
    FT_VERIFY_MATCH(near(stats.rms_high90, std::exp(0.5 * t_sd * (1.0 + 1.2 / std::sqrt(2.0))), 1e-4));
  }

  /// Eight places at four true positions, each seen by two sensors: four, as in the test before.
  void aTruePositionIsCountedOnce() {
    std::vector<double> errors;
    for (int i = 0; i < 8; ++i) errors.push_back(std::sqrt(1.0 + (i % 2 == 0 ? 1.0 : -1.0) * std::sqrt(7.0 / 8.0)));
    const double t_sd = 6.313752 / std::sqrt(4.0);
    FT_VERIFY_MATCH(near(errorStats(errors, {.positions_a_place = 0.5}).rms_low90, std::exp(-0.5 * t_sd), 1e-6));
    const std::vector<double> others(8, 2.0);
    const PairedDifference all = pairedDifference(errors, others), half = pairedDifference(errors, others, 0.5);
    QCOMPARE(half.difference, all.difference);
    QVERIFY(half.high90 - half.low90 > 1.5 * (all.high90 - all.low90));
  }

  /// One place of twenty carries much of the error before: Fieller's bound is far off, or nowhere, and the low end is
  /// that of the logarithm. Squares before are 9 and 1, their mean 1.4; after they are alike, so only those before
  /// vary.
  void fewPlacesThatCarryTheErrorLeaveALowEnd() {
    std::vector<double> before(20, 1.0);
    before[3] = 3.0;
    const GainTest test = testGain(numbered(20), before, std::vector<double>(20, 0.5));
    const double sd = (9.0 - 1.0) / 1.4 / std::sqrt(20.0) / std::sqrt(20.0);
    // 1.729133: Student's t, 95 %, nineteen degrees of freedom, by the tables.
    const double ratio = 0.25 / 1.4 * std::exp(1.75 * 1.729133 * sd);
    FT_VERIFY_MATCH(near(test.low90, 1.0 - std::sqrt(ratio), 1e-6));
    // Fieller's would be (1 + (sqrt(q) + q) / (1 - q)) times what is seen, q = T^2/20 times the variance: 7.4 times.
    const double q = std::pow(1.75 * 1.729133, 2) * sd * sd;
    QVERIFY(1.0 + (std::sqrt(q) + q) / (1.0 - q) > 3.0 * ratio / (0.25 / 1.4));
  }

  void oneErrorHasNoInterval() {
    const Interval interval = rmsInterval90(std::vector<double>{2.0});
    QVERIFY(std::isnan(interval.low) && std::isnan(interval.high));
    const std::vector<double> two = {2.0}, one = {1.0};
    const PairedGain gain = pairedGain(two, one);
    QVERIFY(gain.gain == 0.5 && std::isnan(gain.low90) && std::isnan(gain.high90));
    const PairedDifference difference = pairedDifference(two, one);
    QVERIFY(difference.difference == 1.0 && std::isnan(difference.low90) && std::isnan(difference.high90));
  }

  void indicesAreDrawnEvenly() {
    IndexSource source(1);
    std::vector<int> counts(7, 0);
    for (int i = 0; i < 70000; ++i) {
      const std::size_t index = source.below(7);
      QVERIFY(index < 7);
      ++counts[index];
    }
    // Expected 10,000 each with SD 93.
    for (const int count : counts) QVERIFY(std::abs(count - 10000) < 465);
  }

  void halvedErrorsGainHalf() {
    std::vector<double> before;
    std::vector<double> after;
    for (int i = 1; i <= 30; ++i) {
      before.push_back(i);
      after.push_back(0.5 * i);
    }
    const GainTest test = testGain(numbered(30), before, after);
    // Every place gains exactly one half, so nothing varies.
    FT_VERIFY_MATCH(near(test.gain, 0.5, 1e-12));
    FT_VERIFY_MATCH(near(test.low90, 0.5, 1e-12));
    FT_VERIFY_MATCH(near(test.high90, 0.5, 1e-12));
    FT_VERIFY_MATCH(near(test.gain_without_worst_place, 0.5, 1e-12));
    QVERIFY(test.apply);
  }

  void nineAndAHalfPercentIsTooLittle() {
    const std::vector<double> before(30, 2.0);
    QVERIFY(!testGain(numbered(30), before, std::vector<double>(30, 1.81)).apply);  // 9.5 %
    QVERIFY(testGain(numbered(30), before, std::vector<double>(30, 1.79)).apply);   // 10.5 %
  }

  void aGainThatHangsOnOnePlaceIsRefused() {
    // 30 places with error 1 before and after, one outlier of 20 that is healed: 1 - sqrt(31/430) = 73 % with it.
    std::vector<double> before(31, 1.0);
    std::vector<double> after(31, 1.0);
    before[12] = 20.0;
    const GainTest test = testGain(numbered(31), before, after);
    FT_VERIFY_MATCH(near(test.gain, 1.0 - std::sqrt(31.0 / 430.0), 1e-12));
    QCOMPARE(test.worst_place, 112);
    FT_VERIFY_MATCH(near(test.gain_without_worst_place, 0.0, 1e-12));
    QVERIFY(!test.apply);
  }

  void aGainThatMayBeChanceIsRefused() {
    // Two of three places healed, the third made worse by half: which of them chance drew decides.
    std::vector<double> before(12, 1.0);
    std::vector<double> after(12, 0.1);
    for (std::size_t i = 0; i < 12; i += 3) after[i] = 1.55;
    const GainTest test = testGain(numbered(12), before, after);
    FT_VERIFY_MATCH(near(test.gain, 1.0 - std::sqrt((8 * 0.01 + 4 * 1.55 * 1.55) / 12.0), 1e-12));
    QVERIFY(test.gain > 0.10 && test.low90 < 0.0);
    QVERIFY(!test.apply);
  }

  void twoPlacesAreTooFew() {
    const GainTest test = testGain({1, 2}, {5.0, 5.0}, {0.1, 0.1});
    QVERIFY(test.gain > 0.9 && !test.apply);
    QVERIFY(std::isnan(test.gain_without_worst_place) && std::isnan(test.low90_without_worst_place));
    QVERIFY(!testGain({}, {}, {}).apply);
    QVERIFY(!testGain({1}, {5.0}, {0.1}).apply);
  }

  void perfectBeforeGainsNothing() {
    FT_VERIFY_MATCH(
        near(testGain(numbered(5), std::vector<double>(5, 0.0), std::vector<double>(5, 0.0)).gain, 0.0, 0.0));
  }

  void noiseFloorByHand() {
    // Place 1: variance (4+9+16) mm2 over 10 independent samples, seen twice alike; place 2: 50 mm2 over 1. Jig 1 mm an
    // axis.
    Node node;
    node.node = 1;
    node.covariance_m2 = Eigen::Matrix3d(Eigen::Vector3d(4e-6, 9e-6, 16e-6).asDiagonal());
    node.sd_rot_rad = 0.02;
    node.n_effective = 10.0;
    std::vector<Node> nodes = {node, node};
    nodes[1].visit = 1;
    node.node = 2;
    node.covariance_m2 = Eigen::Matrix3d(Eigen::Vector3d(50e-6, 0.0, 0.0).asDiagonal());
    node.n_effective = 1.0;
    nodes.push_back(node);
    TableMetadata metadata;
    metadata.jig_tolerance_m = 0.001;
    const NoiseFloor floor = noiseFloor(nodes, metadata);
    FT_VERIFY_MATCH(near(floor.position_mm, std::sqrt(((2.9 + 3.0) + (50.0 + 3.0)) / 2.0), 1e-9));
    FT_VERIFY_MATCH(near(floor.orientation_deg, std::sqrt((4e-5 + 4e-4) / 2.0) * 180.0 / M_PI, 1e-9));
    QCOMPARE(QByteArray::fromStdString(floor.from), QByteArray("samples and jig tolerance"));
    metadata.jig_tolerance_m.reset();
    QCOMPARE(QByteArray::fromStdString(noiseFloor(nodes, metadata).from), QByteArray("samples"));
    QCOMPARE(QByteArray::fromStdString(noiseFloor(std::vector<Node>(3), metadata).from), QByteArray("not stated"));
  }
};

FIELDTRUE_TEST(GainTestTest)
#include "gain_test.moc"
