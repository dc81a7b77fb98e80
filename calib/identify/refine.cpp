#include "calib/identify/refine.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace fieldtrue::identify {
namespace {

constexpr double kHuge = 1e4;
constexpr double kEnough = 5e-3;  // Fall of minus twice the log likelihood that ends a fit.

/// Scale s of squared three-dimensional distances under a Student t law: the fixed point of
/// s^2 = mean(w d^2) / 3, w = (nu + 3)/(nu + d^2/s^2).
double scaleOf(std::span<const double> d2, double nu) {
  double mean = 0.0;
  for (const double d : d2) mean += d;
  double s2 = std::max(1e-12, mean / (3.0 * static_cast<double>(d2.size())));
  for (int step = 0; step < 30; ++step) {
    double sum = 0.0;
    for (const double d : d2) sum += (nu + 3.0) / (nu + d / s2) * d;
    const double next = std::max(1e-12, sum / (3.0 * static_cast<double>(d2.size())));
    if (std::abs(next - s2) < 1e-6 * s2) break;
    s2 = next;
  }
  return std::sqrt(s2);
}

double devianceAt(std::span<const double> d2, double nu, double scale) {
  const double s2 = scale * scale;
  const double constant =
      -2.0 * (std::lgamma(0.5 * (nu + 3.0)) - std::lgamma(0.5 * nu) - 1.5 * std::log(nu)) + 3.0 * std::log(s2);
  double sum = 0.0;
  for (const double d : d2) sum += (nu + 3.0) * std::log1p(d / (nu * s2)) + constant;
  return sum;
}

/// Residuals of the rows that count for one local fit, the nuisance projected out.
class ProjectedFit {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = Eigen::Dynamic };

  ProjectedFit(const LocalFitter& rows, const effects::EffectFit& fit) : rows_(rows), fit_(fit), prior_(priorOf(fit)) {
    for (const effects::FitParameter& p : fit.searched()) width_.push_back(std::max(1e-6, p.high - p.low));
  }

  int NumResiduals() const { return static_cast<int>(rows_.residual().size()); }
  int NumParameters() const { return static_cast<int>(width_.size()); }

  struct Solved {
    Eigen::VectorXd linear;
    Eigen::VectorXd left;
  };
  Solved solved(const Eigen::VectorXd& searched) const {
    Eigen::MatrixXd columns = rows_.columns(fit_, searched);
    Eigen::VectorXd scale(columns.cols());
    for (Eigen::Index j = 0; j < columns.cols(); ++j) {
      const double norm = columns.col(j).norm();
      scale[j] = norm > 0.0 ? 1.0 / norm : 0.0;
      columns.col(j) *= scale[j];
    }
    Eigen::MatrixXd normal = columns.transpose() * columns;
    normal.diagonal().array() += 1e-9;
    normal.diagonal() += scale.cwiseAbs2().cwiseProduct(prior_.precision);
    Eigen::VectorXd y = normal.llt().solve(columns.transpose() * rows_.residual());
    if (y.size() == 1 && scale[0] > 0.0) y[0] = std::clamp(y[0], prior_.low / scale[0], prior_.high / scale[0]);
    return {scale.asDiagonal() * y, rows_.residual() - columns * y};
  }

  bool operator()(const double* searched, double* residuals, double* jacobian) const {
    const Eigen::Map<const Eigen::VectorXd> theta(searched, NumParameters());
    Eigen::Map<Eigen::VectorXd> left(residuals, NumResiduals());
    if (!theta.allFinite() || !fit_.allows(theta)) {
      left.setConstant(kHuge);
      if (jacobian != nullptr) Eigen::Map<Eigen::MatrixXd>(jacobian, NumResiduals(), NumParameters()).setZero();
      return true;
    }
    left = solved(theta).left;
    if (jacobian == nullptr) return true;
    Eigen::Map<Eigen::MatrixXd> J(jacobian, NumResiduals(), NumParameters());
    for (int d = 0; d < NumParameters(); ++d) {
      Eigen::VectorXd shifted = theta;
      const double h = 1e-5 * std::min(1.0, width_[static_cast<std::size_t>(d)]);
      shifted[d] += h;
      J.col(d) = (solved(shifted).left - left) / h;
    }
    return true;
  }

