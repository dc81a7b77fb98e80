#include "calib/identify/scan.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/identify/refine.h"

namespace fieldtrue::identify {
namespace {

/// Cross products of the columns [nuisance, effect, residual] over some rows.
using Gram = Eigen::MatrixXd;

/// What effects are added to: least squares of the residual by the nuisance alone, columns scaled to unit length; a
/// column that others make up gets next to nothing.
class NuisanceFit {
 public:
  /// @param gram of [nuisance, residual]
  explicit NuisanceFit(const Gram& gram) {
    const Eigen::Index q = gram.cols() - 1;
    scale_ = unitScales(gram.diagonal().head(q));
    Eigen::MatrixXd normal = scale_.asDiagonal() * gram.topLeftCorner(q, q) * scale_.asDiagonal();
    normal.diagonal().array() += kRidge;
    factor_.compute(normal);
    forward_ = factor_.matrixL().solve(scale_.cwiseProduct(gram.col(q).head(q)));
  }

  struct Solution {
    Eigen::VectorXd nuisance;
    Eigen::VectorXd effect;
    double gain = 0.0;  ///< What the effect takes off the sum of squares beyond the nuisance.
  };

  Solution alone() const { return {scale_.cwiseProduct(factor_.matrixU().solve(forward_)), {}, 0.0}; }

  /// @param own Gram matrix of the effect's columns
  /// @param mixed products of these (rows) and [nuisance, residual]
  Solution with(const Gram& own, const Gram& mixed, const LinearPrior& prior) const {
    const Eigen::Index q = scale_.size();
    const Eigen::Index m = own.cols();
    const Eigen::VectorXd scale = unitScales(own.diagonal());
    const Eigen::MatrixXd across = factor_.matrixL().solve(
        Eigen::MatrixXd(scale_.asDiagonal() * mixed.leftCols(q).transpose() * scale.asDiagonal()));
    Eigen::MatrixXd rest = scale.asDiagonal() * own * scale.asDiagonal();
    rest.noalias() -= across.transpose().lazyProduct(across);
    rest.diagonal().array() += kRidge;
    rest.diagonal() += scale.cwiseAbs2().cwiseProduct(prior.precision);
    const Eigen::VectorXd pull = scale.cwiseProduct(mixed.col(q)) - across.transpose() * forward_;
    Eigen::VectorXd y = rest.llt().solve(pull);
    if (m == 1) {
      const double x = std::clamp(scale[0] * y[0], prior.low, prior.high);
      if (x != scale[0] * y[0]) y[0] = scale[0] > 0.0 ? x / scale[0] : 0.0;
    }
    Solution solution;
    solution.gain = 2.0 * pull.dot(y) - y.dot(rest * y);
    solution.effect = scale.cwiseProduct(y);
    solution.nuisance = scale_.cwiseProduct(factor_.matrixU().solve(forward_ - across * y));
    return solution;
  }

 private:
  static constexpr double kRidge = 1e-9;

  static Eigen::VectorXd unitScales(const Eigen::VectorXd& squares) {
    return squares.unaryExpr([](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 0.0; });
  }

  Eigen::VectorXd scale_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd forward_;
};

/// Residual sum of squares of the nuisance of a solution on other rows.
double heldOut(const Gram& gram, const Eigen::VectorXd& x) {
  const Eigen::Index n = x.size();
  return gram(n, n) - 2.0 * x.dot(gram.col(n).head(n)) + x.dot(gram.topLeftCorner(n, n) * x);
}

/// The same with an effect.
double heldOut(const Gram& gram, const Gram& own, const Gram& mixed, const NuisanceFit::Solution& x) {
  const Eigen::Index q = x.nuisance.size();
  const Eigen::VectorXd of_nuisance = mixed.leftCols(q) * x.nuisance - mixed.col(q);
  return heldOut(gram, x.nuisance) + x.effect.dot(own * x.effect) + 2.0 * x.effect.dot(of_nuisance);
}

}  // namespace

class Scanner::Products {
 public:
  explicit Products(const Linearized& at) : at_(at) {
    const Eigen::Index q = at.nuisance().cols();
    fixed_.resize(at.size(), q + 1);
    fixed_.leftCols(q) = at.nuisance();
    fixed_.col(q) = at.residual();
    for (const Segment& segment : blocks()) fixed_grams_.push_back(product(segment, fixed_, fixed_));
    const Gram total = sum(fixed_grams_);
    fits_.emplace_back(total);
    for (std::size_t b = 0; b < at.segments().size(); ++b) {
      fits_.emplace_back(total - fixed_grams_[b]);
      base_held_out_.push_back(heldOut(fixed_grams_[b], fits_.back().alone().nuisance));
    }
  }

  const Linearized& at() const { return at_; }

