#include "calib/calibration/resampled_table.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/calibration/alignment.h"
#include "calib/calibration/coincident_places.h"
#include "calib/core/file_io.h"
#include "calib/core/memory_limit.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::calibration {
namespace {

/// The errors of the measured places, visits averaged, tracker frame.
struct MeasuredErrors {
  Alignment alignment;
  correctors::Places places;
  std::vector<Eigen::Quaterniond> q_error;  ///< Empty where not every row has an orientation.
  std::vector<Eigen::Matrix3d> noise_m2;    ///< Empty where not every row states its noise.
  std::vector<double> noise_rad2;           ///< Likewise.
  Eigen::Quaterniond reference_from_sensor = Eigen::Quaterniond::Identity();  ///< True orientation to write.
};

/// Mean over the rows of each place.
template <class Value, class MeanOfRows>
std::vector<Value> byPlace(const correctors::Places& places, MeanOfRows mean_of_rows) {
  std::vector<Value> values;
  values.reserve(places.size());
  for (const std::vector<std::size_t>& rows : places.rows) values.push_back(mean_of_rows(rows));
  return values;
}

/// The orientation that all rows share; identity where they differ.
Eigen::Quaterniond sharedOrientation(std::span<const Node> nodes) {
  constexpr double kSame_rad = 1e-6;
  const Eigen::Quaterniond& first = nodes.front().reference_from_sensor.orientation;
  const bool is_shared = std::all_of(nodes.begin(), nodes.end(), [&](const Node& node) {
    return angleBetween_rad(node.reference_from_sensor.orientation, first) < kSame_rad;
  });
  return is_shared ? first : Eigen::Quaterniond::Identity();
}

MeasuredErrors measuredErrors(std::span<const Node> nodes, const correctors::FitData& data,
                              const Alignment& alignment) {
  MeasuredErrors errors;
  errors.alignment = alignment;
  errors.places = correctors::mergePlaces(data);
  errors.reference_from_sensor = sharedOrientation(nodes);
  if (data.hasOrientation()) {
    const std::vector<Eigen::Quaterniond> q_rows = correctors::errorRotations(data, correctors::ErrorFrame::kTracker);
    errors.q_error = byPlace<Eigen::Quaterniond>(errors.places, [&](const std::vector<std::size_t>& rows) {
      std::vector<Eigen::Quaterniond> q_visits;
      for (const std::size_t row : rows) q_visits.push_back(q_rows[row]);
      return meanRotation(q_visits);
    });
  }
  if (!data.noise_m2.empty())
    errors.noise_m2 = byPlace<Eigen::Matrix3d>(errors.places, [&](const std::vector<std::size_t>& rows) {
      Eigen::Matrix3d sum_m2 = Eigen::Matrix3d::Zero();
      for (const std::size_t row : rows) sum_m2 += data.noise_m2[row];
      return Eigen::Matrix3d(sum_m2 / static_cast<double>(rows.size() * rows.size()));
    });
  if (std::all_of(nodes.begin(), nodes.end(), [](const Node& node) { return node.sd_rot_rad.has_value(); }))
    errors.noise_rad2 = byPlace<double>(errors.places, [&](const std::vector<std::size_t>& rows) {
      double sum_rad2 = 0.0;
      for (const std::size_t row : rows)
        sum_rad2 += *nodes[row].sd_rot_rad * *nodes[row].sd_rot_rad / std::max(1.0, nodes[row].n_effective);
      return sum_rad2 / static_cast<double>(rows.size() * rows.size());
    });
  return errors;
}

/// What the weights make of the places' errors at a grid node; without weights the tracker is taken at its word.
Node nodeOf(const PlannedPlace& place, const std::vector<correctors::RegridWeight>& weights,
            const MeasuredErrors& errors) {
  Node node;
  node.node = place.node;
  node.index = place.index;
  node.role = weights.empty() ? NodeRole::kSkipped : NodeRole::kFit;
  node.tracker_from_sensor.position_m = place.reference_from_sensor.position_m;
  Eigen::Vector3d p_true_m = node.tracker_from_sensor.position_m;
  Eigen::Matrix3d noise_m2 = Eigen::Matrix3d::Zero();
  double noise_rad2 = 0.0;
  std::vector<Eigen::Quaterniond> q_errors;
  std::vector<double> shares;
  for (const correctors::RegridWeight& w : weights) {
    p_true_m += w.weight * (errors.places.p_true_m[w.place] - errors.places.p_tracked_m[w.place]);
    if (!errors.noise_m2.empty()) noise_m2 += w.weight * w.weight * errors.noise_m2[w.place];
    if (!errors.noise_rad2.empty()) noise_rad2 += w.weight * w.weight * errors.noise_rad2[w.place];
    if (!errors.q_error.empty()) q_errors.push_back(errors.q_error[w.place]);
    shares.push_back(w.weight);
  }
  const Alignment& alignment = errors.alignment;
  node.reference_from_sensor.position_m = alignment.reference_from_tracker * p_true_m;
  if (!errors.noise_m2.empty() && !weights.empty()) node.covariance_m2 = noise_m2;
  node.has_orientation = !errors.q_error.empty();
  if (!node.has_orientation) return node;
  if (!errors.noise_rad2.empty() && !weights.empty()) node.sd_rot_rad = std::sqrt(noise_rad2);
  const Eigen::Quaterniond q_error = q_errors.empty() ? Eigen::Quaterniond::Identity() : meanRotation(q_errors, shares);
  node.reference_from_sensor.orientation = errors.reference_from_sensor;
  node.tracker_from_sensor.orientation =
      canonical(q_error * alignment.reference_from_tracker.orientation.conjugate() * errors.reference_from_sensor *
                alignment.sensor_from_mount.conjugate());
  return node;
}

}  // namespace

