#include <cmath>
#include <cstdio>

#include "tests/blind/generate_session.h"

namespace blind {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

void append(std::string& text, double value, int digits) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, ",%.*f", digits, value);
  text += buffer;
}

/// Nine significant digits, whatever the size.
void appendScaled(std::string& text, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, ",%.9g", value);
  text += buffer;
}

void append(std::string& text, const Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  for (double value : {q.w(), q.x(), q.y(), q.z()}) append(text, sign * value, 8);
}

/// Student t of 4 degrees of freedom scaled to unit variance, or Gaussian.
double seatingDraw(Random& random, bool heavy) {
  const double z = normal(random);
  if (!heavy) return z;
  double chi2 = 0;
  for (int k = 0; k < 4; ++k) chi2 += std::pow(normal(random), 2);
  return z / std::sqrt(chi2 / 4) / std::sqrt(2.0);
}

Vector6 drawSeating(const Setup& setup, Random& random) {
  Vector6 seating;
  for (int k = 0; k < 6; ++k)
    seating[k] = (k < 3 ? setup.jig_m : setup.jig_rad) * seatingDraw(random, setup.heavy_tails);
  return seating;
}

struct Recorded {
  std::vector<SolvedPose> samples;
  SolvedPose mean;
  Matrix3d covariance = Matrix3d::Zero();
  double rotation_sd = 0;
};

Recorded recordRow(const Setup& setup, const Alignment& alignment, std::size_t r, const SolvedPose& pose,
                   const StreamFault& fault, Random& random) {
  const double filter = std::max(setup.filter, fault.hidden_filter);
  const double range_m = pose.position_m.norm();
  const double sd = setup.coupling_noise * fault.range_factor * std::pow(range_m, fault.range_power);
  const auto& solve = alignment.poseFromCouplings(static_cast<int>(r));
  Vector9 noise;
  for (int c = 0; c < 9; ++c) noise[c] = sd * normal(random);
  const double line_phase = uniform(random, 0, 2 * kPi);
  const double lines[3] = {1.0, uniform(random, -1, 1), uniform(random, -1, 1)};
  Recorded recorded;
  Vector3d position_sum = Vector3d::Zero(), rotation_sum = Vector3d::Zero();
  std::vector<Vector6> changes;
  for (int s = 0; s < setup.samples; ++s) {
    Vector9 couplings = noise;
    const double line = fault.line_amplitude * std::sin(2 * kPi * fault.line_hz * s / setup.rate_hz + line_phase);
    for (int c = 0; c < 9; ++c) couplings[c] += line * lines[c % 3];
    const Vector6 change = solve * couplings;
    SolvedPose sample{pose.position_m + change.head<3>(), turned(change.tail<3>(), pose.orientation)};
    if (fault.quantum_m > 0)
      sample.position_m = (sample.position_m / fault.quantum_m).array().round().matrix() * fault.quantum_m;
    position_sum += sample.position_m;
    rotation_sum += change.tail<3>();
    changes.push_back(change);
    recorded.samples.push_back(sample);
    for (int c = 0; c < 9; ++c) noise[c] = filter * noise[c] + sd * std::sqrt(1 - filter * filter) * normal(random);
  }
  recorded.mean = {position_sum / setup.samples, turned(rotation_sum / setup.samples, pose.orientation)};
  double rotation_variance = 0;
  for (std::size_t s = 0; s < changes.size(); ++s) {
    const Vector3d away = recorded.samples[s].position_m - recorded.mean.position_m;
    recorded.covariance += away * away.transpose() / (setup.samples - 1);
    rotation_variance += (changes[s].tail<3>() - rotation_sum / setup.samples).squaredNorm() / (setup.samples - 1);
  }
  recorded.rotation_sd = std::sqrt(rotation_variance);
  return recorded;
}

std::string nodeHeader(const Setup& setup) {
  char text[512];
  std::snprintf(text, sizeof text,
                "# frame: %s\n# excitation: ac\n# carrier_hz: %.0f\n# rate_hz: %.0f\n# jig_tolerance_m: %.6f\n"
                "# jig_tolerance_rad: %.6f\n",
                setup.alignment_known ? "tracker" : "jig", setup.carrier_hz, setup.rate_hz, setup.jig_m, setup.jig_rad);
  std::string header = text;
  if (setup.alignment_known) {
    std::snprintf(text, sizeof text,
                  "# alignment: known\n# alignment_tolerance_m: %.6f\n# alignment_tolerance_rad: %.6f\n",
                  setup.alignment_m, setup.alignment_rad);
    header += text;
  } else {
    header += "# alignment: unknown\n";
  }
  header +=
      "node,i,j,k,sensor,visit,t_start_s,t_end_s,x_true_m,y_true_m,z_true_m,qw_true,qx_true,qy_true,qz_true,"
      "x_m,y_m,z_m,";
  if (!setup.position_only) header += "qw,qx,qy,qz,";
  header += "sd_x_m,sd_y_m,sd_z_m,cov_xy_m2,cov_xz_m2,cov_yz_m2,";
  if (!setup.position_only) header += "sd_rot_rad,";
  return header + "n_used,n_rejected,n_effective,role\n";
}

