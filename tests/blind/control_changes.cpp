#include "tests/blind/control_changes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "tests/blind/bare_alignment.h"

namespace blind {
namespace {

/// Of a reading from where the alignment puts it, tracker frame.
struct Residual {
  Vector3d position_m = Vector3d::Zero();
  Vector3d rotation_rad = Vector3d::Zero();
};

struct AlignedTable {
  std::vector<SolvedPose> poses;
  std::vector<Residual> residuals;
};

/// Also where the table says that it is known: what the tolerance of that alignment leaves belongs to the alignment.
AlignedTable alignedRows(const SessionTable& nodes) {
  SessionTable unknown = nodes;
  std::erase(unknown.metadata, "# alignment: known");
  const BareAlignment alignment = bareAlignment(unknown);
  AlignedTable aligned;
  for (const auto& row : nodes.rows) {
    const SolvedPose pose = alignment.reported(truePose(nodes, row)), tracked = trackedPose(nodes, row);
    aligned.poses.push_back(pose);
    aligned.residuals.push_back(
        {tracked.position_m - pose.position_m, rotationBetween(tracked.orientation, pose.orientation)});
  }
  return aligned;
}

bool canBeAligned(const SessionTable& nodes) {
  return nodes.column("n_effective") && nodes.column("sd_x_m") && nodes.rows.size() >= 3;
}

void putReading(SessionTable& nodes, std::size_t at, const SolvedPose& aligned, const Residual& residual) {
  std::vector<std::string>& row = nodes.rows[at];
  const Vector3d position_m = aligned.position_m + residual.position_m;
  for (int axis = 0; axis < 3; ++axis)
    row[nodes.neededColumn(std::string(1, "xyz"[axis]) + "_m")] = exactText(position_m[axis]);
  if (!nodes.column("qw")) return;
  const Quaterniond q = turned(residual.rotation_rad, aligned.orientation);
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  row[nodes.neededColumn("qw")] = exactText(sign * q.w());
  row[nodes.neededColumn("qx")] = exactText(sign * q.x());
  row[nodes.neededColumn("qy")] = exactText(sign * q.y());
  row[nodes.neededColumn("qz")] = exactText(sign * q.z());
}

/// Covariance that a row states of its mean position.
Matrix3d meanCovariance(const SessionTable& nodes, const std::vector<std::string>& row) {
  const auto number = [&](const char* name) {
    const auto at = nodes.column(name);
    return at && !row[*at].empty() ? numberIn(row[*at]) : 0.0;
  };
  Matrix3d covariance = Vector3d(number("sd_x_m"), number("sd_y_m"), number("sd_z_m")).cwiseAbs2().asDiagonal();
  covariance(0, 1) = covariance(1, 0) = number("cov_xy_m2");
  covariance(0, 2) = covariance(2, 0) = number("cov_xz_m2");
  covariance(1, 2) = covariance(2, 1) = number("cov_yz_m2");
  constexpr double kTiny_m2 =
      1e-20;  // Readings that never moved have no spread, and are to have a factor all the same.
  return covariance / number("n_effective") + kTiny_m2 * Matrix3d::Identity();
}

/// Six series of unit variance, each of lag-one correlation 0.9.
class RedNoise {
 public:
  explicit RedNoise(std::uint64_t seed) : random_(seed) {
    for (double& value : now_) value = normal(random_);
  }
  Eigen::Matrix<double, 6, 1> next() {
    const Eigen::Matrix<double, 6, 1> drawn = now_;
    for (double& value : now_) value = kLagOne * value + std::sqrt(1.0 - kLagOne * kLagOne) * normal(random_);
    return drawn;
  }

 private:
  static constexpr double kLagOne = 0.9;
  Random random_;
  Eigen::Matrix<double, 6, 1> now_;
};

/// Rows in order of range, cut into shells as equal as can be of ten on average.
std::vector<std::vector<std::size_t>> rangeShells(const SessionTable& nodes) {
  std::vector<double> range_m;
  for (const auto& row : nodes.rows) range_m.push_back(trackedPose(nodes, row).position_m.norm());
  std::vector<std::size_t> order(range_m.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return range_m[a] < range_m[b]; });
  const std::size_t count = std::max<std::size_t>(1, (order.size() + 5) / 10);
  std::vector<std::vector<std::size_t>> shells(count);
  for (std::size_t at = 0; at < order.size(); ++at) shells[at * count / order.size()].push_back(order[at]);
  return shells;
}

}  // namespace

bool dropJigTolerance(SessionTable& nodes) {
  return std::erase_if(nodes.metadata, [](const std::string& line) { return line.rfind("# jig_tolerance_", 0) == 0; }) >
         0;
}

bool reddenNoise(SessionTable& nodes, std::uint64_t seed) {
  const double jig_m = statedNumber(nodes, "jig_tolerance_m", 0.0);
  const double jig_rad = statedNumber(nodes, "jig_tolerance_rad", 0.0);
  if (!canBeAligned(nodes) || jig_m <= 0.0 || jig_rad <= 0.0) return false;
  const AlignedTable aligned = alignedRows(nodes);
  const auto turn_column = nodes.column("sd_rot_rad");
  const std::size_t effective = nodes.neededColumn("n_effective");
  RedNoise noise(seed);
  for (std::size_t at = 0; at < nodes.rows.size(); ++at) {
    const auto& row = nodes.rows[at];
    const Matrix3d covariance_m2 = meanCovariance(nodes, row);
    const Matrix3d total_m2 = covariance_m2 + jig_m * jig_m * Matrix3d::Identity();
    // sd_rot_rad is of the length of the rotation vector, the tolerance of a component.
    const double turn_rad = turn_column ? numberIn(row[*turn_column]) / std::sqrt(3.0 * numberIn(row[effective])) : 0.0;
    const Eigen::Matrix<double, 6, 1> drawn = noise.next();
    Residual residual;
    residual.position_m = jig_m * Vector3d(total_m2.llt().matrixL().solve(aligned.residuals[at].position_m)) +
                          covariance_m2.llt().matrixL() * Vector3d(drawn.head<3>());
    residual.rotation_rad = jig_rad / std::hypot(jig_rad, turn_rad) * aligned.residuals[at].rotation_rad +
                            turn_rad * Vector3d(drawn.tail<3>());
    putReading(nodes, at, aligned.poses[at], residual);
  }
  return true;
}

bool permuteResiduals(SessionTable& nodes, std::uint64_t seed) {
  if (!canBeAligned(nodes)) return false;
  const AlignedTable aligned = alignedRows(nodes);
  Random random(seed);
  for (const std::vector<std::size_t>& shell : rangeShells(nodes)) {
    std::vector<std::size_t> from = shell;
    for (std::size_t left = from.size(); left > 1; --left) std::swap(from[left - 1], from[random() % left]);
    for (std::size_t at = 0; at < shell.size(); ++at)
      putReading(nodes, shell[at], aligned.poses[shell[at]], aligned.residuals[from[at]]);
  }
  return true;
}

void takePlaces(SessionTable& nodes, const SessionTable& other) {
  static constexpr std::array<const char*, 12> kPlace = {
      "node", "visit", "i", "j", "k", "x_true_m", "y_true_m", "z_true_m", "qw_true", "qx_true", "qy_true", "qz_true"};
  nodes.rows.resize(std::min(nodes.rows.size(), other.rows.size()));
  for (const char* name : kPlace) {
    const auto to = nodes.column(name), from = other.column(name);
    if (!to || !from) continue;
    for (std::size_t at = 0; at < nodes.rows.size(); ++at) nodes.rows[at][*to] = other.rows[at][*from];
  }
}

}  // namespace blind