Result<ResampledTable> resampleTable(const CalibrationTable& table, std::span<const PlannedPlace> grid,
                                     const correctors::RegridOptions& options, AlignMode align,
                                     const RunControl& control) {
  std::vector<Node> nodes;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(nodes),
               [](const Node& node) { return node.role == NodeRole::kFit; });
  if (nodes.empty()) return fail(ErrorCode::kTooFewNodes, "Resampling needs measured places of role fit, got none");
  ResampledTable resampled;
  resampled.note = joinCoincidentPlaces(nodes);
  FT_TRY(const auto alignment, align == AlignMode::kRigid ? fitAlignment(nodes, table.metadata.jig_tolerance_m)
                                                          : Result<Alignment>(Alignment{}));
  const correctors::FitData data = makeFitData(nodes, table.metadata, alignment);
  FT_TRY_VOID(correctors::checkPositions(data, "Resampling"));
  if (auto room = checkMemory("Resampling to " + std::to_string(grid.size()) + " grid nodes",
                              static_cast<double>(grid.size() * sizeof(Node)));
      !room)
    return tl::unexpected(room.error());
  const MeasuredErrors errors = measuredErrors(nodes, data, alignment);

  const correctors::Regridder regridder(errors.places.p_tracked_m, options);
  resampled.table.metadata = table.metadata;
  resampled.table.metadata.other["resampled"] = correctors::regridMethodId(options.method);
  if (options.method == correctors::RegridMethod::kLivingston)
    resampled.table.metadata.other["resampled_width_pitches"] = formatNumber(options.width_pitches);
  resampled.table.nodes.resize(grid.size());
  control.parallel_for(grid.size(), [&](std::size_t i) {
    resampled.table.nodes[i] = nodeOf(grid[i], regridder.weightsAt(grid[i].reference_from_sensor.position_m), errors);
  });
  resampled.n_without_support =
      static_cast<std::size_t>(std::count_if(resampled.table.nodes.begin(), resampled.table.nodes.end(),
                                             [](const Node& node) { return node.role == NodeRole::kSkipped; }));
  if (resampled.n_without_support == grid.size())
    return fail(ErrorCode::kDegenerate,
                "None of the " + std::to_string(grid.size()) + " grid nodes lies between the " +
                    std::to_string(errors.places.size()) +
                    " measured places; the grid must lie where the tracker reported them, and they must span a volume");
  resampled.error = correctors::regridError(data, options, control);
  return resampled;
}

}  // namespace fieldtrue::calibration
