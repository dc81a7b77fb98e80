#include "calib/identify/shared_field.h"

#include <Eigen/LU>
#include <QTest>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/identify/field_comparison.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

constexpr double kNoise_m = 1e-3;

/// A smooth field of a few centimetres.
Eigen::Vector3d fieldAt(const Eigen::Vector3d& p_m) {
  return 0.02 * Eigen::Vector3d(std::sin(2.0 * p_m.y()), std::cos(1.5 * p_m.z()), p_m.x() * p_m.y());
}

/// @param first_place number of the first place
FieldReadings readingsAt(std::size_t count, int first_place, unsigned seed, double bump_m = 0.0) {
  std::mt19937 draw(seed);
  std::uniform_real_distribution<double> place(-0.6, 0.6);
  std::normal_distribution<double> noise(0.0, kNoise_m);
  FieldReadings readings;
  const auto n = static_cast<Eigen::Index>(count);
  readings.values.resize(n, 3);
  readings.variances = Eigen::VectorXd::Constant(n, kNoise_m * kNoise_m);
  readings.rig_variances = Eigen::VectorXd::Zero(n);
  readings.is_later.assign(count, 0);
  readings.sees_change.assign(count, 0);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::MatrixX3d shift = Eigen::MatrixX3d::Zero(n, 3);
    shift.col(axis).setOnes();
    readings.free.push_back(shift);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p_m(place(draw), place(draw), place(draw));
    readings.points.push_back({p_m, Eigen::Quaterniond::Identity(), 0.0});
    readings.places.push_back(first_place + static_cast<int>(i));
    const double near = std::exp(-(p_m - Eigen::Vector3d(0.3, 0.3, 0.3)).squaredNorm() / 0.09);
    const Eigen::Vector3d value_m = fieldAt(p_m) + bump_m * near * Eigen::Vector3d::UnitZ() +
                                    Eigen::Vector3d(noise(draw), noise(draw), noise(draw));
    readings.values.row(static_cast<Eigen::Index>(i)) = value_m.transpose();
  }
  return readings;
}

std::vector<int> placesFrom(int first, std::size_t count) {
  std::vector<int> places(count);
  for (std::size_t i = 0; i < count; ++i) places[i] = first + static_cast<int>(i);
  return places;
}

FieldReadings pairOf(double bump_m) {
  return joined(readingsAt(60, 0, 1), readingsAt(60, 1000, 2, bump_m), placesFrom(1000, 60));
}

/// The same field twice, and in the later recording a smooth change of an SD in each component besides: six waves of
/// random direction and phase, as long as the squared exponential's with a scale of half the region's diagonal.
FieldReadings changedBy(double sd_m, unsigned seed) {
  constexpr int kWaves = 6;
  const double scale_m = 0.5 * std::sqrt(3.0) * 1.2;
  std::mt19937 draw(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  FieldReadings pair = pairOf(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    for (int wave = 0; wave < kWaves; ++wave) {
      const Eigen::Vector3d k_per_m = Eigen::Vector3d(normal(draw), normal(draw), normal(draw)) / scale_m;
      const double begins = phase(draw);
      for (std::size_t i = 0; i < pair.size(); ++i)
        if (pair.is_later[i] != 0)
          pair.values(static_cast<Eigen::Index>(i), axis) +=
              sd_m * std::sqrt(2.0 / kWaves) * std::sin(k_per_m.dot(pair.points[i].place_m) + begins);
    }
  }
  return pair;
}

}  // namespace

