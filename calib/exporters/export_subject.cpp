#include "calib/exporters/export_subject.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/method_text.h"
#include "calib/exporters/exporter.h"

namespace fieldtrue::exporters {
namespace {

constexpr double kLeastExtent_m = 1e-3;
constexpr double kLevelsOffWithin = 0.2;  ///< Of the places' extent.
constexpr double kAlongStep_m = 1e-4;
constexpr int kBisections = 40;
constexpr int kNewtonSteps = 60;
constexpr double kInverseTolerance_m = 1e-10;
/// After so many steps that gained less than a tenth each, there is no way back.
constexpr int kMostSlowSteps = 8;
constexpr double kSlow = 0.9;
constexpr std::size_t kMostDrawsPerProbe = 60;

std::string orientationFact(const ExportOptions& options) {
  if (options.orientation) {
    const Eigen::Quaterniond q = canonical(*options.orientation);
    return "at w x y z = " + formatNumber(q.w()) + " " + formatNumber(q.x()) + " " + formatNumber(q.y()) + " " +
           formatNumber(q.z());
  }
  return "mean over the orientations fitted";
}

}  // namespace

std::string directionText(Direction direction) {
  return direction == Direction::kMeasuredToTrue ? "measured-to-true" : "true-to-measured";
}

ExportSubject::ExportSubject(const calibration::Corrector& corrector, const ExportOptions& options)
    : corrector_(corrector), is_inverse_(options.direction == Direction::kTrueToMeasured), options_(options) {
  std::vector<Eigen::Vector3d> places_m;
  for (const Node& node : corrector.table().nodes) places_m.push_back(node.tracker_from_sensor.position_m);
  const PointSpread spread = pointSpread(places_m);
  extent_m_ = std::max(kLeastExtent_m, 2.0 * spread.sd_m.norm());
  middle_m_ = spread.center_m;
  double least_m = HUGE_VAL;
  for (const Eigen::Vector3d& p_m : places_m) {
    const double distance_m = (p_m - spread.center_m).norm();
    if (distance_m >= least_m || !corrector.reaches(p_m)) continue;
    least_m = distance_m;
    middle_m_ = p_m;
  }
  if (corrector.turnTakesOrientation()) {
    if (options.orientation && !options.mean_orientation)
      mean_over_ = {*options.orientation};
    else
      mean_over_ = corrector.orientationsSeen();
  }
  if (!corrector.takesOrientation()) return;
  if (!options.mean_orientation) orientation_ = options.orientation;
  for (const Eigen::Quaterniond& q : corrector.orientationsSeen())
    for (const Eigen::Vector3d& p_m : places_m)
      change_m_ = std::max(change_m_, (corrector.correct(Pose{p_m, q}).position_m - forward_m(p_m)).norm());
}

Eigen::Vector3d ExportSubject::covered_m(const Eigen::Vector3d& p_tracked_m) const {
  return orientation_ ? corrector_.correct(Pose{p_tracked_m, *orientation_}).position_m
                      : corrector_.correctPosition_m(p_tracked_m);
}

/// The farthest point on the way from the middle that the method reaches.
Eigen::Vector3d ExportSubject::insidePoint_m(const Eigen::Vector3d& p_tracked_m) const {
  double inside = 0.0, outside = 1.0;
  for (int step = 0; step < kBisections; ++step) {
    const double tried = 0.5 * (inside + outside);
    (corrector_.reaches(middle_m_ + tried * (p_tracked_m - middle_m_)) ? inside : outside) = tried;
  }
  return middle_m_ + inside * (p_tracked_m - middle_m_);
}

Eigen::Vector3d ExportSubject::forward_m(const Eigen::Vector3d& p_tracked_m) const {
  if (corrector_.reaches(p_tracked_m)) return covered_m(p_tracked_m);
  const Pose& reference_from_tracker = corrector_.alignment().reference_from_tracker;
  if (!corrector_.reaches(middle_m_)) return reference_from_tracker * p_tracked_m;
  const Eigen::Vector3d edge_m = insidePoint_m(p_tracked_m);
  const auto error_m = [&](const Eigen::Vector3d& p_m) {
    return Eigen::Vector3d(covered_m(p_m) - reference_from_tracker * p_m);
  };
  const double beyond_m = (p_tracked_m - edge_m).norm();
  const Eigen::Vector3d at_edge_m = error_m(edge_m);
  if (!(beyond_m > 0.0)) return reference_from_tracker * p_tracked_m + at_edge_m;
  const Eigen::Vector3d before_m = edge_m - kAlongStep_m * (p_tracked_m - edge_m) / beyond_m;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  if (corrector_.reaches(before_m)) slope = (at_edge_m - error_m(before_m)) / kAlongStep_m;
  const double level_m = kLevelsOffWithin * extent_m_;
  return reference_from_tracker * p_tracked_m + at_edge_m + slope * level_m * std::tanh(beyond_m / level_m);
}

Eigen::Vector3d ExportSubject::inverse_m(const Eigen::Vector3d& p_true_m) const {
  const Pose tracker_from_reference = inverse(corrector_.alignment().reference_from_tracker);
  Eigen::Vector3d p_m = tracker_from_reference * p_true_m;
  Eigen::Vector3d left_m = forward_m(p_m) - p_true_m;
  int n_slow = 0;
  for (int step = 0; step < kNewtonSteps && n_slow < kMostSlowSteps && left_m.norm() > kInverseTolerance_m; ++step) {
    Eigen::Matrix3d jacobian;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d h_m = kAlongStep_m * Eigen::Vector3d::Unit(axis);
      jacobian.col(axis) = (forward_m(p_m + h_m) - forward_m(p_m - h_m)) / (2.0 * kAlongStep_m);
    }
    Eigen::Vector3d move_m = -(jacobian.fullPivLu().solve(left_m));
    if (!move_m.allFinite() || move_m.norm() > extent_m_) move_m = -(tracker_from_reference.orientation * left_m);
    double share = 1.0;
    Eigen::Vector3d next_m = forward_m(p_m + move_m) - p_true_m;
    while (next_m.norm() >= left_m.norm() && share > 1e-4) {
      share *= 0.5;
      next_m = forward_m(p_m + share * move_m) - p_true_m;
    }
    if (next_m.norm() >= left_m.norm()) break;
    n_slow = next_m.norm() > kSlow * left_m.norm() ? n_slow + 1 : 0;
    p_m += share * move_m;
    left_m = next_m;
  }
  return p_m;
}

