#include "tests/blind/session.h"

#include <algorithm>
#include <cmath>

#include "tests/blind/coils.h"

namespace blind {

SolvedPose Setup::sensorAt(const Vector3d& place_m, const Quaterniond& attitude) const {
  return {jig_in_tracker_m + tracker_from_jig * (place_m + attitude * lever_m),
          (tracker_from_jig * attitude * mounting).normalized()};
}

SolvedPose Setup::expected(const Row& row) const { return sensorAt(row.place_m, row.attitude); }

SolvedPose reported(const Setup& setup, const World& world, const Row& row,
                    const Eigen::Matrix<double, 6, 1>& seating) {
  Vector3d place_m = row.place_m;
  Quaterniond attitude = row.attitude;
  for (const auto& change : world.rig) change(row, place_m, attitude);
  SolvedPose sensor = setup.sensorAt(place_m + seating.head<3>(), turned(seating.tail<3>(), attitude));
  for (const auto& change : world.mounting) change(row, sensor);
  const Matrix3d tracker_from_sensor = sensor.orientation.toRotationMatrix();
  Matrix3d couplings =
      coilCouplings(sensor.position_m, tracker_from_sensor, world.transmitter_half_m, world.receiver_half_m);
  for (const auto& [share, scatterer] : world.metal)
    if (row.start_s >= scatterer.from_s && row.start_s < scatterer.until_s)
      couplings += share * tracker_from_sensor.transpose() * scatterer.fieldAt(sensor.position_m);
  couplings = world.receiver * couplings * world.transmitter;
  for (const auto& change : world.signal) change(row, sensor, couplings);
  SolvedPose pose = solvePose(couplings, sensor.position_m);
  for (const auto& change : world.report) change(row, pose);
  return pose;
}

Alignment::Alignment(const Setup& setup) : setup_(setup), channels_(setup.position_only ? 3 : 6) {
  const auto count = static_cast<Eigen::Index>(setup.rows.size());
  const bool lever = setup.orientations > 1 || setup.alignment_known;
  const int mounting = setup.position_only ? 0 : 3;
  const int unknowns = 6 + mounting + (lever ? 3 : 0);
  const int known = setup.alignment_known ? unknowns : 0;
  nuisance_ = Eigen::MatrixXd::Zero(count * channels_ + known, unknowns);
  for (Eigen::Index r = 0; r < count; ++r) {
    const SolvedPose sensor = setup.expected(setup.rows[static_cast<std::size_t>(r)]);
    const Matrix3d rotation = sensor.orientation.toRotationMatrix();
    const auto derivative = couplingDerivative(sensor.position_m, rotation);
    const Eigen::Matrix<double, 6, 6> inverse = (derivative.transpose() * derivative).inverse();
    solve_.push_back(inverse * derivative.transpose());
    Eigen::Matrix<double, 6, 6> covariance =
        inverse * setup.coupling_noise * setup.coupling_noise / setup.effectiveSamples();
    covariance.topLeftCorner<3, 3>().diagonal().array() += setup.jig_m * setup.jig_m;
    covariance.bottomRightCorner<3, 3>().diagonal().array() += setup.jig_rad * setup.jig_rad;
    const Eigen::MatrixXd used = covariance.topLeftCorner(channels_, channels_);
    whiten_.push_back(used.llt().matrixL().solve(Eigen::MatrixXd::Identity(channels_, channels_)));
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6, unknowns);
    rows.block<3, 3>(0, 0).setIdentity();
    rows.block<3, 3>(0, 3) = -skew(sensor.position_m);
    rows.block<3, 3>(3, 3).setIdentity();
    if (mounting > 0) rows.block<3, 3>(3, 6) = rotation;
    if (lever) rows.block<3, 3>(0, 6 + mounting) = rotation;
    nuisance_.middleRows(r * channels_, channels_) = whiten_.back() * rows.topRows(channels_);
  }
  for (int u = 0; u < known; ++u) {
    const bool length = u < 3 || u >= 6 + mounting;
    nuisance_(count * channels_ + u, u) = 1 / (length ? setup.alignment_m : setup.alignment_rad);
  }
  basis_ = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(nuisance_).householderQ() *
           Eigen::MatrixXd::Identity(nuisance_.rows(), unknowns);
}

Eigen::VectorXd Alignment::whitenedPose(int row, const Eigen::Matrix<double, 6, 1>& change) const {
  return whiten_[static_cast<std::size_t>(row)] * change.head(channels_);
}

Eigen::VectorXd Alignment::whitened(const World& world) const {
  Eigen::VectorXd gap(static_cast<Eigen::Index>(setup_.rows.size()) * channels_);
  for (std::size_t r = 0; r < setup_.rows.size(); ++r) {
    const SolvedPose expected = setup_.expected(setup_.rows[r]);
    const SolvedPose pose = reported(setup_, world, setup_.rows[r]);
    Eigen::Matrix<double, 6, 1> change;
    change << pose.position_m - expected.position_m,
        rotationVector(pose.orientation * expected.orientation.conjugate());
    gap.segment(static_cast<Eigen::Index>(r) * channels_, channels_) = whitenedPose(static_cast<int>(r), change);
  }
  return gap;
}

Eigen::MatrixXd Alignment::projected(const Eigen::MatrixXd& columns) const {
  const Eigen::Index rows = columns.rows();
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(basis_.rows(), columns.cols());
  left.topRows(rows) = columns;
  left -= basis_ * (basis_.topRows(rows).transpose() * columns);
  return left;
}

double Alignment::rho(const Eigen::VectorXd& whitened_gap) const {
  return projected(whitened_gap).norm() / std::sqrt(static_cast<double>(whitened_gap.size()));
}

double Alignment::oracleFraction(const Eigen::VectorXd& whitened_gap) const {
  const auto total = static_cast<Eigen::Index>(setup_.rows.size()) * channels_;
  const Eigen::Index prior = nuisance_.rows() - total;
  double gap_left = 0, estimation = 0;
  for (int octant = 0; octant < 8; ++octant) {
    std::vector<Eigen::Index> kept, held;
    for (std::size_t r = 0; r < setup_.rows.size(); ++r) {
      const Vector3d side = setup_.rows[r].place_m - setup_.middle_m;
      const bool out = (side.x() > 0) + 2 * (side.y() > 0) + 4 * (side.z() > 0) == octant;
      for (int c = 0; c < channels_; ++c) (out ? held : kept).push_back(static_cast<Eigen::Index>(r) * channels_ + c);
    }
    if (held.empty()) continue;
    Eigen::VectorXd seen = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kept.size()) + prior);
    seen.head(static_cast<Eigen::Index>(kept.size())) = whitened_gap(kept);
    for (Eigen::Index u = 0; u < prior; ++u) kept.push_back(total + u);
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> fit(nuisance_(kept, Eigen::all));
    const Eigen::MatrixXd held_rows = nuisance_(held, Eigen::all);
    gap_left += (whitened_gap(held) - held_rows * fit.solve(seen)).squaredNorm();
    // The pseudo-inverse is P R^-1 Q^T; Q keeps lengths, so that the spread of what is predicted needs R alone.
    const auto upper = fit.matrixR().topRows(nuisance_.cols()).triangularView<Eigen::Upper>();
    const Eigen::MatrixXd permuted = (held_rows * fit.colsPermutation()).transpose();
    estimation += upper.transpose().solve(permuted).squaredNorm();
  }
  return gap_left <= 0 ? 0.0 : std::max(0.0, 1 - estimation / (gap_left + estimation));
}

}  // namespace blind
