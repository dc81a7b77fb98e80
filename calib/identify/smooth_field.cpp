#include "calib/identify/smooth_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace fieldtrue::identify {
namespace {

constexpr std::size_t kRowsForLaw = 160;

double matern52(double distance) {
  const double d = std::sqrt(5.0) * distance;
  return (1.0 + d + d * d / 3.0) * std::exp(-d);
}

/// 1 for the same turn, down to e^-8 for half a revolution. |R - R'|^2 = 8 sin^2(angle / 2).
double sameTurn(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  constexpr double kWidth2 = 0.25;
  const double cosine_half = std::min(1.0, std::abs(a.dot(b)));
  return std::exp(-2.0 * (1.0 - cosine_half * cosine_half) / kWidth2);
}

double logDensity(const Eigen::LLT<Eigen::MatrixXd>& factor, const Eigen::MatrixX3d& values,
                  const Eigen::MatrixX3d& weights) {
  const double log_determinant = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
  const auto n = static_cast<double>(values.rows());
  return -0.5 * values.cwiseProduct(weights).sum() - 1.5 * (log_determinant + n * std::log(2.0 * std::numbers::pi));
}

/// The density of some rows under many laws: the kernels of each length are made once.
class LawSearch {
 public:
  LawSearch(std::span<const FieldPoint> points, const Eigen::MatrixX3d& values, const Eigen::VectorXd& variances,
            const SmoothParts& parts)
      : points_(points), values_(values), variances_(variances), parts_(parts) {
    Eigen::AlignedBox3d box;
    double first_s = std::numeric_limits<double>::infinity();
    double last_s = -first_s;
    for (const FieldPoint& point : points) {
      box.extend(point.place_m);
      first_s = std::min(first_s, point.time_s);
      last_s = std::max(last_s, point.time_s);
    }
    extent_m_ = std::max(1e-3, box.sizes().norm());
    duration_s_ = std::max(1e-3, last_s - first_s);
    const double mean_square = values.squaredNorm() / static_cast<double>(3 * values.rows());
    unit_ = std::sqrt(std::max(mean_square - variances.mean(), 0.05 * variances.mean()));
  }

  SmoothLaw run() {
    SmoothLaw best;
    best.length_m = 0.5 * extent_m_;
    best.time_s = 0.5 * duration_s_;
    best.far_m = extent_m_;
    double most = evidenceOf(best);
    const SmoothLaw nothing = best;
    const double of_nothing = most;
    for (const double length : {0.125, 0.25, 0.5, 1.0}) {
      SmoothLaw law = nothing;
      law.length_m = length * extent_m_;
      makeKernels(law.length_m);
      const double found = climb(law, of_nothing);
      if (found > most) {
        most = found;
        best = law;
      }
    }
    return best;
  }

 private:
  static constexpr std::array<double, 6> kSizes = {0.0, 0.25, 0.5, 1.0, 2.0, 4.0};