Eigen::Quaterniond ExportSubject::rotation(const Eigen::Vector3d& p_tracked_m) const {
  const auto turnAt = [&](const Eigen::Quaterniond& q_tracked) {
    const Eigen::Quaterniond q_true = corrector_.correct(Pose{p_tracked_m, q_tracked}).orientation;
    return canonical(q_true * corrector_.alignment().mountOf({}).conjugate() * q_tracked.conjugate());
  };
  if (mean_over_.empty()) return turnAt(orientation_.value_or(Eigen::Quaterniond::Identity()));
  std::vector<Eigen::Quaterniond> turns;
  for (const Eigen::Quaterniond& q_tracked : mean_over_) turns.push_back(turnAt(q_tracked));
  return canonical(meanRotation(turns));
}

void ExportSubject::tellOfTurns(Written& written) const {
  if (mean_over_.empty()) return;
  written.notes.emplace_back(
      "How orientations are corrected changes with how the sensor is turned, and this format knows one turn for each "
      "position: " +
      std::string(mean_over_.size() == 1 ? "that of one orientation." : "the mean over those that were fitted."));
}

std::optional<double> ExportSubject::uncertainty_m(const Eigen::Vector3d& p_tracked_m) const {
  return orientation_ ? corrector_.uncertaintyAt_m(Pose{p_tracked_m, *orientation_})
                      : corrector_.uncertainty_m(p_tracked_m);
}

bool ExportSubject::holds(const Eigen::Vector3d& p_m) const {
  return corrector_.covers(is_inverse_ ? inverse_m(p_m) : p_m);
}

