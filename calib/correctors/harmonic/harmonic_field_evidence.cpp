#include "calib/correctors/harmonic/harmonic_field_evidence.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
namespace {

using GroupVector = Eigen::Matrix<double, kPerSource, 1>;

/// The smallest prior variance worth telling from none, in squared units; the search is logarithmic from there up to 1.
constexpr double kSmallestVariance = 1e-12;

/// Inverse of a matrix without an eigenvalue below 1; where those above are so large that rounding hides it, of one as
/// near to it as rounding is.
Eigen::MatrixXd inverseOf(const Eigen::MatrixXd& matrix) {
  constexpr double kMostRounding = 1e-6;
  Eigen::MatrixXd inverse = matrix;
  for (double rounding = 1e-15; !choleskyInPlace(inverse) && rounding < kMostRounding; rounding *= 10.0) {
    inverse = matrix;
    inverse.diagonal() *= 1.0 + rounding;
  }
  choleskyInverseInPlace(inverse);
  completeSymmetric(inverse);
  return inverse;
}

/// Posterior of the chosen groups' unknowns.
class Posterior {
 public:
  Posterior(const GroupedSystem& system, double noise_factor, Eigen::Index likely)
      : system_(system), noise_factor_(noise_factor) {
    const Eigen::MatrixXd made = system.columns(0, likely);
    for (Eigen::Index g = 0; g < likely; ++g) made_.emplace(g, made.middleCols<kPerSource>(kPerSource * g));
  }

  std::vector<Eigen::Index> groups;
  std::vector<double> variance;
  double noise_factor() const { return noise_factor_; }
  void setNoiseFactor(double factor) { noise_factor_ = factor; }

