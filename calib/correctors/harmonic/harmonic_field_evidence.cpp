#include "calib/correctors/harmonic/harmonic_field_evidence.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "calib/core/error.h"
#include "calib/correctors/harmonic/six_columns.h"
#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
namespace {

using GroupVector = Eigen::Matrix<double, kPerSource, 1>;

/// The smallest prior variance worth telling from none, in squared units; the search is logarithmic from there up to 1.
constexpr double kSmallestVariance = 1e-12;
/// Variance of the noise, in units of the one stated.
constexpr double kLeastNoise = 1e-30;

/// A^T B; a group's columns are six.
Eigen::MatrixXd thinTransposedTimes(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::MatrixXd& b) {
  FT_CHECK(a.rows() == b.rows() && a.outerStride() == a.rows());
  if (a.cols() != kPerSource) return transposedTimes(a, b);
  Eigen::MatrixXd product(kPerSource, b.cols());
  sixColumnsTimes(a.data(), b.data(), static_cast<std::size_t>(b.rows()), static_cast<std::size_t>(b.cols()),
                  product.data());
  return product;
}

/// L^-1 of a matrix L L^T without an eigenvalue below 1; where those above are so large that rounding hides it, of one
/// as near to it as rounding is.
Eigen::MatrixXd rootInverseOf(const Eigen::MatrixXd& matrix) {
  constexpr double kMostRounding = 1e-6;
  Eigen::MatrixXd root = matrix;
  for (double rounding = 1e-15; !choleskyInPlace(root) && rounding < kMostRounding; rounding *= 10.0) {
    root = matrix;
    root.diagonal() *= 1.0 + rounding;
  }
  lowerInverseInPlace(root);
  root.triangularView<Eigen::StrictlyUpper>().setZero();
  return root;
}

/// Posterior of the chosen groups' unknowns. With the prior's SDs S and the data's precision P it is kept as L^-1 of
/// 1 + S P S = L L^T: its covariance is S L^-T L^-1 S.
class Posterior {
 public:
  Posterior(const GroupedSystem& system, double noise_factor, Eigen::Index likely)
      : system_(system), noise_factor_(noise_factor) {
    const Eigen::MatrixXd made = system.rows(0, likely);
    for (Eigen::Index g = 0; g < likely; ++g) made_.emplace(g, made.middleRows<kPerSource>(kPerSource * g));
  }

  std::vector<Eigen::Index> groups;
  std::vector<double> variance;
  double noise_factor() const { return noise_factor_; }
  void setNoiseFactor(double factor) { noise_factor_ = factor; }

  const Eigen::VectorXd& mean() const { return mean_; }
  const Eigen::MatrixXd& rows() const { return rows_; }  ///< Gram matrix, the chosen rows by every column.

  /// R with R^T R = C covariance C^T for the Gram matrix' chosen columns C.
  Eigen::MatrixXd explainedRoot() const {
    Eigen::MatrixXd root = sd_.asDiagonal() * rows_;
    lowerTimesInPlace(root_inverse_, root);
    return root;
  }

  /// Gathers the chosen rows: to be called after the groups changed.
  void gather() {
    rows_.resize(size(), system_.right().size());
    for (std::size_t k = 0; k < groups.size(); ++k) {
      auto made = made_.find(groups[k]);
      if (made == made_.end()) made = made_.emplace(groups[k], system_.rows(groups[k], 1)).first;
      rows_.middleRows<kPerSource>(start(k)) = made->second;
    }
    gram_.resize(size(), size());
    right_.resize(size());
    for (std::size_t k = 0; k < groups.size(); ++k) {
      gram_.middleCols<kPerSource>(start(k)) = rows_.middleCols<kPerSource>(kPerSource * groups[k]);
      right_.segment<kPerSource>(start(k)) = system_.right().segment<kPerSource>(kPerSource * groups[k]);
    }
  }

  void solve() {
    sd_.resize(size());
    for (std::size_t k = 0; k < groups.size(); ++k)
      sd_.segment<kPerSource>(start(k)).setConstant(std::sqrt(variance[k]));
    Eigen::MatrixXd h = gram_;
    for (Eigen::Index j = 0; j < size(); ++j) h.col(j).array() *= sd_.array() * (sd_[j] / noise_factor_);
    h.diagonal().array() += 1.0;
    root_inverse_ = rootInverseOf(h);
    const Eigen::VectorXd forward = root_inverse_ * sd_.cwiseProduct(right_);
    mean_ = sd_.cwiseProduct(root_inverse_.transpose() * forward) / noise_factor_;
  }

  /// Unknowns of a group that the data determines, 0 to kPerSource.
  double freedom(std::size_t k) const {
    return static_cast<double>(kPerSource) - root_inverse_.middleCols<kPerSource>(start(k)).squaredNorm();
  }