std::vector<Eigen::Vector3d> ExportSubject::places_m() const {
  std::vector<Eigen::Vector3d> places_m;
  for (const Node& node : corrector_.table().nodes) {
    const Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
    places_m.push_back(is_inverse_ ? forward_m(p_m) : p_m);
  }
  return places_m;
}

std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> ExportSubject::probes(std::size_t n) const {
  const double margin_m = corrector_.region().margin_m();
  Eigen::Vector3d low_m = middle_m_, high_m = middle_m_;
  for (const Node& node : corrector_.table().nodes) {
    low_m = low_m.cwiseMin(node.tracker_from_sensor.position_m);
    high_m = high_m.cwiseMax(node.tracker_from_sensor.position_m);
  }
  low_m.array() -= margin_m;
  high_m.array() += margin_m;
  std::mt19937_64 generator(20040);
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> probes;
  for (std::size_t draw = 0; draw < kMostDrawsPerProbe * n && probes.size() < n; ++draw) {
    const double a = uniform(), b = uniform(), c = uniform();
    const Eigen::Vector3d p_m = low_m + Eigen::Vector3d(a, b, c).cwiseProduct(high_m - low_m);
    if (!corrector_.covers(p_m)) continue;
    const Eigen::Vector3d goes_m = forward_m(p_m);
    probes.push_back(is_inverse_ ? std::pair{goes_m, p_m} : std::pair{p_m, goes_m});
  }
  return probes;
}

Eigen::Matrix3d ExportSubject::rigAxes() const {
  if (is_inverse_) return Eigen::Matrix3d::Identity();
  return corrector_.alignment().reference_from_tracker.orientation.conjugate().toRotationMatrix();
}

Facts ExportSubject::facts(const std::string& unit) const {
  const calibration::CorrectorChoice& choice = corrector_.choice();
  const TableMetadata& metadata = corrector_.table().metadata;
  const bool aligned = corrector_.align() == calibration::AlignMode::kRigid;
  const std::string true_frame = metadata.frame + (aligned ? " (aligned to the tracker by a rigid fit)" : "");
  std::set<int> places;
  for (const Node& node : corrector_.table().nodes) places.insert(node.node);
  Facts facts = {{"software", "Fieldtrue " FIELDTRUE_VERSION},
                 {"calibration", options_.name.empty() ? "not named" : options_.name},
                 {"date", metadata.date.value_or("not stated")},
                 {"direction", directionText(options_.direction)},
                 {"unit", unit},
                 {"handedness", "right-handed"},
                 {"input_frame", is_inverse_ ? true_frame : "tracker"},
                 {"output_frame", is_inverse_ ? "tracker" : true_frame},
                 {"position_method", correctors::methodText(choice.position_id, choice.position_settings)},
                 {"orientation_method", correctors::methodText(choice.orientation_id, choice.orientation_settings)},
                 {"places", std::to_string(places.size())},
                 {"rows", std::to_string(corrector_.report().n_nodes)}};
  facts.emplace_back("held_out_rms_mm", options_.held_out ? shortNumber(1000.0 * options_.held_out->rms_m) + " (" +
                                                                options_.held_out->validated + ")"
                                                          : "not known");
  facts.emplace_back("in_sample_rms_mm", shortNumber(1000.0 * corrector_.report().rms_m));
  if (corrector_.takesOrientation()) {
    facts.emplace_back("at_orientation", orientationFact(options_));
    facts.emplace_back("largest_change_with_orientation_mm", shortNumber(1000.0 * change_m_));
  }
  for (const auto& [key, value] : corrector_.setup()) facts.emplace_back("setup." + key, value);
  return facts;
}

std::string factLines(const Facts& facts, const std::string& prefix) {
  std::string text;
  for (const auto& [key, value] : facts) {
    std::string line = value;
    std::replace(line.begin(), line.end(), '\n', ' ');
    text += prefix;
    text += key;
    text += ": ";
    text += line;
    text += '\n';
  }
  return text;
}

}  // namespace fieldtrue::exporters