class SharedFieldTest : public QObject {
  Q_OBJECT
 private slots:
  /// The density of 3 n values under their joint normal law, written out whole: kernels, noise, the rig's own error at
  /// places that both have, a change that only the later rows see, and shifts of 0.1 m SD a recording.
  void evidenceIsTheJointDensity() {
    FieldReadings later = readingsAt(6, 0, 4);
    FieldReadings earlier = readingsAt(5, 0, 3);
    earlier.rig_variances.setConstant(0.6 * kNoise_m * kNoise_m);
    later.rig_variances.setConstant(0.6 * kNoise_m * kNoise_m);
    const FieldReadings both = joined(earlier, later, placesFrom(2, 6));  // Three of the later places are new.
    SharedLaw law;
    law.field = {.length_m = 0.7, .by_place = 0.02};
    law.rig_share = 0.5;
    law.noise_factor = {1.0, 2.0};
    const Eigen::Vector3d middle_m(0.1, 0.2, 0.3);
    const ChangeLaw change{{.length_m = 0.4, .by_place = 0.005}, middle_m, 0.5};
    const auto n = static_cast<Eigen::Index>(both.size());
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    Eigen::VectorXd y(3 * n);
    const auto matern = [](double r) {
      return (1.0 + std::sqrt(5.0) * r + 5.0 * r * r / 3.0) * std::exp(-std::sqrt(5.0) * r);
    };
    for (Eigen::Index i = 0; i < n; ++i) {
      y.segment<3>(3 * i) = both.values.row(i).transpose();
      for (Eigen::Index j = 0; j < n; ++j) {
        const auto a = static_cast<std::size_t>(i);
        const auto b = static_cast<std::size_t>(j);
        const double apart = (both.points[a].place_m - both.points[b].place_m).norm();
        double c = 4e-4 * matern(apart / 0.7);
        const double factor = (i < 5 ? 1.0 : 2.0) * (j < 5 ? 1.0 : 2.0);
        if (i == j) c += factor * 1e-6;
        if (i != j && both.places[a] == both.places[b]) c += 0.5 * factor * 0.6e-6;
        const double apart2 =
            (both.points[a].place_m - middle_m).squaredNorm() + (both.points[b].place_m - middle_m).squaredNorm();
        if (i >= 5 && j >= 5) c += 2.5e-5 * matern(apart / 0.4) * std::exp(-apart2 / 0.5);
        if ((i < 5) == (j < 5)) c += 0.01;
        C.block<3, 3>(3 * i, 3 * j) = c * Eigen::Matrix3d::Identity();
      }
    }
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(C);
    const double expected = -0.5 * (y.dot(lu.solve(y)) + std::log(lu.determinant()) +
                                    static_cast<double>(3 * n) * std::log(2.0 * std::numbers::pi));
    FT_VERIFY_MATCH(near(SharedField(both, law, change).logEvidence(), expected, 1e-6 * std::abs(expected)));
  }

  /// What is shared is told at places that were not there, within what it says of itself.
  void foretellsOtherPlaces() {
    const FieldReadings readings = readingsAt(120, 0, 5);
    FieldReadings unshifted = readings;
    unshifted.free.clear();
    const SharedField field(unshifted, likeliestSharedLaw(unshifted, {}));
    std::mt19937 draw(6);
    std::uniform_real_distribution<double> place(-0.5, 0.5);
    double z2 = 0.0;
    for (int i = 0; i < 200; ++i) {
      const FieldPoint point{{place(draw), place(draw), place(draw)}, Eigen::Quaterniond::Identity(), 0.0};
      const double error2 = (field.sharedAt(point, -1) - fieldAt(point.place_m)).squaredNorm() / 3.0;
      QVERIFY(error2 < kNoise_m * kNoise_m);
      z2 += error2 / field.sharedVarianceAt(point, -1) / 200.0;
    }
    QVERIFY2(z2 > 0.1 && z2 < 2.0, std::to_string(z2).c_str());
  }

  /// Two recordings at other places of one field: no change; with a bump of 8 mm in one corner: a change, put there.
  void seesWhatChanged() {
    const FieldReadings same = pairOf(0.0);
    const FieldComparison none = compareFields(same, {}, 0.2);
    QVERIFY2(none.log_odds < 0.0, std::to_string(none.log_odds).c_str());
    const FieldReadings changed = pairOf(0.008);
    const FieldComparison some = compareFields(changed, {}, 0.2);
    QVERIFY2(some.log_odds > Thresholds{}.sure_of_change, std::to_string(some.log_odds).c_str());
    const SharedField field(changed, some.earlier, some.change);
    const auto at = [&](double x) {
      return field.changeAt({Eigen::Vector3d::Constant(x), Eigen::Quaterniond::Identity(), 0.0});
    };
    QVERIFY(at(0.3).z() - at(-0.4).z() > 0.002);
  }

  /// Of changes as wide as half the region's diagonal, those of a third of what is said to show do not show, and those
  /// of three times as much do.
  void saysWhatWouldShow() {
    constexpr int kChanges = 6;
    const double least = compareFields(pairOf(0.0), {}, 0.2).least_shown;
    int small_shown = 0;
    int large_shown = 0;
    for (unsigned seed = 1; seed <= kChanges; ++seed) {
      small_shown +=
          compareFields(changedBy(least / 3.0, seed), {}, 0.2).log_odds > Thresholds{}.sure_of_change ? 1 : 0;
      large_shown +=
          compareFields(changedBy(3.0 * least, seed), {}, 0.2).log_odds > Thresholds{}.sure_of_change ? 1 : 0;
    }
    QCOMPARE(small_shown, 0);
    QVERIFY2(large_shown >= kChanges - 1, std::to_string(large_shown).c_str());
  }
};

FIELDTRUE_TEST(SharedFieldTest)
#include "shared_field_test.moc"
