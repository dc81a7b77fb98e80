#include <QTest>
#include <cmath>
#include <numeric>
#include <random>

#include "calib/evaluation/base/noise_floor.h"
#include "calib/evaluation/base/resampling.h"
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
    const ErrorStats stats = errorStats(errors, 3);
    const double half_width = 1.645 / std::sqrt(2.0 * 2000.0);
    FT_VERIFY_MATCH(near(stats.rms - stats.rms_low90, half_width, 0.15 * half_width));
    FT_VERIFY_MATCH(near(stats.rms_high90 - stats.rms, half_width, 0.15 * half_width));
  }

  void resamplesFollowTheSeed() {
    const std::vector<double> errors = {1, 5, 2, 8, 3, 1, 4};
    QCOMPARE(errorStats(errors, 7).rms_low90, errorStats(errors, 7).rms_low90);
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
    // Every resample gains exactly one half, with and without any place.
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
    QVERIFY(!testGain({}, {}, {}).apply);
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
