#include "calib/identify/joint_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace fieldtrue::identify {
namespace {

constexpr double kEnough = 5e-3;  // Fall of minus twice the log likelihood that ends a fit.

/// J^T W J.
Eigen::MatrixXd normalOf(const Eigen::MatrixXd& J, const Eigen::VectorXd& w) {
  const Eigen::MatrixXd weighted = w.cwiseSqrt().asDiagonal() * J;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(J.cols(), J.cols());
  normal.selfadjointView<Eigen::Lower>().rankUpdate(weighted.transpose());
  return normal.selfadjointView<Eigen::Lower>();
}

/// Where the parameters of a term begin among all.
Eigen::Index firstParameterOf(const GapModel& model, Eigen::Index n_alignment, std::size_t term) {
  Eigen::Index begin = n_alignment;
  for (std::size_t t = 0; t < term; ++t) begin += model.terms[t].linear.size() + model.terms[t].searched.size();
  return begin;
}

/// One attempt to fit a model jointly; the state of its iteration.
class JointFit {
 public:
  JointFit(const GapPhysics& physics, const Whitening& whitening, const RefineOptions& options)
      : physics_(physics), whitening_(whitening), options_(options), block_(physics.size(), 0) {}

  GapModel fitted(const GapModel& start) {
    State state = stateOf(start);
    double cost = adaptedCostOf(state);
    double damping = kFirstDamping;
    double last_fall = std::numeric_limits<double>::infinity();
    for (int step = 0; step < options_.most_steps; ++step) {
      const System system = systemAt(state);
      const double fall = descend(system, last_fall, state, cost, damping);
      if (fall <= 0.0) break;
      last_fall = fall;
      cost = adaptedCostOf(state);
      if (fall < kEnough) break;
    }
    return std::move(state.model);
  }

  RefinedModel withCovariance(const GapModel& model) {
    const State state = stateOf(model);
    RefinedModel refined;
    refined.cost = adaptedCostOf(state);
    const Linearized at = linearizedAt(state);
    const Eigen::MatrixXd& J = at.nuisance();
    Eigen::MatrixXd normal = normalOf(J, weights(at));
    Eigen::VectorXd unused = Eigen::VectorXd::Zero(J.cols());
    addPriors(model, at.nAlignment(), normal, unused);
    const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
    normal = scale.asDiagonal() * normal * scale.asDiagonal();
    normal.diagonal().array() += 1e-9;
    refined.covariance =
        scale.asDiagonal() * normal.ldlt().solve(Eigen::MatrixXd::Identity(J.cols(), J.cols())) * scale.asDiagonal();
    refined.n_alignment = at.nAlignment();
    refined.model = model;
    return refined;
  }

 private:
  static constexpr double kFirstDamping = 1e-3;
  static constexpr double kSlow = 0.3;  ///< Of the fall before: a valley that bends, or weights that hold back.
  static constexpr double kMostTimes = 32.0;

  /// A model and what a tracker reports in it, which is most of the work.
  struct State {
    GapModel model;
    std::vector<Pose> predicted;
  };

  bool isUsed(std::size_t row) const { return options_.used.empty() || options_.used[row] != 0; }

  State stateOf(GapModel model) const {
    std::vector<Pose> predicted = physics_.predictions(model);
    return {std::move(model), std::move(predicted)};
  }

  Linearized linearizedAt(const State& state) const {
    return Linearized(physics_, state.model, whitening_, block_, ResponseAt::kModel, state.predicted);
  }

  /// What became of a step.
  struct Applied {
    enum How { kFully, kAtTolerance, kForbidden } how = kFully;
    std::size_t barred = 0;  ///< Where it is forbidden: the first term that may not be so.
  };

  /// Normal equations about one state.
  struct System {
    Eigen::MatrixXd normal;
    Eigen::VectorXd right;
    Eigen::VectorXd scale;
    Eigen::Vector3d center_m;
    int n_alignment = 0;
  };

  System systemAt(const State& state) const {
    const Linearized at = linearizedAt(state);
    System system;
    system.center_m = alignmentCenter_m(at.settings());
    system.n_alignment = at.nAlignment();
    const Eigen::VectorXd w = weights(at);
    const Eigen::MatrixXd& J = at.nuisance();
    system.normal = normalOf(J, w);
    system.right = J.transpose() * (w.asDiagonal() * at.residual());
    if (options_.frozen) {
      system.normal.col(*options_.frozen).setZero();
      system.normal.row(*options_.frozen).setZero();
      system.right[*options_.frozen] = 0.0;
    }
    addPriors(state.model, at.nAlignment(), system.normal, system.right);
    system.scale = system.normal.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
    return system;
  }