  struct Tried {
    double gain = 0.0;
    std::vector<double> without;
    std::vector<double> held_out;
  };

  Tried tryColumns(const Eigen::MatrixXd& columns, const LinearPrior& prior) const {
    std::vector<Gram> own;
    std::vector<Gram> mixed;
    for (const Segment& segment : blocks()) {
      own.push_back(product(segment, columns, columns));
      mixed.push_back(product(segment, columns, fixed_));
    }
    const Gram all_own = sum(own);
    const Gram all_mixed = sum(mixed);
    Tried tried;
    tried.gain = fits_.front().with(all_own, all_mixed, prior).gain;
    for (std::size_t b = 0; b < at_.segments().size(); ++b) {
      const NuisanceFit::Solution without = fits_[b + 1].with(all_own - own[b], all_mixed - mixed[b], prior);
      tried.without.push_back(without.gain);
      tried.held_out.push_back(base_held_out_[b] - heldOut(fixed_grams_[b], own[b], mixed[b], without));
    }
    return tried;
  }

 private:
  /// The hold-out blocks, and behind them the stated tolerances of the alignment where there are any.
  std::vector<Segment> blocks() const {
    std::vector<Segment> blocks(at_.segments().begin(), at_.segments().end());
    const Eigen::Index end = blocks.back().begin + blocks.back().count;
    if (end < at_.size()) blocks.push_back({end, at_.size() - end});
    return blocks;
  }

  static Gram product(const Segment& segment, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    return a.middleRows(segment.begin, segment.count).transpose() * b.middleRows(segment.begin, segment.count);
  }

  static Gram sum(const std::vector<Gram>& grams) {
    Gram total = grams.front();
    for (std::size_t b = 1; b < grams.size(); ++b) total += grams[b];
    return total;
  }

  const Linearized& at_;
  Eigen::MatrixXd fixed_;
  std::vector<Gram> fixed_grams_;
  std::vector<NuisanceFit> fits_;  ///< Of all rows, then without each block.
  std::vector<double> base_held_out_;
};

Scanner::Scanner(const Linearized& at) : products_(std::make_shared<const Products>(at)) {}

std::vector<Eigen::VectorXd> startsAt(const effects::EffectFit& fit, std::span<const Eigen::Vector3d> centers_m) {
  std::vector<Eigen::VectorXd> others;
  for (const Eigen::VectorXd& start : fit.starts()) {
    const Eigen::VectorXd other = start.tail(start.size() - 3);
    const bool is_new =
        std::none_of(others.begin(), others.end(), [&](const Eigen::VectorXd& o) { return o.isApprox(other, 1e-9); });
    if (is_new) others.push_back(other);
    if (other.size() == 0) break;
  }
  std::vector<Eigen::VectorXd> starts;
  for (const Eigen::Vector3d& center_m : centers_m) {
    for (const Eigen::VectorXd& other : others) {
      Eigen::VectorXd start(3 + other.size());
      start << center_m, other;
      starts.push_back(std::move(start));
    }
  }
  return starts;
}

ScanResult Scanner::scan(const effects::EffectFit& fit, std::vector<Eigen::VectorXd> starts, std::size_t kept,
                         const RunControl& control) const {
  std::erase_if(starts, [&](const Eigen::VectorXd& start) { return !fit.allows(start); });
  const Linearized& at = products_->at();
  const LinearPrior prior = priorOf(fit);
  std::vector<Products::Tried> tried(starts.size());
  control.parallel_for(starts.size(), [&](std::size_t i) {
    if (!control.stop.stop_requested()) tried[i] = products_->tryColumns(at.columns(fit, starts[i]), prior);
  });
  ScanResult result;
  if (control.stop.stop_requested() || starts.empty()) return result;
  std::vector<std::size_t> order(starts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tried[a].gain > tried[b].gain; });
  for (std::size_t i = 0; i < std::min(kept, order.size()); ++i)
    result.best.push_back({starts[order[i]], tried[order[i]].gain});
  for (std::size_t b = 0; b < at.segments().size(); ++b) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < starts.size(); ++i)
      if (tried[i].without[b] > tried[best].without[b]) best = i;
    result.without_block.push_back({starts[best], tried[best].without[b]});
    result.held_out_gain.push_back(tried[best].held_out[b]);
  }
  return result;
}

double Scanner::heldOutGainFrom(const effects::EffectFit& fit, const Eigen::VectorXd& searched) const {
  const Linearized& at = products_->at();
  const LinearPrior prior = priorOf(fit);
  double gain = 0.0;
  for (std::size_t b = 0; b < at.segments().size(); ++b) {
    const LocalFit settled = LocalFitter(at, b).from(fit, searched);
    gain += products_->tryColumns(at.columns(fit, settled.searched), prior).held_out[b];
  }
  return gain;
}

}  // namespace fieldtrue::identify