  const Eigen::VectorXd& mean() const { return mean_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  const Eigen::MatrixXd& columns() const { return columns_; }  ///< Gram matrix, every row by the chosen columns.

  /// Gathers the chosen columns: to be called after the groups changed.
  void gather() {
    columns_.resize(system_.right().size(), size());
    for (std::size_t k = 0; k < groups.size(); ++k) {
      auto made = made_.find(groups[k]);
      if (made == made_.end()) made = made_.emplace(groups[k], system_.columns(groups[k], 1)).first;
      columns_.middleCols(start(k), kPerSource) = made->second;
    }
  }

  void solve() {
    if (groups.empty()) {
      mean_.resize(0);
      right_.resize(0);
      covariance_.resize(0, 0);
      return;
    }
    Eigen::VectorXd sd(size());
    Eigen::VectorXd right(size());
    Eigen::MatrixXd h(size(), size());
    for (std::size_t k = 0; k < groups.size(); ++k) {
      sd.segment(start(k), kPerSource).setConstant(std::sqrt(variance[k]));
      right.segment(start(k), kPerSource) = system_.right().segment(kPerSource * groups[k], kPerSource);
      h.middleRows(start(k), kPerSource) = columns_.middleRows(kPerSource * groups[k], kPerSource);
    }
    h = sd.asDiagonal() * h * sd.asDiagonal() / noise_factor_;
    h.diagonal().array() += 1.0;
    covariance_ = sd.asDiagonal() * inverseOf(h) * sd.asDiagonal();
    mean_ = covariance_ * right / noise_factor_;
    right_ = std::move(right);
  }

  /// Unknowns of a group that the data determines, 0 to kPerSource.
  double freedom(std::size_t k) const {
    return static_cast<double>(kPerSource) - covariance_.diagonal().segment(start(k), kPerSource).sum() / variance[k];
  }

  /// Sum of squares that the chosen groups leave, and what the noise must then be.
  double noiseShown() const {
    double freedom_all = 0.0;
    for (std::size_t k = 0; k < groups.size(); ++k) freedom_all += freedom(k);
    double explained = 0.0;
    if (size() > 0) {
      Eigen::VectorXd product(size());
      for (std::size_t k = 0; k < groups.size(); ++k)
        product.segment(start(k), kPerSource) = columns_.middleRows(kPerSource * groups[k], kPerSource) * mean_;
      explained = 2.0 * mean_.dot(right_) - mean_.dot(product);
    }
    return std::max(0.0, system_.y_squared() - explained) / std::max(1.0, system_.n_rows() - freedom_all);
  }

 private:
  Eigen::Index size() const { return kPerSource * static_cast<Eigen::Index>(groups.size()); }
  static Eigen::Index start(std::size_t k) { return kPerSource * static_cast<Eigen::Index>(k); }

  const GroupedSystem& system_;
  double noise_factor_;
  std::map<Eigen::Index, Eigen::MatrixXd> made_;  ///< Columns of every group that was chosen once.
  Eigen::MatrixXd columns_;
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd mean_;
  Eigen::VectorXd right_;
};

/// MacKay's update of the prior variances, repeated; groups that the data does not determine leave.
void improveVariances(Posterior& posterior, const GroupedSystem& system, int steps) {
  const double least = kSmallestVariance * system.unit_m() * system.unit_m();
  for (int step = 0; step < steps && !posterior.groups.empty(); ++step) {
    std::vector<Eigen::Index> groups;
    std::vector<double> variance;
    for (std::size_t k = 0; k < posterior.groups.size(); ++k) {
      const double freedom = posterior.freedom(k);
      const auto amplitude = posterior.mean().segment(kPerSource * static_cast<Eigen::Index>(k), kPerSource);
      const double better = amplitude.squaredNorm() / std::max(freedom, 1e-9);
      if (freedom < 0.02 || better < least) continue;
      groups.push_back(posterior.groups[k]);
      variance.push_back(better);
    }
    const bool fewer = groups.size() < posterior.groups.size();
    posterior.groups = std::move(groups);
    posterior.variance = std::move(variance);
    if (fewer) posterior.gather();
    posterior.solve();
  }
}

/// What a group would add to the log evidence at its best prior variance.
struct Offer {
  double gain = 0.0;
  double variance = 0.0;
};

/// @param precision of the group's unknowns given the groups chosen, from the data alone
/// @param pull A^T of the residual over the noise
Offer bestOffer(const GroupMatrix& precision, const GroupVector& pull, double unit_m) {
  constexpr int kPerDecade = 4;
  constexpr int kDecades = 12;
  const Eigen::SelfAdjointEigenSolver<GroupMatrix> eigen(precision);
  const Eigen::Array<double, kPerSource, 1> lambda = eigen.eigenvalues().cwiseMax(0.0).array();
  const Eigen::Array<double, kPerSource, 1> q2 = (eigen.eigenvectors().transpose() * pull).array().square();
  Offer best;
  for (int i = 0; i <= kPerDecade * kDecades; ++i) {
    const double variance = kSmallestVariance * unit_m * unit_m * std::pow(10.0, static_cast<double>(i) / kPerDecade);
    const Eigen::Array<double, kPerSource, 1> spread = 1.0 + variance * lambda;
    const double gain = 0.5 * (variance * q2 / spread).sum() - 0.5 * std::log(spread.prod());
    if (gain > best.gain) best = {gain, variance};
  }
  return best;
}

std::vector<Offer> offersOf(const GroupedSystem& system, const Posterior& posterior) {
  const Eigen::Index n_groups = system.groups();
  const double noise = posterior.noise_factor();
  Eigen::VectorXd pull = system.right();
  Eigen::MatrixXd explained;
  if (!posterior.groups.empty()) {
    pull.noalias() -= posterior.columns() * posterior.mean();
    explained = times(posterior.columns(), posterior.covariance());
  }
  std::vector<Offer> offers(static_cast<std::size_t>(n_groups));
  for (Eigen::Index g = 0; g < n_groups; ++g) {
    if (std::count(posterior.groups.begin(), posterior.groups.end(), g) > 0) continue;
    const Eigen::Index at = kPerSource * g;
    GroupMatrix precision = system.block(g) / noise;
    if (!posterior.groups.empty())
      precision.noalias() -= explained.middleRows<kPerSource>(at) *
                             posterior.columns().middleRows<kPerSource>(at).transpose() / (noise * noise);
    const GroupVector q = pull.segment<kPerSource>(at) / noise;
    offers[static_cast<std::size_t>(g)] = bestOffer(precision, q, system.unit_m());
  }
  return offers;
}

}  // namespace

GroupedSystem::GroupedSystem(const Eigen::MatrixXd& design, const Eigen::MatrixXd& nuisance, const Eigen::VectorXd& y,
                             double unit_m)
    : design_(design),
      by_nuisance_(design.transpose() * nuisance),
      n_rows_(static_cast<double>(design.rows() - nuisance.cols())),
      unit_m_(unit_m) {
  const Eigen::VectorXd rest = y - nuisance * (nuisance.transpose() * y);
  right_ = design.transpose() * rest;
  y_squared_ = rest.squaredNorm();
  for (Eigen::Index at = 0; at < design.cols(); at += kPerSource) {
    const auto own = design.middleCols<kPerSource>(at);
    const auto of_nuisance = by_nuisance_.middleRows<kPerSource>(at);
    blocks_.emplace_back(own.transpose() * own - of_nuisance * of_nuisance.transpose());
  }
}

Eigen::MatrixXd GroupedSystem::columns(Eigen::Index first_group, Eigen::Index count) const {
  const Eigen::Index first = kPerSource * first_group, n = kPerSource * count;
  return transposedTimes(design_, design_.middleCols(first, n)) -
         times(by_nuisance_, by_nuisance_.middleRows(first, n).transpose());
}

GroupSelection selectGroups(const GroupedSystem& system, const GroupSelectionOptions& options,
                            const RunControl& control) {
  constexpr int kStepsEach = 3;
  constexpr int kStepsLast = 12;
  constexpr double kLeastNoise = 1e-30;
  Posterior posterior(system, options.noise_factor, options.likely);
  if (options.noise_unknown)
    posterior.setNoiseFactor(std::max(kLeastNoise, system.y_squared() / std::max(1.0, system.n_rows())));
  std::vector<Offer> offers;
  for (std::size_t tries = 0; tries < 2 * options.most_groups + 1 && !control.stop.stop_requested(); ++tries) {
    offers = offersOf(system, posterior);
    const auto best =
        std::max_element(offers.begin(), offers.end(), [](const Offer& a, const Offer& b) { return a.gain < b.gain; });
    if (best == offers.end() || best->gain < options.least_gain || posterior.groups.size() >= options.most_groups)
      break;
    posterior.groups.push_back(best - offers.begin());
    posterior.variance.push_back(best->variance);
    posterior.gather();
    posterior.solve();
    improveVariances(posterior, system, kStepsEach);
    if (options.noise_unknown) {
      posterior.setNoiseFactor(std::max(kLeastNoise, posterior.noiseShown()));
      posterior.solve();
    }
  }
  improveVariances(posterior, system, kStepsLast);

  GroupSelection selection;
  selection.groups = posterior.groups;
  selection.prior_variance = Eigen::Map<const Eigen::VectorXd>(posterior.variance.data(),
                                                               static_cast<Eigen::Index>(posterior.variance.size()));
  selection.amplitudes = posterior.groups.empty() ? Eigen::VectorXd() : posterior.mean();
  selection.gain = Eigen::VectorXd::Zero(system.groups());
  for (std::size_t g = 0; g < offers.size(); ++g) selection.gain[static_cast<Eigen::Index>(g)] = offers[g].gain;
  selection.noise_factor = posterior.noiseShown();
  return selection;
}

}  // namespace fieldtrue::correctors