 private:
  const LocalFitter& rows_;
  const effects::EffectFit& fit_;
  LinearPrior prior_;
  std::vector<double> width_;
};

}  // namespace

Deviance devianceOf(std::span<const Vector6d> whitened, bool has_orientation, const ResidualLaw& law) {
  std::vector<double> position;
  std::vector<double> rotation;
  for (const Vector6d& r : whitened) {
    position.push_back(std::min(1e8, r.head<3>().squaredNorm()));
    if (has_orientation) rotation.push_back(std::min(1e8, r.tail<3>().squaredNorm()));
  }
  const double nu = law.degrees_of_freedom;
  Deviance deviance;
  deviance.scale.position = scaleOf(position, nu);
  deviance.value = devianceAt(position, nu, deviance.scale.position);
  if (has_orientation) {
    deviance.scale.rotation = scaleOf(rotation, nu);
    deviance.value += devianceAt(rotation, nu, deviance.scale.rotation);
  }
  return deviance;
}

ResidualLaw likeliestLaw(std::span<const Vector6d> whitened, bool has_orientation) {
  ResidualLaw likeliest;
  double least = std::numeric_limits<double>::infinity();
  for (const double nu : {4.0, 8.0, 100.0}) {
    const double deviance = devianceOf(whitened, has_orientation, {nu}).value;
    if (deviance >= least) continue;
    least = deviance;
    likeliest.degrees_of_freedom = nu;
  }
  return likeliest;
}

std::vector<Vector6d> whitenedResiduals(const GapPhysics& physics, const GapModel& model, const Whitening& whitening) {
  return whitened(physics.residuals(model), whitening);
}

double priorCost(const GapPhysics& physics, const GapModel& model) {
  double cost = alignmentCost(physics, model.alignment);
  for (const GapTerm& term : model.terms) cost += priorOf(*term.fit).costOf(term.linear);
  return cost;
}

LocalFitter::LocalFitter(const Linearized& at, std::optional<std::size_t> held_out) : at_(at) {
  for (std::size_t b = 0; b < at.segments().size(); ++b)
    if (held_out != b) parts_.push_back(at.segments()[b]);
  const Segment& last = at.segments().back();
  const Eigen::Index end = last.begin + last.count;
  if (end < at.size()) parts_.push_back({end, at.size() - end});
  basis_ = spanOf(picked(at.nuisance()));
  residual_ = projected(picked(at.residual()));
}

LocalFit LocalFitter::from(const effects::EffectFit& fit, const Eigen::VectorXd& start) const {
  const ProjectedFit projected(*this, fit);
  LocalFit local;
  local.searched = start;
  if (start.size() > 0) {
    using Solver = ceres::TinySolver<ProjectedFit>;
    Solver solver;
    solver.options.max_num_iterations = 15;
    solver.options.gradient_tolerance = 1e-5;
    solver.options.parameter_tolerance = 1e-4;
    Solver::Parameters parameters = start;
    solver.Solve(projected, &parameters);
    if (parameters.allFinite() && fit.allows(parameters)) local.searched = parameters;
  }
  ProjectedFit::Solved solved = projected.solved(local.searched);
  local.linear = std::move(solved.linear);
  local.gain = residual_.squaredNorm() - solved.left.squaredNorm();
  return local;
}

Eigen::MatrixXd LocalFitter::columns(const effects::EffectFit& fit, const Eigen::VectorXd& searched) const {
  return projected(picked(at_.columns(fit, searched)));
}

Eigen::MatrixXd LocalFitter::picked(Eigen::MatrixXd all) const {
  Eigen::Index rows = 0;
  for (const Segment& part : parts_) rows += part.count;
  if (rows == all.rows()) return all;
  Eigen::MatrixXd picked(rows, all.cols());
  Eigen::Index at = 0;
  for (const Segment& part : parts_) {
    picked.middleRows(at, part.count) = all.middleRows(part.begin, part.count);
    at += part.count;
  }
  return picked;
}

