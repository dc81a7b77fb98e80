#include "calib/identify/scan.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace fieldtrue::identify {
namespace {

/// Cross products of the columns [nuisance, effect, residual] over some rows.
using Gram = Eigen::MatrixXd;

struct Solution {
  Eigen::VectorXd x;
  double gain = 0.0;  ///< b^T x: what the fit takes off the sum of squares.
};

/// Least squares from cross products by columns scaled to unit length; a column that others make up gets next to
/// nothing. The last columns are those that `prior` is about.
Solution solve(const Gram& gram, const LinearPrior& prior = {}) {
  const Eigen::Index n = gram.cols() - 1;
  Eigen::VectorXd scale(n);
  for (Eigen::Index j = 0; j < n; ++j) scale[j] = gram(j, j) > 0.0 ? 1.0 / std::sqrt(gram(j, j)) : 0.0;
  Eigen::MatrixXd normal = scale.asDiagonal() * gram.topLeftCorner(n, n) * scale.asDiagonal();
  normal.diagonal().array() += 1e-9;
  const Eigen::Index m = prior.precision.size();
  normal.diagonal().tail(m) += scale.tail(m).cwiseAbs2().cwiseProduct(prior.precision);
  const Eigen::VectorXd right = scale.asDiagonal() * gram.col(n).head(n);
  Eigen::VectorXd y = normal.llt().solve(right);
  Solution solution;
  solution.x = scale.asDiagonal() * y;
  if (m == 1 && (solution.x[n - 1] < prior.low || solution.x[n - 1] > prior.high)) {
    solution.x[n - 1] = std::clamp(solution.x[n - 1], prior.low, prior.high);
    y[n - 1] = scale[n - 1] > 0.0 ? solution.x[n - 1] / scale[n - 1] : 0.0;
    const Eigen::VectorXd rest = right.head(n - 1) - normal.col(n - 1).head(n - 1) * y[n - 1];
    y.head(n - 1) = normal.topLeftCorner(n - 1, n - 1).llt().solve(rest);
    solution.x = scale.asDiagonal() * y;
  }
  solution.gain = 2.0 * right.dot(y) - y.dot(normal * y);
  return solution;
}

/// Residual sum of squares of a solution on other rows.
double heldOut(const Gram& gram, const Eigen::VectorXd& x) {
  const Eigen::Index n = x.size();
  return gram(n, n) - 2.0 * x.dot(gram.col(n).head(n)) + x.dot(gram.topLeftCorner(n, n) * x);
}

class Scanner {
 public:
  explicit Scanner(const Linearized& at) : at_(at) {
    const Eigen::Index q = at.nuisance().cols();
    fixed_.resize(at.size(), q + 1);
    fixed_.leftCols(q) = at.nuisance();
    fixed_.col(q) = at.residual();
    for (const Segment& segment : blocks()) fixed_grams_.push_back(product(segment, fixed_, fixed_));
    const std::vector<Gram> all = fixed_grams_;
    const Gram total = sum(all);
    base_gain_ = solve(total).gain;
    for (std::size_t b = 0; b < at.segments().size(); ++b) {
      const Solution without = solve(total - all[b]);
      base_without_.push_back(without.gain);
      base_held_out_.push_back(heldOut(all[b], without.x));
    }
  }

  struct Tried {
    double gain = 0.0;
    std::vector<double> without;
    std::vector<double> held_out;
  };

  Tried tryColumns(const Eigen::MatrixXd& columns, const LinearPrior& prior) const {
    const Eigen::Index q = at_.nuisance().cols();
    const Eigen::Index m = columns.cols();
    std::vector<Gram> grams;
    const std::vector<Segment> segments = blocks();
    for (std::size_t b = 0; b < segments.size(); ++b) {
      const Gram own = product(segments[b], columns, columns);
      const Gram mixed = product(segments[b], columns, fixed_);
      const Gram& fixed = fixed_grams_[b];
      Gram gram(q + m + 1, q + m + 1);
      gram.topLeftCorner(q, q) = fixed.topLeftCorner(q, q);
      gram.block(q, q, m, m) = own;
      gram.block(q, 0, m, q) = mixed.leftCols(q);
      gram.block(0, q, q, m) = mixed.leftCols(q).transpose();
      gram.col(q + m).head(q) = fixed.col(q).head(q);
      gram.col(q + m).segment(q, m) = mixed.col(q);
      gram.row(q + m) = gram.col(q + m).transpose();
      gram(q + m, q + m) = fixed(q, q);
      grams.push_back(std::move(gram));
    }
    const Gram total = sum(grams);
    Tried tried;
    tried.gain = solve(total, prior).gain - base_gain_;
    for (std::size_t b = 0; b < at_.segments().size(); ++b) {
      const Solution without = solve(total - grams[b], prior);
      tried.without.push_back(without.gain - base_without_[b]);
      tried.held_out.push_back(base_held_out_[b] - heldOut(grams[b], without.x));
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
  double base_gain_ = 0.0;
  std::vector<double> base_without_;
  std::vector<double> base_held_out_;
};

}  // namespace

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

ScanResult scan(const Linearized& at, const effects::EffectFit& fit, std::vector<Eigen::VectorXd> starts,
                std::size_t kept, const RunControl& control) {
  std::erase_if(starts, [&](const Eigen::VectorXd& start) { return !fit.allows(start); });
  const Scanner scanner(at);
  const LinearPrior prior = priorOf(fit);
  std::vector<Scanner::Tried> tried(starts.size());
  control.parallel_for(starts.size(), [&](std::size_t i) {
    if (!control.stop.stop_requested()) tried[i] = scanner.tryColumns(at.columns(fit, starts[i]), prior);
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

}  // namespace fieldtrue::identify