  /// Sum of squares that the chosen groups leave, and what the noise must then be.
  double noiseShown() const {
    double freedom_all = 0.0;
    for (std::size_t k = 0; k < groups.size(); ++k) freedom_all += freedom(k);
    const double explained = groups.empty() ? 0.0 : 2.0 * mean_.dot(right_) - mean_.dot(gram_ * mean_);
    return std::max(0.0, system_.y_squared() - explained) / std::max(1.0, system_.n_rows() - freedom_all);
  }

 private:
  Eigen::Index size() const { return kPerSource * static_cast<Eigen::Index>(groups.size()); }
  static Eigen::Index start(std::size_t k) { return kPerSource * static_cast<Eigen::Index>(k); }

  const GroupedSystem& system_;
  double noise_factor_;
  std::map<Eigen::Index, Eigen::MatrixXd> made_;  ///< Rows of every group that was chosen once.
  Eigen::MatrixXd rows_;
  Eigen::MatrixXd gram_;  ///< Of the chosen groups alone.
  Eigen::VectorXd right_;
  Eigen::VectorXd sd_;
  Eigen::MatrixXd root_inverse_;
  Eigen::VectorXd mean_;
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

constexpr int kVariancesPerDecade = 4;
constexpr int kDecadesOfVariance = 12;

/// Prior variances that are tried, in units of the smallest.
const std::array<double, kVariancesPerDecade * kDecadesOfVariance + 1>& triedVariances() {
  static const auto kTried = [] {
    std::array<double, kVariancesPerDecade * kDecadesOfVariance + 1> tried{};
    for (std::size_t i = 0; i < tried.size(); ++i)
      tried[i] = std::pow(10.0, static_cast<double>(i) / kVariancesPerDecade);
    return tried;
  }();
  return kTried;
}

/// What every group would add on top of those chosen.
class Offers {
 public:
  Offers(const GroupedSystem& system, const Posterior& posterior)
      : system_(system),
        noise_(posterior.noise_factor()),
        pull_(system.right()),
        is_chosen_(static_cast<std::size_t>(system.groups()), 0) {
    if (posterior.groups.empty()) return;
    pull_.noalias() -= posterior.rows().transpose() * posterior.mean();
    explained_root_ = posterior.explainedRoot();
    for (const Eigen::Index group : posterior.groups) is_chosen_[static_cast<std::size_t>(group)] = 1;
  }

  /// Nothing of a group that is chosen.
  Offer of(Eigen::Index group) const {
    Offer best;
    if (is_chosen_[static_cast<std::size_t>(group)] != 0) return best;
    const Eigen::SelfAdjointEigenSolver<GroupMatrix> eigen(precisionOf(group));
    const Eigen::Array<double, kPerSource, 1> lambda = eigen.eigenvalues().cwiseMax(0.0).array();
    const Eigen::Array<double, kPerSource, 1> q2 = (eigen.eigenvectors().transpose() * pullOf(group)).array().square();
    const double least = kSmallestVariance * system_.unit_m() * system_.unit_m();
    for (const double tried : triedVariances()) {
      const double variance = least * tried;
      const Eigen::Array<double, kPerSource, 1> spread = 1.0 + variance * lambda;
      const double gain = 0.5 * (variance * q2 / spread).sum() - 0.5 * std::log(spread.prod());
      if (gain > best.gain) best = {gain, variance};
    }
    return best;
  }