  void makeKernels(double length_m) {
    const auto n = static_cast<Eigen::Index>(points_.size());
    const SmoothLaw place{.length_m = length_m, .by_place = 1.0};
    const SmoothLaw turn{.length_m = length_m, .by_turn = 1.0};
    for (Eigen::MatrixXd* kernel : {&place_, &turn_}) kernel->resize(n, parts_.turn || kernel == &place_ ? n : 0);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        const FieldPoint& a = points_[static_cast<std::size_t>(i)];
        const FieldPoint& b = points_[static_cast<std::size_t>(j)];
        place_(i, j) = covariance(place, a, b);
        if (parts_.turn) turn_(i, j) = covariance(turn, a, b);
      }
    }
  }

  void makeTimeKernel(double time_s) {
    const auto n = static_cast<Eigen::Index>(points_.size());
    const SmoothLaw time{.time_s = time_s, .far_m = extent_m_, .by_time = 1.0};
    time_.resize(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j <= i; ++j)
        time_(i, j) = covariance(time, points_[static_cast<std::size_t>(i)], points_[static_cast<std::size_t>(j)]);
    time_of_kernel_s_ = time_s;
  }

  double evidenceOf(const SmoothLaw& law) {
    const auto n = static_cast<Eigen::Index>(points_.size());
    if (law.isNothing()) {
      const double squares = variances_.cwiseInverse().dot(values_.rowwise().squaredNorm());
      return -0.5 * squares -
             1.5 * (variances_.array().log().sum() + static_cast<double>(n) * std::log(2.0 * std::numbers::pi));
    }
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
    if (law.by_place > 0.0) matrix += law.by_place * law.by_place * place_;
    if (law.by_turn > 0.0) matrix += law.by_turn * law.by_turn * turn_;
    if (law.by_time > 0.0) {
      if (time_of_kernel_s_ != law.time_s) makeTimeKernel(law.time_s);
      matrix += law.by_time * law.by_time * time_;
    }
    matrix.diagonal() += variances_;
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    const Eigen::MatrixX3d weights = factor.solve(values_);
    const double evidence = logDensity(factor, values_, weights);
    return std::isfinite(evidence) ? evidence : -std::numeric_limits<double>::infinity();
  }

  /// Each size in turn, twice over.
  double climb(SmoothLaw& law, double most) {
    std::vector<double SmoothLaw::*> sizes = {&SmoothLaw::by_place};
    if (parts_.turn) sizes.push_back(&SmoothLaw::by_turn);
    if (parts_.time) sizes.push_back(&SmoothLaw::by_time);
    for (int round = 0; round < (sizes.size() > 1 ? 2 : 1); ++round) {
      for (double SmoothLaw::*size : sizes) {
        SmoothLaw tried = law;
        for (const double factor : kSizes) {
          tried.*size = factor * unit_;
          if (tried.*size == law.*size) continue;
          const double evidence = evidenceOf(tried);
          if (evidence <= most) continue;
          most = evidence;
          law = tried;
        }
      }
    }
    return most;
  }

  std::span<const FieldPoint> points_;
  const Eigen::MatrixX3d& values_;
  const Eigen::VectorXd& variances_;
  SmoothParts parts_;
  double extent_m_ = 1.0;
  double duration_s_ = 1.0;
  double unit_ = 1.0;
  Eigen::MatrixXd place_;  ///< Lower triangles.
  Eigen::MatrixXd turn_;
  Eigen::MatrixXd time_;
  double time_of_kernel_s_ = -1.0;
};

}  // namespace

double covariance(const SmoothLaw& law, const FieldPoint& a, const FieldPoint& b) {
  double sum = 0.0;
  if (law.by_place > 0.0 || law.by_turn > 0.0) {
    const double near = matern52((a.place_m - b.place_m).norm() / law.length_m);
    sum += law.by_place * law.by_place * near;
    if (law.by_turn > 0.0) sum += law.by_turn * law.by_turn * near * sameTurn(a.turned, b.turned);
  }
  if (law.by_time > 0.0) {
    sum += law.by_time * law.by_time * matern52(std::abs(a.time_s - b.time_s) / law.time_s) *
           matern52((a.place_m - b.place_m).norm() / law.far_m);
  }
  return sum;
}

SmoothField::SmoothField(std::vector<FieldPoint> points, const Eigen::MatrixX3d& values,
                         const Eigen::VectorXd& variances, const SmoothLaw& law)
    : points_(std::move(points)), law_(law) {
  const auto n = static_cast<Eigen::Index>(points_.size());
  Eigen::MatrixXd matrix = variances.asDiagonal();
  if (!law.isNothing()) {
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j <= i; ++j)
        matrix(i, j) += covariance(law, points_[static_cast<std::size_t>(i)], points_[static_cast<std::size_t>(j)]);
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  weights_ = factor.solve(values);
  log_evidence_ = logDensity(factor, values, weights_);
}

Eigen::Vector3d SmoothField::at(const FieldPoint& point) const {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  if (law_.isNothing()) return value;
  for (std::size_t i = 0; i < points_.size(); ++i)
    value += covariance(law_, points_[i], point) * weights_.row(static_cast<Eigen::Index>(i)).transpose();
  return value;
}

std::vector<std::size_t> evenChoice(std::size_t n, std::size_t most) {
  std::vector<std::size_t> chosen;
  const std::size_t count = std::min(n, most);
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(k * n / count);
  return chosen;
}

SmoothLaw likeliestLaw(std::span<const FieldPoint> points, const Eigen::MatrixX3d& values,
                       const Eigen::VectorXd& variances, const SmoothParts& parts) {
  const std::vector<std::size_t> chosen = evenChoice(points.size(), kRowsForLaw);
  std::vector<FieldPoint> some_points;
  Eigen::MatrixX3d some_values(static_cast<Eigen::Index>(chosen.size()), 3);
  Eigen::VectorXd some_variances(static_cast<Eigen::Index>(chosen.size()));
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    some_points.push_back(points[chosen[k]]);
    some_values.row(static_cast<Eigen::Index>(k)) = values.row(static_cast<Eigen::Index>(chosen[k]));
    some_variances[static_cast<Eigen::Index>(k)] = variances[static_cast<Eigen::Index>(chosen[k])];
  }
  return LawSearch(some_points, some_values, some_variances, parts).run();
}

}  // namespace fieldtrue::identify
