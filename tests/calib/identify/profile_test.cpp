#include "calib/identify/profile.h"

#include <Eigen/LU>
#include <QTest>
#include <cmath>

#include "calib/gap/diagnosis.h"
#include "tests/calib/identify/noisy_rows.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

constexpr double kNinetyTwoSided = 1.6529;  ///< Student t, 95 % quantile, 191 degrees of freedom, by the tables.
constexpr double kFall = 2.706;             ///< 90 % of chi-square with one degree of freedom.

Eigen::Vector3d firstShape(const Eigen::Vector3d& p_m) { return {std::sin(7.0 * p_m.y()), 1.0, p_m.x()}; }
Eigen::Vector3d secondShape(const Eigen::Vector3d& p_m) { return {std::cos(5.0 * p_m.z()), p_m.y(), 0.5}; }

/// Shifts the sensor by a (first + s second): a is linear, s is searched, and their ratio is Fieller's problem.
class RatioFit final : public effects::EffectFit {
 public:
  std::string name() const override { return "ratio"; }
  std::vector<effects::FitParameter> searched() const override { return {{"s", "", -20.0, 20.0}}; }
  std::vector<effects::FitParameter> linear() const override { return {{"a_m", "m", -1.0, 1.0}}; }
  bool allows(const Eigen::VectorXd& searched) const override { return std::abs(searched[0]) <= 20.0; }
  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Eigen::Vector3d& p_m = at[i].tracker_from_sensor.position_m;
      responses[i] = {};
      responses[i].shift_m = firstShape(p_m) + searched[0] * secondShape(p_m);
    }
  }
  effects::FittedEffect describe(const Eigen::VectorXd& /*searched*/,
                                 const Eigen::VectorXd& /*linear*/) const override {
    return {};
  }
};

/// Positions only, in a frame that the rig states exactly: nothing but the effect is fitted.
GapRows positionsAt(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& reading_m, unsigned seed,
                    CalibrationTable* table = nullptr) {
  std::vector<Node> nodes = noisyNodes({.change = {}}, seed);
  for (Node& node : nodes) {
    const Eigen::Vector3d noise_m = node.tracker_from_sensor.position_m - node.reference_from_sensor.position_m;
    node.tracker_from_sensor.position_m = reading_m(node.reference_from_sensor.position_m) + noise_m;
    node.has_orientation = false;
  }
  TableMetadata metadata;
  metadata.alignment_known = true;
  metadata.alignment_tolerance_m = metadata.alignment_tolerance_rad = 1e-6;
  metadata.jig_tolerance_m = NoisyRows{}.sd_m;
  if (table != nullptr) *table = {metadata, nodes};
  return makeGapRows(nodes, metadata).value();
}

/// Least squares of the two shapes, and the ends of Fieller's interval for the ratio of their sizes.
struct Fieller {
  double ratio = 0.0;
  double low = 0.0;
  double high = 0.0;

  explicit Fieller(const GapRows& rows) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    double sum = 0.0;
    for (const GapRow& row : rows.rows) {
      Eigen::Matrix<double, 3, 2> J;
      J << firstShape(row.reference_from_sensor.position_m), secondShape(row.reference_from_sensor.position_m);
      const Eigen::Vector3d d_m = row.tracker_from_sensor.position_m - row.reference_from_sensor.position_m;
      normal += J.transpose() * J;
      right += J.transpose() * d_m;
      sum += d_m.squaredNorm();
    }
    const Eigen::Vector2d x = normal.inverse() * right;
    const double freedom = 3.0 * static_cast<double>(rows.rows.size()) - 2.0;
    const Eigen::Matrix2d V = (sum - x.dot(right)) / freedom * normal.inverse();
    // (b - s a)^2 = kFall (V_bb - 2 s V_ab + s^2 V_aa), a quadratic in s.
    const double A = x[0] * x[0] - kFall * V(0, 0);
    const double B = x[0] * x[1] - kFall * V(0, 1);
    const double C = x[1] * x[1] - kFall * V(1, 1);
    ratio = x[1] / x[0];
    low = (B - std::sqrt(B * B - A * C)) / A;
    high = (B + std::sqrt(B * B - A * C)) / A;
  }
};

}  // namespace