namespace {

/// J^T W J.
Eigen::MatrixXd normalOf(const Eigen::MatrixXd& J, const Eigen::VectorXd& w) {
  const Eigen::MatrixXd weighted = w.cwiseSqrt().asDiagonal() * J;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(J.cols(), J.cols());
  normal.selfadjointView<Eigen::Lower>().rankUpdate(weighted.transpose());
  return normal.selfadjointView<Eigen::Lower>();
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

  enum class Applied { kFully, kAtTolerance, kForbidden };

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

  /// One damped step downhill, and on along it where steps are slow.
  /// @param last_fall of the cost by the step before
  /// @return fall of the cost; 0 where none was found
  double descend(const System& system, double last_fall, State& state, double& cost, double& damping) const {
    const Eigen::MatrixXd scaled = system.scale.asDiagonal() * system.normal * system.scale.asDiagonal();
    for (int attempt = 0; attempt < 7; ++attempt) {
      Eigen::MatrixXd damped = scaled;
      damped.diagonal().array() += damping + 1e-10;
      for (const bool moves_rig : {true, false}) {
        const Eigen::VectorXd y = stepOf(damped, system.right, system.scale, moves_rig ? 0 : system.n_alignment);
        GapModel moved = state.model;
        const Applied applied =
            y.allFinite() ? apply(y, system.center_m, system.n_alignment, moved) : Applied::kForbidden;
        State next = applied == Applied::kForbidden ? State{} : stateOf(std::move(moved));
        const double next_cost = applied == Applied::kForbidden ? cost : costAt(usedResiduals(next), next.model);
        if (next_cost < cost) {
          const double before = cost;
          const GapModel from = std::move(state.model);
          state = std::move(next);
          cost = next_cost;
          damping = std::max(1e-9, 0.2 * damping);
          if (before - cost > kSlow * last_fall) goOn(system, from, y, state, cost);
          return before - cost;
        }
        if (applied != Applied::kAtTolerance) break;
      }
      damping = 6.0 * std::max(damping, 1e-6);
    }
    return 0.0;
  }

  /// Takes two, four ... times a step that led downhill, for as long as that leads farther down.
  void goOn(const System& system, const GapModel& from, const Eigen::VectorXd& step, State& state, double& cost) const {
    for (double times = 2.0; times <= kMostTimes; times *= 2.0) {
      GapModel moved = from;
      if (apply(times * step, system.center_m, system.n_alignment, moved) != Applied::kFully) return;
      State next = stateOf(std::move(moved));
      const double next_cost = costAt(usedResiduals(next), next.model);
      if (!(next_cost < cost)) return;
      state = std::move(next);
      cost = next_cost;
    }
  }

  /// One damped step; the first `fixed` parameters stay.
  static Eigen::VectorXd stepOf(const Eigen::MatrixXd& damped, const Eigen::VectorXd& right,
                                const Eigen::VectorXd& scale, Eigen::Index fixed) {
    const Eigen::Index free = right.size() - fixed;
    Eigen::VectorXd y = Eigen::VectorXd::Zero(right.size());
    if (free == 0) return y;
    const Eigen::VectorXd scaled = scale.tail(free).cwiseProduct(right.tail(free));
    y.tail(free) = scale.tail(free).cwiseProduct(damped.bottomRightCorner(free, free).ldlt().solve(scaled));
    return y;
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
    for (GapTerm& term : model.terms) {
      term.linear += step.segment(at, term.linear.size());
      at += term.linear.size();
      term.searched += step.segment(at, term.searched.size());
      at += term.searched.size();
      if (term.searched.size() > 0 && !mayBe(term)) return Applied::kForbidden;
      const LinearPrior prior = priorOf(*term.fit);
      if (term.linear.size() == 1) term.linear[0] = std::clamp(term.linear[0], prior.low, prior.high);
    }
    return is_moved ? Applied::kAtTolerance : Applied::kFully;
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
  Eigen::Index begin = refined.n_alignment;
  for (std::size_t t = 0; t < term; ++t)
    begin += refined.model.terms[t].linear.size() + refined.model.terms[t].searched.size();
  return begin;
}

}  // namespace fieldtrue::identify