  /// One damped step downhill, and on along it where steps are slow. Where no step leads down since one of the things
  /// may not go there, what is searched of it is held while the rest moves.
  /// @param last_fall of the cost by the step before
  /// @return fall of the cost; 0 where none was found
  double descend(const System& system, double last_fall, State& state, double& cost, double& damping) const {
    const double first_damping = damping;
    std::vector<char> is_held(static_cast<std::size_t>(system.right.size()), 0);
    for (;;) {
      damping = first_damping;
      const Descent descent = descendFree(system, is_held, last_fall, state, cost, damping);
      if (descent.fall > 0.0 || !descent.is_barred) return descent.fall;
      if (!hold(state.model, descent.barred, system.n_alignment, is_held)) return 0.0;
    }
  }

  /// @return whether the thing has anything that was not held yet
  static bool hold(const GapModel& model, std::size_t barred, int n_alignment, std::vector<char>& is_held) {
    const GapTerm& term = model.terms[barred];
    const auto first = is_held.begin() + firstParameterOf(model, n_alignment, barred) + term.linear.size();
    if (*first != 0) return false;
    std::fill(first, first + term.searched.size(), char{1});
    return true;
  }

  struct Descent {
    double fall = 0.0;
    bool is_barred = false;  ///< Whether one thing may not go where the last, shortest step would take it:
    std::size_t barred = 0;  ///< that of this term.
  };

  /// @param is_held per parameter: those that stay
  Descent descendFree(const System& system, const std::vector<char>& is_held, double last_fall, State& state,
                      double& cost, double& damping) const {
    Descent descent;
    const Eigen::MatrixXd scaled = system.scale.asDiagonal() * system.normal * system.scale.asDiagonal();
    for (int attempt = 0; attempt < 7; ++attempt) {
      Eigen::MatrixXd damped = scaled;
      damped.diagonal().array() += damping + 1e-10;
      for (const bool moves_rig : {true, false}) {
        const Eigen::VectorXd y = stepOf(damped, system, is_held, moves_rig);
        GapModel moved = state.model;
        if (!y.allFinite()) break;
        const Applied applied = apply(y, system.center_m, system.n_alignment, moved);
        descent = {0.0, applied.how == Applied::kForbidden, applied.barred};
        State next = descent.is_barred ? State{} : stateOf(std::move(moved));
        const double next_cost = descent.is_barred ? cost : costAt(usedResiduals(next), next.model);
        if (next_cost < cost) {
          const double before = cost;
          const GapModel from = std::move(state.model);
          state = std::move(next);
          cost = next_cost;
          damping = std::max(1e-9, 0.2 * damping);
          if (before - cost > kSlow * last_fall) goOn(system, from, y, state, cost);
          return {before - cost};
        }
        if (applied.how != Applied::kAtTolerance) break;
      }
      damping = 6.0 * std::max(damping, 1e-6);
    }
    return descent;
  }

  /// Takes two, four ... times a step that led downhill, for as long as that leads farther down.
  void goOn(const System& system, const GapModel& from, const Eigen::VectorXd& step, State& state, double& cost) const {
    for (double times = 2.0; times <= kMostTimes; times *= 2.0) {
      GapModel moved = from;
      if (apply(times * step, system.center_m, system.n_alignment, moved).how != Applied::kFully) return;
      State next = stateOf(std::move(moved));
      const double next_cost = costAt(usedResiduals(next), next.model);
      if (!(next_cost < cost)) return;
      state = std::move(next);
      cost = next_cost;
    }
  }