class GapProfileTest : public QObject {
  Q_OBJECT
 private slots:
  /// The profile of a ratio ends where Fieller's interval does, to the tenth at which the search stops.
  void profileOfARatioIsFiellers_data() {
    QTest::addColumn<double>("a_m");
    QTest::addColumn<double>("s");
    QTest::newRow("nearly symmetric") << 0.004 << 1.0;
    QTest::newRow("negative ratio") << 0.003 << -0.7;
    QTest::newRow("skew: the denominator is 4 SDs from 0") << 0.0006 << 3.0;
  }
  void profileOfARatioIsFiellers() {
    QFETCH(double, a_m);
    QFETCH(double, s);
    const GapRows rows = positionsAt(
        [&](const Eigen::Vector3d& p_m) {
          return Eigen::Vector3d(p_m + a_m * (firstShape(p_m) + s * secondShape(p_m)));
        },
        6);
    const GapSearch search(rows, {}, NoiseFrom::kStated);
    GapModel start = search.none().model;
    start.terms.push_back({effects::findEffect("grid_scale").value(), std::make_shared<RatioFit>(),
                           Eigen::VectorXd::Constant(1, s), Eigen::VectorXd::Constant(1, a_m)});
    const RefinedModel refined = search.refined(start);
    const Fieller expected(rows);
    const double half = 0.5 * (expected.high - expected.low);
    FT_VERIFY_MATCH(near(refined.model.terms.front().searched[0], expected.ratio, 0.05 * half));
    const ProfileInterval seen = profileInterval(search, refined, 0, 0);
    QVERIFY(seen.low && seen.high);
    FT_VERIFY_MATCH(near(*seen.low, expected.low, 0.12 * (expected.ratio - expected.low)));
    FT_VERIFY_MATCH(near(*seen.high, expected.high, 0.12 * (expected.high - expected.ratio)));
  }

  /// Nothing is there: any ratio does, and at least one side says so.
  void anUnboundedSideIsUnset_data() {
    QTest::addColumn<unsigned>("seed");
    for (const unsigned seed : {1U, 2U, 7U, 10U}) QTest::addRow("seed %u", seed) << seed;
  }
  void anUnboundedSideIsUnset() {
    QFETCH(unsigned, seed);
    const GapRows rows = positionsAt([](const Eigen::Vector3d& p_m) { return p_m; }, seed);
    const GapSearch search(rows, {}, NoiseFrom::kStated);
    GapModel start = search.none().model;
    start.terms.push_back({effects::findEffect("grid_scale").value(), std::make_shared<RatioFit>(),
                           Eigen::VectorXd::Constant(1, 0.0), Eigen::VectorXd::Constant(1, 1e-5)});
    const ProfileInterval seen = profileInterval(search, search.refined(start), 0, 0);
    QVERIFY(!seen.low || !seen.high);
  }

  /// A gain g makes every reading (1 + g)^(-1/3) as long: a regression through the origin with one slope.
  void intervalOfALinearParameterIsStudents() {
    constexpr double kGain = 0.03;
    CalibrationTable table;
    const GapRows rows = positionsAt(
        [](const Eigen::Vector3d& p_m) { return Eigen::Vector3d(std::cbrt(1.0 / (1.0 + kGain)) * p_m); }, 8, &table);
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    for (const GapRow& row : rows.rows) {
      const Eigen::Vector3d& p_m = row.reference_from_sensor.position_m;
      xx += p_m.squaredNorm();
      xy += p_m.dot(row.tracker_from_sensor.position_m);
      yy += row.tracker_from_sensor.position_m.squaredNorm();
    }
    const double length = xy / xx;
    const double sd = std::sqrt((yy - xy * length) / (3.0 * 64.0 - 1.0) / xx);
    const auto report = gap::diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    const auto is_gain = [](const gap::GapCandidate& c) { return c.effect == "global_gain"; };
    const auto gain = std::find_if(report->candidates.begin(), report->candidates.end(), is_gain);
    QVERIFY(gain != report->candidates.end() && gain->parameters.size() == 1);
    const gap::Estimate& seen = gain->parameters.front();
    QVERIFY(seen.low90 && seen.high90);
    // g = length^-3 - 1, so that dg = 3 length^-4 dlength.
    const double half = kNinetyTwoSided * 3.0 * std::pow(length, -4.0) * sd;
    FT_VERIFY_MATCH(near(seen.value, std::pow(length, -3.0) - 1.0, 0.1 * half));
    FT_VERIFY_MATCH(near(*seen.high90 - seen.value, half, 0.06 * half));
    FT_VERIFY_MATCH(near(seen.value - *seen.low90, half, 0.06 * half));
  }

  /// Nine intervals of ten hold the truth: of 100 draws, 83 to 97 (2.33 binomial SDs).
  void intervalsHoldTheTruthAsOftenAsTheySay() {
    constexpr double kSize_m = 0.002;
    constexpr double kRatio = 1.5;
    int n_held = 0;
    for (unsigned seed = 1; seed <= 100; ++seed) {
      const GapRows rows = positionsAt(
          [&](const Eigen::Vector3d& p_m) {
            return Eigen::Vector3d(p_m + kSize_m * (firstShape(p_m) + kRatio * secondShape(p_m)));
          },
          seed);
      const GapSearch search(rows, {}, NoiseFrom::kStated);
      GapModel start = search.none().model;
      start.terms.push_back({effects::findEffect("grid_scale").value(), std::make_shared<RatioFit>(),
                             Eigen::VectorXd::Constant(1, kRatio), Eigen::VectorXd::Constant(1, kSize_m)});
      const ProfileInterval seen = profileInterval(search, search.refined(start), 0, 0);
      QVERIFY(seen.low && seen.high);
      if (*seen.low <= kRatio && kRatio <= *seen.high) ++n_held;
    }
    QVERIFY2(n_held >= 83 && n_held <= 97, qPrintable(QString::number(n_held)));
  }
};

FIELDTRUE_TEST(GapProfileTest)
#include "profile_test.moc"
