#pragma once

#include <functional>
#include <vector>

#include "tests/blind/bodies.h"
#include "tests/blind/pose_solver.h"

namespace blind {

/// One recorded row: a place, one visit.
struct Row {
  int node = 0, visit = 0;
  int i = 0, j = 0, k = 0;
  Vector3d place_m = Vector3d::Zero();  ///< jig frame, as the drawing says
  Quaterniond attitude = Quaterniond::Identity();
  double start_s = 0, end_s = 0;
};

/// How one session is laid out and how good its rig and tracker are.
struct Setup {
  std::vector<Row> rows;
  Eigen::Vector3i counts = Eigen::Vector3i::Ones();
  double pitch_m = 0.3;
  Vector3d middle_m = Vector3d::Zero();  ///< of the grid, jig frame
  int orientations = 1;
  bool random_order = true;
  bool scattered = false;  ///< places anywhere in the box of the grid: no layers, no grid indices
  bool position_only = false;
  bool alignment_known = false;
  bool heavy_tails = false;
  double jig_m = 0.002, jig_rad = 0.003;
  double alignment_m = 0.002, alignment_rad = 0.003;
  double coupling_noise = 1e-3;  ///< SD of one sample of one coupling, m^-3
  double filter = 0.4;           ///< correlation of neighbouring samples
  int samples = 60;
  double rate_hz = 120;
  double carrier_hz = 10016;
  Quaterniond tracker_from_jig = Quaterniond::Identity();
  Vector3d jig_in_tracker_m = Vector3d::Zero();
  Quaterniond mounting = Quaterniond::Identity();
  Vector3d lever_m = Vector3d::Zero();

  double effectiveSamples() const { return samples * (1 - filter) / (1 + filter); }
  double duration_s() const { return rows.empty() ? 1.0 : latest_s; }
  double latest_s = 1;
  /// Where the drawing, the transform and the mounting put the sensor, tracker frame.
  SolvedPose expected(const Row& row) const;
  SolvedPose sensorAt(const Vector3d& place_m, const Quaterniond& attitude) const;
};

/// What the room, the rig and the electronics really do.
struct World {
  Matrix3d receiver = Matrix3d::Identity();
  Matrix3d transmitter = Matrix3d::Identity();
  double transmitter_half_m = 0, receiver_half_m = 0;
  std::vector<std::pair<double, Scatterer>> metal;  ///< share and what it would do whole
  std::vector<std::function<void(const Row&, Vector3d&, Quaterniond&)>> rig;
  std::vector<std::function<void(const Row&, SolvedPose&)>> mounting;
  std::vector<std::function<void(const Row&, const SolvedPose&, Matrix3d&)>> signal;
  std::vector<std::function<void(const Row&, SolvedPose&)>> report;
};

/// Pose the tracker reports without noise.
/// @param seating jig-frame displacement and rotation of this visit, six numbers [m, rad]
SolvedPose reported(const Setup& setup, const World& world, const Row& row,
                    const Eigen::Matrix<double, 6, 1>& seating = Eigen::Matrix<double, 6, 1>::Zero());

/// Whitening and the nuisance directions of one session.
class Alignment {
 public:
  explicit Alignment(const Setup& setup);

  int channels() const { return channels_; }
  /// Whitened difference of what a world reports from what is expected, the alignment not yet removed.
  Eigen::VectorXd whitened(const World& world) const;
  /// Whitened change of pose for given changes of the nine couplings of one row.
  Eigen::VectorXd whitenedPose(int row, const Eigen::Matrix<double, 6, 1>& change) const;
  /// What alignment cannot absorb.
  Eigen::MatrixXd projected(const Eigen::MatrixXd& columns) const;
  /// RMS over channels after alignment.
  double rho(const Eigen::VectorXd& whitened_gap) const;
  /// Share by which adding the true effect and refitting the alignment shrinks what held-out octants show.
  double oracleFraction(const Eigen::VectorXd& whitened_gap) const;
  const Eigen::Matrix<double, 6, 9>& poseFromCouplings(int row) const { return solve_[static_cast<std::size_t>(row)]; }

 private:
  const Setup& setup_;
  int channels_ = 6;
  std::vector<Eigen::MatrixXd> whiten_;
  std::vector<Eigen::Matrix<double, 6, 9>> solve_;
  Eigen::MatrixXd nuisance_;  ///< rows of the session, then rows of what is known beforehand
  Eigen::MatrixXd basis_;
};

}  // namespace blind
