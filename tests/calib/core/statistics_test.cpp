#include "calib/core/statistics.h"

#include <QTest>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

constexpr double kMm = 1e-3;

Sample sampleAt(const Eigen::Vector3d& position_mm, const Eigen::Quaterniond& q = Eigen::Quaterniond::Identity()) {
  Sample sample;
  sample.tracker_from_sensor = {kMm * position_mm, q};
  return sample;
}

std::vector<Sample> samplesAlongX(const std::vector<double>& x_mm) {
  std::vector<Sample> samples;
  for (const double x : x_mm) samples.push_back(sampleAt({x, 0.0, 0.0}));
  return samples;
}

std::vector<Sample> noisySamples(int count, double sd_mm, double sd_rad, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  const auto vector = [&](double sd) {
    return Eigen::Vector3d(sd * normal(engine), sd * normal(engine), sd * normal(engine));
  };
  std::vector<Sample> samples;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(200.0, -300.0, 150.0) + vector(sd_mm);
    samples.push_back(
        sampleAt(p, rotationFromVector(Eigen::Vector3d(0.5, 0.2, -1.0)) * rotationFromVector(vector(sd_rad))));
  }
  return samples;
}

AveragingOptions keepingAll() {
  AveragingOptions options;
  options.reject_outliers = false;
  return options;
}

Eigen::Quaterniond aboutZ(double angle_rad) { return rotationFromVector({0.0, 0.0, angle_rad}); }

}  // namespace

class StatisticsTest : public QObject {
  Q_OBJECT