  /// The group whose offer is the greatest, and its offer; none where no gain is as large as the least.
  std::optional<std::pair<Eigen::Index, Offer>> best(double least_gain) const {
    std::vector<std::pair<double, Eigen::Index>> most;
    for (Eigen::Index g = 0; g < system_.groups(); ++g) {
      const double gain = mostOf(g);
      if (gain >= least_gain) most.emplace_back(gain, g);
    }
    std::sort(most.begin(), most.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    std::optional<std::pair<Eigen::Index, Offer>> best;
    for (const auto& [at_most, group] : most) {
      if (best && at_most < best->second.gain) break;
      const Offer offer = of(group);
      const bool is_better =
          !best || offer.gain > best->second.gain || (offer.gain == best->second.gain && group < best->first);
      if (offer.gain >= least_gain && is_better) best = {group, offer};
    }
    return best;
  }

 private:
  /// A gain that no prior variance exceeds: half of what the data would fall by without a prior. Far cheaper than the
  /// best variance, it spares most groups the search for theirs.
  double mostOf(Eigen::Index group) const {
    constexpr double kNoWorseConditioned = 1e-9;
    if (is_chosen_[static_cast<std::size_t>(group)] != 0) return 0.0;
    const GroupMatrix precision = precisionOf(group);
    const Eigen::LLT<GroupMatrix> factor(precision);
    const double least_pivot = factor.matrixLLT().diagonal().cwiseAbs2().minCoeff();
    if (factor.info() != Eigen::Success || !(least_pivot > kNoWorseConditioned * precision.trace())) return HUGE_VAL;
    return 0.5 * factor.matrixL().solve(pullOf(group)).squaredNorm();
  }

  /// Of the group's unknowns given the groups chosen, from the data alone.
  GroupMatrix precisionOf(Eigen::Index group) const {
    GroupMatrix precision = system_.block(group) / noise_;
    if (explained_root_.size() == 0) return precision;
    const auto root = explained_root_.middleCols<kPerSource>(kPerSource * group);
    precision -= root.transpose().lazyProduct(root) / (noise_ * noise_);
    return precision;
  }

  /// A^T of the residual over the noise.
  GroupVector pullOf(Eigen::Index group) const { return pull_.segment<kPerSource>(kPerSource * group) / noise_; }

  const GroupedSystem& system_;
  double noise_;
  Eigen::VectorXd pull_;
  Eigen::MatrixXd explained_root_;
  std::vector<char> is_chosen_;
};

void findNoise(Posterior& posterior) {
  posterior.setNoiseFactor(std::max(kLeastNoise, posterior.noiseShown()));
  posterior.solve();
}

/// @param gain of every group, were it added after the last
void addGroups(Posterior& posterior, Eigen::VectorXd& gain, const GroupedSystem& system,
               const GroupSelectionOptions& options, const RunControl& control) {
  constexpr int kStepsEach = 3;
  if (options.noise_unknown)
    posterior.setNoiseFactor(std::max(kLeastNoise, system.y_squared() / std::max(1.0, system.n_rows())));
  for (std::size_t tries = 0; tries < 2 * options.most_groups + 1 && !control.stop.stop_requested(); ++tries) {
    const Offers offers(system, posterior);
    const bool is_full = posterior.groups.size() >= options.most_groups;
    const auto best = is_full ? std::nullopt : offers.best(options.least_gain);
    if (!best || tries == 2 * options.most_groups)
      for (Eigen::Index g = 0; g < system.groups(); ++g) gain[g] = offers.of(g).gain;
    if (!best) break;
    posterior.groups.push_back(best->first);
    posterior.variance.push_back(best->second.variance);
    posterior.gather();
    posterior.solve();
    improveVariances(posterior, system, kStepsEach);
    if (options.noise_unknown) findNoise(posterior);
  }
}

void takeChosen(Posterior& posterior, const GroupSelectionOptions& options) {
  posterior.variance = options.chosen_variances;
  posterior.groups.resize(posterior.variance.size());
  std::iota(posterior.groups.begin(), posterior.groups.end(), Eigen::Index{0});
  posterior.gather();
  posterior.solve();
  if (options.noise_unknown) findNoise(posterior);
}

}  // namespace

GroupedSystem::GroupedSystem(const Eigen::MatrixXd& design, const Eigen::MatrixXd& nuisance, const Eigen::VectorXd& y,
                             double unit_m)
    : design_(design),
      of_nuisance_(thinTransposedTimes(nuisance, design)),
      n_rows_(static_cast<double>(design.rows() - nuisance.cols())),
      unit_m_(unit_m) {
  const Eigen::VectorXd rest = y - nuisance * (nuisance.transpose() * y);
  right_ = design.transpose() * rest;
  y_squared_ = rest.squaredNorm();
  for (Eigen::Index at = 0; at < design.cols(); at += kPerSource) {
    const Eigen::MatrixXd own = design.middleCols<kPerSource>(at);
    const auto of_nuisance = of_nuisance_.middleCols<kPerSource>(at);
    blocks_.emplace_back(thinTransposedTimes(own, own) - of_nuisance.transpose() * of_nuisance);
  }
}

Eigen::MatrixXd GroupedSystem::rows(Eigen::Index first_group, Eigen::Index count) const {
  const Eigen::Index first = kPerSource * first_group, n = kPerSource * count;
  return thinTransposedTimes(design_.middleCols(first, n), design_) -
         transposedTimes(of_nuisance_.middleCols(first, n), of_nuisance_);
}

GroupSelection selectGroups(const GroupedSystem& system, const GroupSelectionOptions& options,
                            const RunControl& control) {
  constexpr int kStepsLast = 12;
  Posterior posterior(system, options.noise_factor, options.likely);
  GroupSelection selection;
  selection.gain = Eigen::VectorXd::Zero(system.groups());
  if (options.chosen_variances.empty())
    addGroups(posterior, selection.gain, system, options, control);
  else
    takeChosen(posterior, options);
  improveVariances(posterior, system, kStepsLast);

  selection.groups = posterior.groups;
  selection.prior_variance = Eigen::Map<const Eigen::VectorXd>(posterior.variance.data(),
                                                               static_cast<Eigen::Index>(posterior.variance.size()));
  selection.amplitudes = posterior.groups.empty() ? Eigen::VectorXd() : posterior.mean();
  selection.noise_factor = posterior.noiseShown();
  return selection;
}

}  // namespace fieldtrue::correctors
