#include "calib/identify/refine.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace fieldtrue::identify {
namespace {

constexpr double kHuge = 1e4;

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

}  // namespace fieldtrue::identify