 private slots:
  void meanAndCovarianceByHand() {
    // Deviations from (2, 3, 2) are (-1,-1,1), (1,-1,-1), (0,2,0); divided by n - 1 = 2.
    const std::vector<Sample> samples{sampleAt({1, 2, 3}), sampleAt({3, 2, 1}), sampleAt({2, 5, 2})};
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->mean.position_m, Eigen::Vector3d(2, 3, 2) * kMm, 1e-15));
    Eigen::Matrix3d expected;
    expected << 1, 0, -1, 0, 3, 0, -1, 0, 1;
    FT_VERIFY_MATCH(near(statistics->covariance_m2, expected * kMm * kMm, 1e-18));
    QCOMPARE(statistics->n_used, std::size_t{3});
    QVERIFY(statistics->rejections.empty());
  }

  void autocorrelationByHand_data() {
    QTest::addColumn<QVector<double>>("x_mm");
    QTest::addColumn<QVector<double>>("y_mm");
    QTest::addColumn<double>("rho");
    QTest::addColumn<double>("n_effective");
    const QVector<double> none{0, 0, 0, 0};
    const QVector<double> alternating{1, -1, 1, -1};  // pairs -3, squares 4
    const QVector<double> slow{1, 1, -1, -1};         // pairs 1, squares 4
    QTest::newRow("slow") << slow << none << 0.25 << 4.0 * 0.75 / 1.25;
    QTest::newRow("alternating counts as independent") << alternating << none << -0.75 << 4.0;
    QTest::newRow("pooled over axes") << slow << alternating << -0.25 << 4.0;
    QTest::newRow("all the same") << none << none << 1.0 << 1.0;
  }
  void autocorrelationByHand() {
    QFETCH(QVector<double>, x_mm);
    QFETCH(QVector<double>, y_mm);
    QFETCH(double, rho);
    QFETCH(double, n_effective);
    std::vector<Sample> samples;
    for (int i = 0; i < 4; ++i) samples.push_back(sampleAt({5.0 + x_mm[i], 7.0 + y_mm[i], 9.0}));
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->autocorrelation, rho, 1e-9));
    FT_VERIFY_MATCH(near(statistics->n_effective, n_effective, 1e-9));
  }

  // A first-order autoregression of coefficient 0.88 at 60 samples is worth about 60 * 0.12 / 1.88 = 3.8.
  void autocorrelationOfAFilteredTracker() {
    std::mt19937 engine(3);
    std::normal_distribution<double> normal;
    std::vector<Sample> samples;
    Eigen::Vector3d state = Eigen::Vector3d::Zero();
    for (int i = 0; i < 6000; ++i) {
      state = 0.88 * state + 0.1 * Eigen::Vector3d(normal(engine), normal(engine), normal(engine));
      samples.push_back(sampleAt(Eigen::Vector3d(100, 200, 300) + state));
    }
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->autocorrelation, 0.88, 0.01));
    FT_VERIFY_MATCH(near(statistics->n_effective, 6000.0 * 0.12 / 1.88, 40.0));
  }

  void pairsAcrossARejectedSampleDoNotCount() {
    // 1, 1, (bad), -1, -1: squares 4, pairs 1*1 and (-1)*(-1).
    std::vector<Sample> samples = samplesAlongX({1, 1, 50, -1, -1});
    samples[2].status = "D";
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->autocorrelation, 0.5, 1e-12));
  }

  void meanRotationOfAWeightedPair() {
    // For two rotations by +-2a about one axis, tan(2 phi) = (w1 - w2) / (w1 + w2) tan(2a), the mean turns by 2 phi.
    const double a = 0.3;
    const std::vector<Eigen::Quaterniond> rotations{aboutZ(2.0 * a), Eigen::Quaterniond(-aboutZ(-2.0 * a).coeffs())};
    const std::vector<double> weights{3.0, 1.0};
    const double phi = 0.5 * std::atan(0.5 * std::tan(2.0 * a));
    FT_VERIFY_MATCH(near(meanRotation(rotations, weights), aboutZ(2.0 * phi), 1e-14));
    FT_VERIFY_MATCH(near(meanRotation(rotations), Eigen::Quaterniond::Identity(), 1e-14));
  }

  void meanRotationIgnoresSigns() {
    std::vector<Eigen::Quaterniond> rotations;
    const Eigen::Quaterniond middle = rotationFromVector({2.9, 0.4, -0.8});
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d turn =
          0.05 * Eigen::Vector3d(std::cos(0.1 * std::numbers::pi * i), std::sin(0.1 * std::numbers::pi * i), 0);
      const Eigen::Quaterniond q = middle * rotationFromVector(turn);
      rotations.push_back(i % 3 == 0 ? Eigen::Quaterniond(-q.coeffs()) : q);
    }
    const Eigen::Quaterniond mean = meanRotation(rotations);
    FT_VERIFY_MATCH(near(mean, middle, 1e-12));
    QVERIFY(mean.w() >= 0.0);
  }

  void rotationSdByHand() {
    const std::vector<Sample> samples{sampleAt({0, 0, 0}, aboutZ(0.02)), sampleAt({0, 0, 0}, aboutZ(-0.02))};
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->mean.orientation, Eigen::Quaterniond::Identity(), 1e-14));
    FT_VERIFY_MATCH(near(statistics->sd_rot_rad, 0.02, 1e-14));
  }

  void positionLimitByHand() {
    // Median 0.5; distances 2.5 1.5 0.5 0.5 1.5 19.5 with median 1.5 and MAD 1: limit 1.5 + 4 * 1.4826.
    const auto statistics = averageSamples(samplesAlongX({-2, -1, 0, 1, 2, 20}));
    FT_VERIFY_OK(statistics);
    QCOMPARE(statistics->rejections.size(), std::size_t{1});
    QCOMPARE(statistics->rejections[0].sample, std::size_t{5});
    QVERIFY(statistics->rejections[0].reason == RejectionReason::kPositionOutlier);
    QCOMPARE(statistics->rejections[0].text, std::string("19.5 mm from the median (limit 7.43 mm)"));
    FT_VERIFY_MATCH(near(statistics->mean.position_m, Eigen::Vector3d::Zero(), 1e-15));
    FT_VERIFY_MATCH(near(statistics->covariance_m2(0, 0), 2.5 * kMm * kMm, 1e-15));
  }

  void rejectsEachKindWithItsReason() {
    std::vector<Sample> samples = noisySamples(64, 0.1, 0.001, 5);
    samples[3].status = "D";
    samples[10].tracker_from_sensor.position_m.y() = std::nan("");
    samples[20].tracker_from_sensor.position_m.setConstant(-3.7e28);
    samples[30].tracker_from_sensor.position_m.z() += 12.3 * kMm;
    samples[40].tracker_from_sensor.orientation = samples[40].tracker_from_sensor.orientation * aboutZ(0.1);
    samples[50].tracker_from_sensor.orientation.coeffs() *= -1.0;
    samples[60].tracker_from_sensor.orientation.coeffs().setZero();
    const auto statistics = averageSamples(samples);
    FT_VERIFY_OK(statistics);
    const std::vector<std::pair<std::size_t, RejectionReason>> expected{
        {3, RejectionReason::kStatus},           {10, RejectionReason::kNotFinite},
        {20, RejectionReason::kNotFinite},       {30, RejectionReason::kPositionOutlier},
        {40, RejectionReason::kRotationOutlier}, {60, RejectionReason::kNotFinite}};
    QCOMPARE(statistics->rejections.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      QCOMPARE(statistics->rejections[i].sample, expected[i].first);
      QVERIFY(statistics->rejections[i].reason == expected[i].second);
    }
    QCOMPARE(statistics->n_used, std::size_t{58});
    FT_VERIFY_MATCH(holdsAll(statistics->rejections[0].text, {"status D"}));
    FT_VERIFY_MATCH(holdsAll(statistics->rejections[3].text, {"12.", "mm from the median (limit"}));
    FT_VERIFY_MATCH(holdsAll(statistics->rejections[4].text, {"5.7", "deg from the median (limit"}));
  }

  void rejectionOffKeepsOutliersButNotBadReadings() {
    std::vector<Sample> samples = samplesAlongX({0, 0, 0, 0, 100, 7});
    samples[5].status = "?";
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    QCOMPARE(statistics->n_used, std::size_t{5});
    FT_VERIFY_MATCH(near(statistics->mean.position_m.x(), 20.0 * kMm, 1e-15));
  }

  void goodDataLosesAlmostNothing() {
    std::size_t rejected = 0;
    for (unsigned seed = 0; seed < 50; ++seed) {
      const auto statistics = averageSamples(noisySamples(60, 0.3, 0.002, seed));
      FT_VERIFY_OK(statistics);
      rejected += statistics->rejections.size();
    }
    QVERIFY2(rejected < 30, QByteArray::number(static_cast<qulonglong>(rejected)) + " of 3000 normal samples rejected");
  }

  void noGoodSample() {
    const auto none = averageSamples({});
    QVERIFY(!none && none.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(none.error().message, {"at least one good sample, got no samples"}));
    std::vector<Sample> samples = samplesAlongX({1, 2});
    for (Sample& sample : samples) sample.status = "D";
    const auto bad = averageSamples(samples);
    QVERIFY(!bad);
    FT_VERIFY_MATCH(holdsAll(bad.error().message, {"got 2 samples, all unusable (first: status D)"}));
  }

  void sdIsNeverZero_data() {
    QTest::addColumn<double>("quantum_m");
    QTest::addColumn<double>("step_m");
    QTest::newRow("quantum given") << 0.11162e-3 << 0.11162e-3;
    QTest::newRow("none known") << 0.0 << 1e-6;
  }
  void sdIsNeverZero() {
    QFETCH(double, quantum_m);
    QFETCH(double, step_m);
    AveragingOptions options;
    options.quantum_m = quantum_m;
    for (const std::size_t count : {std::size_t{1}, std::size_t{60}}) {
      const std::vector<Sample> samples(count, sampleAt({123.456789012, -7.0 / 3.0, 0.1}));
      const auto statistics = averageSamples(samples, options);
      FT_VERIFY_OK(statistics);
      const Eigen::Matrix3d expected = (step_m * step_m / 12.0) * Eigen::Matrix3d::Identity();
      FT_VERIFY_MATCH(near(statistics->covariance_m2, expected, 1e-6 * step_m * step_m));
      QVERIFY(statistics->sd_rot_rad > 0.0);
      QCOMPARE(statistics->n_effective, 1.0);
      QCOMPARE(statistics->quantum_m, quantum_m);
      QVERIFY(statistics->rejections.empty());
    }
  }

  // Readings of a still sensor sit on two or three steps of the lattice: the step is found and nothing is an outlier.
  void lattice() {
    constexpr double kQuantum_m = 914.4e-3 / 8192.0;
    std::vector<Sample> samples = noisySamples(60, 0.08, 0.001, 11);
    for (Sample& sample : samples) {
      Eigen::Vector3d& p_m = sample.tracker_from_sensor.position_m;
      p_m = (p_m / kQuantum_m).array().round().matrix() * kQuantum_m;
    }
    const auto statistics = averageSamples(samples);
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->quantum_m, kQuantum_m, 1e-12));
    QVERIFY(statistics->rejections.empty());
    for (int axis = 0; axis < 3; ++axis) {
      QVERIFY(statistics->covariance_m2(axis, axis) >= kQuantum_m * kQuantum_m / 12.0 * (1.0 - 1e-12));
    }
  }

  void printedStepIsAFloorToo() {
    std::vector<Sample> samples = samplesAlongX(std::vector<double>(60, 304.8));
    for (std::size_t i = 0; i < samples.size(); i += 9) samples[i].tracker_from_sensor.position_m.x() = 304.9e-3;
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    FT_VERIFY_MATCH(near(statistics->quantum_m, 1e-4, 1e-12));
    FT_VERIFY_MATCH(near(std::sqrt(statistics->covariance_m2(1, 1)), 1e-4 / std::sqrt(12.0), 1e-12));
  }

  void medianAndQuantiles() {
    QCOMPARE(median({3, 1, 2}), 2.0);
    QCOMPARE(median({4, 1, 3, 2}), 2.5);
    QCOMPARE(median({7}), 7.0);
    // Hyndman and Fan type 7 of 1, 2, 4, 8: place 3 * 0.95 = 2.85, between 4 and 8.
    QCOMPARE(quantile({8, 1, 4, 2}, 0.95), 4.0 + 0.85 * 4.0);
    QCOMPARE(quantile({8, 1, 4, 2}, 0.0), 1.0);
    QCOMPARE(quantile({8, 1, 4, 2}, 1.0), 8.0);
    QVERIFY_THROWS_EXCEPTION(std::logic_error, median({}));
  }

  void setsNodeAndLeavesItsIdentity() {
    Node node;
    node.node = 7;
    node.visit = 2;
    node.role = NodeRole::kValidation;
    node.t_start_s = 1.5;
    node.reference_from_sensor.position_m = {1, 2, 3};
    std::vector<Sample> samples = noisySamples(10, 0.1, 0.001, 1);
    samples[4].status = "D";
    const auto statistics = averageSamples(samples, keepingAll());
    FT_VERIFY_OK(statistics);
    setStatistics(node, *statistics);
    FT_VERIFY_MATCH(sameBits(node.tracker_from_sensor, statistics->mean));
    QVERIFY(*node.covariance_m2 == statistics->covariance_m2 && *node.sd_rot_rad == statistics->sd_rot_rad);
    QVERIFY(node.n_used == 9 && node.n_rejected == 1 && node.n_effective == statistics->n_effective);
    QVERIFY(node.node == 7 && node.visit == 2 && node.role == NodeRole::kValidation && *node.t_start_s == 1.5);
    QCOMPARE(node.reference_from_sensor.position_m.z(), 3.0);
    node.has_orientation = false;
    setStatistics(node, *statistics);
    QVERIFY(!node.sd_rot_rad);
  }
};

FIELDTRUE_TEST(StatisticsTest)
#include "statistics_test.moc"