std::string nodeLine(const Setup& setup, const Row& row, const Recorded& recorded, double effective) {
  std::string line = std::to_string(row.node);
  for (int value : {row.i, row.j, row.k}) line += setup.scattered ? "," : "," + std::to_string(value);
  line += ",0," + std::to_string(row.visit);
  append(line, row.start_s, 4);
  append(line, row.end_s, 4);
  for (int c = 0; c < 3; ++c) append(line, row.place_m[c], 6);
  append(line, row.attitude);
  for (int c = 0; c < 3; ++c) append(line, recorded.mean.position_m[c], 7);
  if (!setup.position_only) append(line, recorded.mean.orientation);
  for (int c = 0; c < 3; ++c) appendScaled(line, std::sqrt(recorded.covariance(c, c)));
  // Coarse readings can move together exactly: a millionth less keeps the rounded matrix positive definite.
  constexpr double kMargin = 1 - 1e-6;
  appendScaled(line, kMargin * recorded.covariance(0, 1));
  appendScaled(line, kMargin * recorded.covariance(0, 2));
  appendScaled(line, kMargin * recorded.covariance(1, 2));
  if (!setup.position_only) appendScaled(line, recorded.rotation_sd);
  line += "," + std::to_string(setup.samples) + ",0";
  append(line, effective, 2);
  return line + ",fit\n";
}

}  // namespace

GeneratedSession recordSession(const Setup& setup, const World& world, const Alignment& alignment,
                               const StreamFault& fault, bool samples, Random& random) {
  GeneratedSession session;
  session.nodes_csv = nodeHeader(setup);
  if (samples)
    session.samples_csv =
        std::string("node,sensor,visit,t_s,x_m,y_m,z_m,") + (setup.position_only ? "" : "qw,qx,qy,qz,") + "status\n";
  const double effective =
      fault.hidden_filter > 0 ? static_cast<double>(setup.samples) : std::max(1.0, setup.effectiveSamples());
  for (std::size_t r = 0; r < setup.rows.size(); ++r) {
    const Row& row = setup.rows[r];
    SolvedPose pose = reported(setup, world, row, drawSeating(setup, random));
    if (uniform(random, 0, 1) < fault.flip_share) pose.position_m = -pose.position_m;
    const Recorded recorded = recordRow(setup, alignment, r, pose, fault, random);
    session.nodes_csv += nodeLine(setup, row, recorded, effective);
    if (!samples) continue;
    for (std::size_t s = 0; s < recorded.samples.size(); ++s) {
      std::string line = std::to_string(row.node) + ",0," + std::to_string(row.visit);
      append(line, row.start_s + static_cast<double>(s) / setup.rate_hz, 5);
      for (int c = 0; c < 3; ++c) append(line, recorded.samples[s].position_m[c], 7);
      if (!setup.position_only) append(line, recorded.samples[s].orientation);
      session.samples_csv += line + ",\n";
    }
  }
  return session;
}

namespace {

/// Somewhere in the box of the places, or outside it by up to `margin_m`.
Vector3d drawPlace(const Eigen::AlignedBox3d& box, double margin_m, Random& random) {
  for (;;) {
    Vector3d place_m;
    for (int axis = 0; axis < 3; ++axis)
      place_m[axis] = uniform(random, box.min()[axis] - margin_m, box.max()[axis] + margin_m);
    if (margin_m == 0 || !box.contains(place_m)) return place_m;
  }
}

}  // namespace

std::string recordUnseen(const Setup& setup, const World& world, Random& random) {
  constexpr int kInside = 150, kOutside = 50;
  constexpr double kNearest_m = 0.4;  // Nearer, no tracker of this kind works.
  Eigen::AlignedBox3d box;
  for (const Row& row : setup.rows) box.extend(row.place_m);
  const Vector3d corner_m =
      setup.middle_m - 0.5 * setup.pitch_m * (setup.counts - Eigen::Vector3i::Ones()).cast<double>();
  std::string table =
      "inside,t_s,i,j,k,x_true_m,y_true_m,z_true_m,qw_true,qx_true,qy_true,qz_true,x_m,y_m,z_m,qw,qx,qy,qz\n";
  for (int n = 0; n < kInside + kOutside;) {
    const bool inside = n < kInside;
    Row row;
    row.place_m = drawPlace(box, inside ? 0 : setup.pitch_m, random);
    const Vector3d step = (row.place_m - corner_m) / setup.pitch_m;
    const auto nearest = [&](int axis) {
      return std::clamp(static_cast<int>(std::lround(step[axis])), 0, setup.counts[axis] - 1);
    };
    row.i = nearest(0), row.j = nearest(1), row.k = nearest(2);
    const auto other = static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(setup.rows.size()) - 1));
    row.attitude = setup.rows[other].attitude;
    row.start_s = row.end_s = uniform(random, setup.rows.front().start_s, setup.latest_s);
    const SolvedPose pose = reported(setup, world, row);
    if (setup.expected(row).position_m.norm() < kNearest_m || !pose.position_m.allFinite()) continue;
    ++n;
    table += inside ? "1" : "0";
    append(table, row.start_s, 4);
    for (int value : {row.i, row.j, row.k}) table += "," + std::to_string(value);
    for (int c = 0; c < 3; ++c) append(table, row.place_m[c], 6);
    append(table, row.attitude);
    for (int c = 0; c < 3; ++c) append(table, pose.position_m[c], 7);
    append(table, pose.orientation);
    table += "\n";
  }
  return table;
}

}  // namespace blind