  /// One damped step of what is not held.
  static Eigen::VectorXd stepOf(const Eigen::MatrixXd& damped, const System& system, const std::vector<char>& is_held,
                                bool moves_rig) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = moves_rig ? 0 : system.n_alignment; i < system.right.size(); ++i)
      if (is_held[static_cast<std::size_t>(i)] == 0) free.push_back(i);
    Eigen::VectorXd y = Eigen::VectorXd::Zero(system.right.size());
    if (free.empty()) return y;
    const Eigen::VectorXd scaled = system.scale.cwiseProduct(system.right)(free);
    const Eigen::MatrixXd of_free = damped(free, free);
    const Eigen::VectorXd solved = of_free.ldlt().solve(scaled);
    y(free) = solved;
    return system.scale.cwiseProduct(y);
  }

  void addPriors(const GapModel& model, Eigen::Index at, Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
    for (const GapTerm& term : model.terms) {
      const Eigen::Index m = term.linear.size();
      const LinearPrior prior = priorOf(*term.fit);
      normal.diagonal().segment(at, m) += prior.precision;
      right.segment(at, m) -= prior.precision.cwiseProduct(term.linear);
      at += m + term.searched.size();
    }
  }

  bool mayBe(const GapTerm& term) const {
    if (options_.bounded_by_places) return term.fit->allows(term.searched);
    const std::vector<effects::FitParameter> bounds = term.fit->searched();
    for (std::size_t d = 0; d < bounds.size(); ++d) {
      const double value = term.searched[static_cast<Eigen::Index>(d)];
      if (!(value >= bounds[d].low && value <= bounds[d].high)) return false;
    }
    return true;
  }

  Applied apply(const Eigen::VectorXd& step, const Eigen::Vector3d& center_m, int n_alignment, GapModel& model) const {
    applyAlignmentStep(step.head(n_alignment), center_m, physics_.rows(), model.alignment);
    const bool is_bounded = physics_.rows().alignment_known && n_alignment > 0;
    const bool is_moved = is_bounded && keepNearStated(physics_.rows(), center_m, model.alignment);
    Eigen::Index at = n_alignment;
    for (std::size_t t = 0; t < model.terms.size(); ++t) {
      GapTerm& term = model.terms[t];
      term.linear += step.segment(at, term.linear.size());
      at += term.linear.size();
      term.searched += step.segment(at, term.searched.size());
      at += term.searched.size();
      if (term.searched.size() > 0 && !mayBe(term)) return {Applied::kForbidden, t};
      const LinearPrior prior = priorOf(*term.fit);
      if (term.linear.size() == 1) term.linear[0] = std::clamp(term.linear[0], prior.low, prior.high);
    }
    return {is_moved ? Applied::kAtTolerance : Applied::kFully};
  }

  double adaptedCostOf(const State& state) {
    const std::vector<Vector6d> used = usedResiduals(state);
    scale_ = devianceOf(used, physics_.rows().has_orientation, options_.law).scale;
    return costAt(used, state.model);
  }

  std::vector<Vector6d> usedResiduals(const State& state) const {
    const std::vector<Vector6d> all = whitened(physics_.residuals(state.predicted), whitening_);
    std::vector<Vector6d> used;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (isUsed(i)) used.push_back(all[i]);
    return used;
  }

  /// Sum over rows of the residual law's penalty at the present scales, and that of the priors.
  double costAt(std::span<const Vector6d> used, const GapModel& model) const {
    const bool both = physics_.rows().has_orientation;
    const double nu = options_.law.degrees_of_freedom;
    double sum = 0.0;
    for (const Vector6d& r : used) {
      sum += (nu + 3.0) * std::log1p(r.head<3>().squaredNorm() / (nu * scale_.position * scale_.position));
      if (both) sum += (nu + 3.0) * std::log1p(r.tail<3>().squaredNorm() / (nu * scale_.rotation * scale_.rotation));
    }
    return sum + priorCost(physics_, model);
  }

  Eigen::VectorXd weights(const Linearized& at) const {
    Eigen::VectorXd w = Eigen::VectorXd::Ones(at.size());
    const double nu = options_.law.degrees_of_freedom;
    const auto weigh = [&](Eigen::Index begin, double scale) {
      const double d2 = at.residual().segment<3>(begin).squaredNorm() / (scale * scale);
      w.segment<3>(begin).setConstant((nu + 3.0) / (nu + d2) / (scale * scale));
    };
    for (std::size_t k = 0; k < at.order().size(); ++k) {
      const Eigen::Index begin = static_cast<Eigen::Index>(k) * at.channels();
      if (!isUsed(at.order()[k])) {
        w.segment(begin, at.channels()).setZero();
        continue;
      }
      weigh(begin, scale_.position);
      if (at.channels() == 6) weigh(begin + 3, scale_.rotation);
    }
    return w;
  }

  const GapPhysics& physics_;
  const Whitening& whitening_;
  const RefineOptions& options_;
  std::vector<int> block_;
  ResidualScale scale_;
};

}  // namespace

RefinedModel refineJointly(const GapPhysics& physics, const GapModel& start, const Whitening& whitening,
                           const RefineOptions& options) {
  return withCovariance(physics, fitJointly(physics, start, whitening, options), whitening, options);
}

RefinedModel withCovariance(const GapPhysics& physics, const GapModel& fitted, const Whitening& whitening,
                            const RefineOptions& options) {
  return JointFit(physics, whitening, options).withCovariance(fitted);
}

GapModel fitJointly(const GapPhysics& physics, const GapModel& start, const Whitening& whitening,
                    const RefineOptions& options) {
  return JointFit(physics, whitening, options).fitted(start);
}

Eigen::Index firstParameterOf(const RefinedModel& refined, std::size_t term) {
  return firstParameterOf(refined.model, refined.n_alignment, term);
}

}  // namespace fieldtrue::identify
