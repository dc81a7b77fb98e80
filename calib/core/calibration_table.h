#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/core/pose.h"
#include "calib/core/setup.h"

namespace fieldtrue {

/// One raw reading of one sensor.
struct Sample {
  double time_s = 0.0;  ///< From the start of the session.
  int sensor = 0;
  Pose tracker_from_sensor;
  std::string status;  ///< Empty = good; otherwise the tracker's own error mark. Never averaged when set.
};

/// A raw reading with the place it belongs to; `node` -1 means between places.
struct SampleRow {
  int node = -1;
  int visit = 0;
  Sample sample;
};

enum class NodeRole { kFit, kValidation, kSkipped };

/// Roles as files name them.
inline constexpr std::array<std::pair<std::string_view, NodeRole>, 3> kNodeRoles{
    {{"fit", NodeRole::kFit}, {"validation", NodeRole::kValidation}, {"skipped", NodeRole::kSkipped}}};

constexpr std::string_view nameOf(NodeRole role) { return kNodeRoles[static_cast<std::size_t>(role)].first; }

/// What is planned for one stop of the jig: where the rig says the sensor is.
struct PlannedPlace {
  int node = 0;
  int visit = 0;
  std::optional<std::array<int, 3>> index;  ///< Grid index i j k; none when scattered.
  Pose reference_from_sensor;
  NodeRole role = NodeRole::kFit;
  std::optional<double> t_s = std::nullopt;  ///< When the visit begins; none = when the jig gets there.
};

/// One row of a node table: a sensor at a place on one visit, its true and its mean tracked pose.
struct Node {
  int node = 0;  ///< The place. Every hold-out removes all rows of a place.
  int sensor = 0;
  int visit = 0;
  std::optional<std::array<int, 3>> index;
  Pose reference_from_sensor;                    ///< True pose, in the frame named by the metadata.
  Pose tracker_from_sensor;                      ///< Mean of what the tracker reported.
  bool has_orientation = true;                   ///< Whether the tracker reported an orientation.
  std::optional<Eigen::Matrix3d> covariance_m2;  ///< Of a single accepted sample.
  std::optional<double> sd_rot_rad;              ///< RMS rotation angle of a single accepted sample about the mean.
  int n_used = 1;
  int n_rejected = 0;
  /// Independent samples n_used is worth; covariance of the mean = covariance_m2 / n_effective.
  double n_effective = 1.0;
  std::optional<double> t_start_s;
  std::optional<double> t_end_s;
  NodeRole role = NodeRole::kFit;
};

/// What is known about the table as a whole. Unset = not stated in the file.
struct TableMetadata {
  std::string frame = "jig";  ///< `tracker`, `jig` or `room`.
  std::optional<std::string> tracker;
  std::optional<std::string> rig;
  std::optional<std::string> date;
  std::optional<std::string> excitation;         ///< `ac` or `pulsed_dc`.
  std::optional<std::string> transmitter_model;  ///< `dipole`, `planar_coils`, `optical` or `unknown`; none = dipole.
  std::optional<double> carrier_hz;
  std::optional<double> rate_hz;
  std::optional<double> quantum_m;
  std::optional<double> jig_tolerance_m;    ///< SD of placing, per axis.
  std::optional<double> jig_tolerance_rad;  ///< SD of placing, per axis.
  /// `alignment: known`; false means the rigid part between rig and transmitter is a nuisance.
  bool alignment_known = false;
  std::optional<double> alignment_tolerance_m;
  std::optional<double> alignment_tolerance_rad;
  Setup setup;                               ///< What a calibration of this recording is good for.
  std::map<std::string, std::string> other;  ///< Keys this program does not interpret; kept and written back.
};

/// Calls visit(key, pointer to member) for each optional member, in the order of the files: readers, writers and
/// merging share this one list.
template <class Visit>
void forEachStatement(Visit visit) {
  visit("tracker", &TableMetadata::tracker);
  visit("rig", &TableMetadata::rig);
  visit("date", &TableMetadata::date);
  visit("excitation", &TableMetadata::excitation);
  visit("transmitter_model", &TableMetadata::transmitter_model);
  visit("carrier_hz", &TableMetadata::carrier_hz);
  visit("rate_hz", &TableMetadata::rate_hz);
  visit("quantum_m", &TableMetadata::quantum_m);
  visit("jig_tolerance_m", &TableMetadata::jig_tolerance_m);
  visit("jig_tolerance_rad", &TableMetadata::jig_tolerance_rad);
  visit("alignment_tolerance_m", &TableMetadata::alignment_tolerance_m);
  visit("alignment_tolerance_rad", &TableMetadata::alignment_tolerance_rad);
}

struct CalibrationTable {
  TableMetadata metadata;
  std::vector<Node> nodes;
};

struct SampleTable {
  TableMetadata metadata;
  std::vector<SampleRow> rows;
};

}  // namespace fieldtrue
