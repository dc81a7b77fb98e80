#include "tests/blind/bare_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace blind {
namespace {

using Vector12 = Eigen::Matrix<double, 12, 1>;

struct AlignedRow {
  SolvedPose jig_from_mount;
  SolvedPose tracked;
  double sd_m = 1.0;
  double sd_rad = 1.0;
};

SolvedPose poseIn(const SessionTable& table, const std::vector<std::string>& row, const std::string& suffix) {
  const auto number = [&](const std::string& name) { return numberIn(row[table.neededColumn(name + suffix)]); };
  SolvedPose pose;
  const std::string ending = suffix + "_m";
  for (int axis = 0; axis < 3; ++axis)
    pose.position_m[axis] = numberIn(row[table.neededColumn(std::string(1, "xyz"[axis]).append(ending))]);
  if (table.column("qw" + suffix)) {
    pose.orientation = Quaterniond(number("qw"), number("qx"), number("qy"), number("qz"));
    pose.orientation.normalize();
  }
  return pose;
}

bool states(const SessionTable& table, const std::string& line) {
  for (const std::string& other : table.metadata)
    if (other == line) return true;
  return false;
}

std::vector<AlignedRow> rowsOf(const SessionTable& nodes) {
  const double jig_m = statedNumber(nodes, "jig_tolerance_m", 1e-3);
  const double jig_rad = statedNumber(nodes, "jig_tolerance_rad", 1e-3);
  const auto turn_column = nodes.column("sd_rot_rad");
  std::vector<AlignedRow> rows;
  for (const auto& row : nodes.rows) {
    double square_m2 = 0.0;
    for (const char* name : {"sd_x_m", "sd_y_m", "sd_z_m"})
      square_m2 += std::pow(numberIn(row[nodes.neededColumn(name)]), 2) / 3.0;
    const double n_effective = numberIn(row[nodes.neededColumn("n_effective")]);
    const double turn_rad = turn_column ? numberIn(row[*turn_column]) : 0.0;
    rows.push_back({truePose(nodes, row), trackedPose(nodes, row), std::sqrt(jig_m * jig_m + square_m2 / n_effective),
                    std::sqrt(jig_rad * jig_rad + turn_rad * turn_rad / n_effective)});
  }
  return rows;
}

SolvedPose moved(const SolvedPose& pose, const Eigen::Matrix<double, 6, 1>& step) {
  return {pose.position_m + step.head<3>(), turned(step.tail<3>(), pose.orientation)};
}

BareAlignment moved(const BareAlignment& alignment, const Vector12& step) {
  return {moved(alignment.tracker_from_jig, step.head<6>()), moved(alignment.mount_from_sensor, step.tail<6>())};
}

/// Positions by Kabsch, as if the sensor stood on its mark, then the mean turn of the mount.
BareAlignment firstGuess(const std::vector<AlignedRow>& rows, bool has_orientation) {
  Vector3d from_m = Vector3d::Zero(), to_m = Vector3d::Zero();
  for (const AlignedRow& row : rows) {
    from_m += row.jig_from_mount.position_m / static_cast<double>(rows.size());
    to_m += row.tracked.position_m / static_cast<double>(rows.size());
  }
  Matrix3d products = Matrix3d::Zero();
  for (const AlignedRow& row : rows)
    products += (row.tracked.position_m - to_m) * (row.jig_from_mount.position_m - from_m).transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs = Vector3d::Ones();
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
  const Matrix3d turn = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  BareAlignment guess;
  guess.tracker_from_jig = {to_m - turn * from_m, Quaterniond(turn)};
  if (!has_orientation) return guess;
  Eigen::Matrix4d outer = Eigen::Matrix4d::Zero();
  for (const AlignedRow& row : rows) {
    const Quaterniond mount =
        (guess.tracker_from_jig.orientation * row.jig_from_mount.orientation).conjugate() * row.tracked.orientation;
    outer += mount.coeffs() * mount.coeffs().transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(outer);
  guess.mount_from_sensor.orientation = Quaterniond(Eigen::Vector4d(eigen.eigenvectors().col(3)));
  return guess;
}

class Fit {
 public:
  Fit(std::vector<AlignedRow> rows, bool has_orientation) : rows_(std::move(rows)), has_orientation_(has_orientation) {}

  BareAlignment run() const {
    constexpr int kSteps = 60;
    constexpr double kSettled = 1e-10;
    BareAlignment at = firstGuess(rows_, has_orientation_);
    for (int step = 0; step < kSteps; ++step) {
      const Vector12 change = stepFrom(at);
      at = moved(at, change);
      if (change.norm() < kSettled) break;
    }
    return at;
  }

 private:
  Eigen::VectorXd residuals(const BareAlignment& at) const {
    const Eigen::Index channels = has_orientation_ ? 6 : 3;
    Eigen::VectorXd left(channels * static_cast<Eigen::Index>(rows_.size()));
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const AlignedRow& row = rows_[i];
      const SolvedPose pose = at.reported(row.jig_from_mount);
      const Eigen::Index first = channels * static_cast<Eigen::Index>(i);
      left.segment<3>(first) = (pose.position_m - row.tracked.position_m) / row.sd_m;
      if (has_orientation_)
        left.segment<3>(first + 3) = rotationBetween(pose.orientation, row.tracked.orientation) / row.sd_rad;
    }
    return left;
  }

  /// What no row tells stays where it is: the least norm, by a weak pull.
  Vector12 stepFrom(const BareAlignment& at) const {
    constexpr double kDifference = 1e-6;
    constexpr double kWeak = 1e-9;
    const Eigen::VectorXd left = residuals(at);
    Eigen::MatrixXd jacobian(left.size(), 12);
    for (int k = 0; k < 12; ++k)
      jacobian.col(k) = (residuals(moved(at, kDifference * Vector12::Unit(k))) -
                         residuals(moved(at, -kDifference * Vector12::Unit(k)))) /
                        (2.0 * kDifference);
    Eigen::Matrix<double, 12, 12> normal = jacobian.transpose() * jacobian;
    normal.diagonal().array() += kWeak * normal.trace();
    return normal.ldlt().solve(-jacobian.transpose() * left);
  }

  std::vector<AlignedRow> rows_;
  bool has_orientation_;
};

}  // namespace

SolvedPose composed(const SolvedPose& a, const SolvedPose& b) {
  return {a.position_m + a.orientation * b.position_m, (a.orientation * b.orientation).normalized()};
}

SolvedPose inverse(const SolvedPose& pose) {
  const Quaterniond back = pose.orientation.conjugate();
  return {-(back * pose.position_m), back};
}

SolvedPose BareAlignment::reported(const SolvedPose& jig_from_mount) const {
  return composed(composed(tracker_from_jig, jig_from_mount), mount_from_sensor);
}

BareAlignment bareAlignment(const SessionTable& nodes) {
  if (nodes.rows.size() < 3) throw std::runtime_error("an alignment needs three rows");
  if (states(nodes, "# alignment: known")) return {};
  return Fit(rowsOf(nodes), nodes.column("qw").has_value()).run();
}

SolvedPose truePose(const SessionTable& table, const std::vector<std::string>& row) {
  return poseIn(table, row, "_true");
}

SolvedPose trackedPose(const SessionTable& table, const std::vector<std::string>& row) {
  return poseIn(table, row, "");
}

Vector3d rotationBetween(const Quaterniond& a, const Quaterniond& b) { return rotationVector(a * b.conjugate()); }

}  // namespace blind
