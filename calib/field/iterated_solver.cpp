#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "calib/core/error.h"
#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"

namespace fieldtrue::field {

namespace {

using Residuals = Eigen::Matrix<double, 12, 1>;
using Jacobian = Eigen::Matrix<double, 12, 6>;

Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// The nine equations and the pull of the last position, all without unit.
class Equations {
 public:
  Equations(const Eigen::Matrix3d& couplings, double dipole_constant_m3, const Eigen::Vector3d& last_position_m,
            double weight)
      : S_(couplings),
        constant_m3_(dipole_constant_m3),
        last_position_m_(last_position_m),
        per_coupling_(std::sqrt(6.0) / couplings.norm()),
        per_m_(std::sqrt(weight) / last_position_m.norm()) {}

  Residuals residuals(const Pose& pose) const {
    Residuals r;
    const Eigen::Matrix3d misfit = couplings(dipoleField(pose.position_m, constant_m3_), pose.orientation) - S_;
    r.head<9>() = per_coupling_ * misfit.reshaped();
    r.tail<3>() = per_m_ * (pose.position_m - last_position_m_);
    return r;
  }

  /// By position [m] and rotation vector [rad], tracker frame.
  Jacobian slopes(const Pose& pose) const {
    Jacobian J = Jacobian::Zero();
    const Eigen::Matrix3d to_sensor = pose.orientation.toRotationMatrix().transpose();
    const Eigen::Matrix3d G = dipoleField(pose.position_m, constant_m3_);
    for (int a = 0; a < 3; ++a) {
      const Eigen::Matrix3d by_place = to_sensor * dipoleFieldSlope(pose.position_m, constant_m3_, a);
      const Eigen::Matrix3d by_turn = -to_sensor * crossMatrix(Eigen::Vector3d::Unit(a)) * G;
      J.col(a).head<9>() = per_coupling_ * by_place.reshaped();
      J.col(3 + a).head<9>() = per_coupling_ * by_turn.reshaped();
      J(9 + a, a) = per_m_;
    }
    return J;
  }

 private:
  Eigen::Matrix3d S_;
  double constant_m3_;
  Eigen::Vector3d last_position_m_;
  double per_coupling_;
  double per_m_;
};

/// Range from the trace of S^T S, direction from its first eigenvector, orientation as the rotation nearest to
/// G(p) S^-1.
Pose directPose(const Eigen::Matrix3d& S, double dipole_constant_m3, const Eigen::Vector3d& hemisphere) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(S.transpose() * S);
  const double range_m = std::cbrt(dipole_constant_m3 * std::sqrt(6.0) / S.norm());
  const Eigen::Vector3d p_m = range_m * eigen.eigenvectors().col(2);
  Pose pose;
  pose.position_m = p_m.dot(hemisphere) < 0.0 ? Eigen::Vector3d(-p_m) : p_m;
  const Eigen::Matrix3d rotation = dipoleField(p_m, dipole_constant_m3) * S.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0 ? 1.0 : -1.0;
  const Eigen::Matrix3d R = svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  pose.orientation = Eigen::Quaterniond(R).normalized();
  return pose;
}

Pose stepped(const Pose& pose, const Eigen::Matrix<double, 6, 1>& step) {
  return {pose.position_m + step.head<3>(),
          (rotationFromVector(Eigen::Vector3d(step.tail<3>())) * pose.orientation).normalized()};
}

Pose descend(const Equations& equations, Pose pose) {
  constexpr int kMostSteps = 60;
  constexpr double kEnough = 1e-15;
  double damping = 1e-4;
  Residuals r = equations.residuals(pose);
  for (int i = 0; i < kMostSteps && damping < 1e12; ++i) {
    const Jacobian J = equations.slopes(pose);
    Eigen::Matrix<double, 6, 6> normal = J.transpose() * J;
    normal.diagonal() *= 1.0 + damping;
    const Eigen::Matrix<double, 6, 1> step = -normal.ldlt().solve(J.transpose() * r);
    const Pose next = stepped(pose, step);
    const Residuals next_r = equations.residuals(next);
    if (!next_r.allFinite() || next_r.squaredNorm() > r.squaredNorm()) {
      damping *= 10.0;
      continue;
    }
    const bool is_done = step.head<3>().norm() < kEnough * pose.position_m.norm() && step.tail<3>().norm() < kEnough;
    pose = next;
    r = next_r;
    damping *= 0.1;
    if (is_done) break;
  }
  return pose;
}

}  // namespace

tl::expected<PoseSolution, SolveError> solvePose(PoseSolver solver, const Eigen::Matrix3d& S, double dipole_constant_m3,
                                                 const Eigen::Vector3d& last_position_m, const SolverLimits& limits) {
  FT_CHECK(last_position_m.norm() > 0.0);
  auto solution = solvePose(S, dipole_constant_m3, last_position_m, limits);
  if (!solution || solver == PoseSolver::kClosedForm) return solution;
  const double weight = solver == PoseSolver::kDamped ? kDamping : 0.0;
  const Equations equations(S, dipole_constant_m3, last_position_m, weight);
  const Pose pose = descend(equations, directPose(S, dipole_constant_m3, last_position_m));
  solution->tracker_from_sensor = pose;
  solution->residual_rms =
      (S - couplings(dipoleField(pose.position_m, dipole_constant_m3), pose.orientation)).norm() / 3.0;
  return solution;
}

std::string_view nameOf(PoseSolver solver) {
  switch (solver) {
    case PoseSolver::kClosedForm:
      return "closed_form";
    case PoseSolver::kLeastSquares:
      return "least_squares";
    case PoseSolver::kDamped:
      return "damped";
  }
  return {};
}

std::optional<PoseSolver> poseSolverNamed(std::string_view name) {
  for (const PoseSolver solver : {PoseSolver::kClosedForm, PoseSolver::kLeastSquares, PoseSolver::kDamped}) {
    if (name == nameOf(solver)) return solver;
  }
  return std::nullopt;
}

}  // namespace fieldtrue::field
