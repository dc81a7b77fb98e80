#include "calib/calibration/corrector.h"

#include <algorithm>
#include <cmath>

#include "calib/calibration/alignment.h"
#include "calib/calibration/coincident_places.h"
#include "calib/calibration/mirrored_sensors.h"
#include "calib/calibration/missing_orientations.h"
#include "calib/calibration/outlying_places.h"
#include "calib/calibration/placed_sensors.h"
#include "calib/core/statistics.h"
#include "calib/correctors/baked/baked_position.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/registry.h"
#include "calib/geometry/spacing.h"
#include "calib/tables/table_sensors.h"
#include "calib/tables/table_setup.h"

namespace fieldtrue::calibration {
namespace {

/// A place is inside when it is nearer to a measured one than a quarter of the usual spacing: readings at the outermost
/// places scatter around the hull, while half a spacing out the next row of the grid would have been due.
constexpr double kMarginOfSpacing = 0.25;

template <class Model>
Result<Settings> resolveMethod(const Result<const correctors::CorrectionMethod<Model>*>& method,
                               const MethodText& text) {
  if (!method) return tl::unexpected(method.error());
  return resolveSettings(text.id, (*method)->settings, text.given);
}

FitReport reportOf(std::span<const Node> nodes, const Corrector& corrector) {
  FitReport report;
  report.n_nodes = nodes.size();
  const Alignment& alignment = corrector.alignment();
  double before_squares_m2 = 0.0;
  double after_squares_m2 = 0.0;
  double angle_squares_rad2 = 0.0;
  std::size_t n_orientations = 0;
  for (const Node& node : nodes) {
    const Eigen::Vector3d& p_true_m = node.reference_from_sensor.position_m;
    const Pose corrected = corrector.correct(node.tracker_from_sensor, node.sensor);
    before_squares_m2 +=
        (alignment.reference_from_tracker * node.tracker_from_sensor.position_m - p_true_m).squaredNorm();
    const double after_m = (corrected.position_m - p_true_m).norm();
    after_squares_m2 += after_m * after_m;
    report.max_m = std::max(report.max_m, after_m);
    if (!node.has_orientation) continue;
    const double angle_rad = angleBetween_rad(corrected.orientation, node.reference_from_sensor.orientation);
    angle_squares_rad2 += angle_rad * angle_rad;
    ++n_orientations;
  }
  const auto n_rows = static_cast<double>(nodes.size());
  report.rms_before_mm = 1000.0 * std::sqrt(before_squares_m2 / n_rows);
  report.rms_m = std::sqrt(after_squares_m2 / n_rows);
  if (n_orientations > 0)
    report.orientation_rms_rad = std::sqrt(angle_squares_rad2 / static_cast<double>(n_orientations));
  return report;
}

/// That axes are wrong, which the correction would hide; empty where they are not.
std::string mirroredNote(std::span<const Node> nodes) {
  const std::string text = mirroredText(nodes);
  return text.empty() ? text : "Put right before anything is corrected: " + text + ".";
}

/// A note with whose it is; empty where there is none.
std::string named(const std::string& whose, const std::string& note) {
  return whose.empty() || note.empty() ? note : whose + ": " + note;
}

/// Of a correction's two parts.
struct Wanted {
  bool position = true;
  bool orientation = true;
};

/// What the parts of a correction are fitted with.
struct PartsFit {
  const correctors::PositionMethod& position_method;
  const correctors::OrientationMethod& orientation_method;
  const TableMetadata& metadata;
  const CorrectorChoice& choice;
  const RunControl& control;
  const Alignment& alignment;
  std::vector<std::string>& notes;

  /// Fits the parts that are wanted to some rows, and leaves the others as they are.
  Result<void> to(std::span<const Node> rows, const std::string& whose, Wanted wanted, Correction& correction) const {
    const correctors::FitData data = makeFitData(rows, metadata, alignment);
    FT_TRY_VOID(correctors::checkPositions(data, "A calibration"));
    if (wanted.position) {
      FT_TRY(correction.position, position_method.fit(data, choice.position_settings, control));
      correction.region = Region::around(data.p_tracked_m, data.dimension,
                                         kMarginOfSpacing * medianSpacing_m(correctors::mergePlaces(data).p_tracked_m));
      notes.push_back(named(whose, correctors::planeNote(data, "nothing is claimed off it")));
      notes.push_back(named(whose, correction.position->note()));
    }
    if (wanted.orientation) {
      FT_TRY(correction.orientation, orientation_method.fit(data, choice.orientation_settings, control));
      notes.push_back(named(whose, named("Orientation", correction.orientation->note())));
    }
    return {};
  }
};

/// Gives each sensor the parts that are to be its own; the first one's stand for a sensor that was not fitted.
Result<void> fitApart(const PartsFit& fit, std::span<const Node> rows, const std::vector<int>& sensors, Wanted apart,
                      Evaluator::Parts& parts) {
  for (const int sensor : sensors) {
    const std::string whose = "Sensor " + std::to_string(sensor);
    Correction own = parts;
    const auto fitted = fit.to(nodesOfSensor(rows, sensor), whose, apart, own);
    if (!fitted) return fail(fitted.error().code, named(whose, fitted.error().message));
    parts.by_sensor[sensor] = std::move(own);
  }
  static_cast<Correction&>(parts) = parts.by_sensor.begin()->second;
  return {};
}

}  // namespace

Result<CorrectorChoice> parseCorrectorChoice(const std::string& position_text, const std::string& orientation_text) {
  FT_TRY(const auto position, parseMethodText(position_text));
  FT_TRY(const auto orientation, parseMethodText(orientation_text));
  FT_TRY(auto position_settings, resolveMethod(correctors::findPositionMethod(position.id), position));
  FT_TRY(auto orientation_settings, resolveMethod(correctors::findOrientationMethod(orientation.id), orientation));
  return CorrectorChoice{position.id, std::move(position_settings), orientation.id, std::move(orientation_settings)};
}

Result<Corrector> Corrector::fit(std::span<const Node> nodes, const TableMetadata& metadata,
                                 const CorrectorChoice& choice, AlignMode align, const RunControl& control) {
  FT_TRY(const auto position_method, correctors::findPositionMethod(choice.position_id));
  FT_TRY(const auto orientation_method, correctors::findOrientationMethod(choice.orientation_id));

  const PlacedSensors placed = placedSensors(nodes, align);
  nodes = placed.nodes;
  Parts parts;
  if (align == AlignMode::kRigid) {
    FT_TRY(auto alignment, fitAlignment(nodes, metadata.jig_tolerance_m));
    parts.alignment = alignment;
  }
  std::vector<Node> rows(nodes.begin(), nodes.end());
  std::vector<std::string> notes{mirroredNote(nodes), joinCoincidentPlaces(rows), placed.note(),
                                 missingOrientationsNote(nodes),
                                 outlyingNote(nodes, parts.alignment.reference_from_tracker, metadata.jig_tolerance_m,
                                              align == AlignMode::kRigid)};
  const PartsFit fit{*position_method, *orientation_method, metadata, choice, control, parts.alignment, notes};
  const std::vector<int> sensors = sensorsOf(rows);
  const Wanted apart{choice.separate_position && sensors.size() > 1, choice.separate_orientation && sensors.size() > 1};
  FT_TRY_VOID(fit.to(rows, "", {!apart.position, !apart.orientation}, parts));
  if (apart.position || apart.orientation) FT_TRY_VOID(fitApart(fit, rows, sensors, apart, parts));

  Corrector corrector(std::move(parts));
  corrector.choice_ = choice;
  corrector.choice_.separate_position = apart.position;
  corrector.choice_.separate_orientation = apart.orientation;
  corrector.align_ = align;
  corrector.table_ = {metadata, {nodes.begin(), nodes.end()}};
  corrector.setup_ = setupOf(corrector.table_);
  corrector.report_ = reportOf(nodes, corrector);
  for (const std::string& note : notes) {
    std::vector<std::string>& told = corrector.report_.notes;
    if (!note.empty() && std::find(told.begin(), told.end(), note) == told.end()) told.push_back(note);
  }
  return corrector;
}

Result<Corrector> Corrector::ofSensor(int sensor) const {
  const std::vector<int> sensors = sensorsOf(table_.nodes);
  if (std::find(sensors.begin(), sensors.end(), sensor) == sensors.end())
    return fail(ErrorCode::kBadInput, "This calibration was fitted on " + sensorsText(sensors) +
                                          ", and knows nothing of sensor " + std::to_string(sensor));
  if (sensors.size() == 1) return *this;
  FT_TRY(auto alone, partsOf(sensor));
  Corrector corrector(std::move(alone));
  corrector.choice_ = choice_;
  corrector.choice_.separate_position = corrector.choice_.separate_orientation = false;
  corrector.align_ = align_;
  corrector.setup_ = setup_;
  corrector.setup_["sensor"] = std::to_string(sensor);
  corrector.table_ =
      sensorsApart().empty() ? table_ : CalibrationTable{table_.metadata, nodesOfSensor(table_.nodes, sensor)};
  corrector.report_ = reportOf(corrector.table_.nodes, corrector);
  corrector.report_.notes = report_.notes;
  return corrector;
}

Corrector Corrector::withNote(const std::string& note) const {
  Corrector corrector = *this;
  corrector.report_.notes.push_back(note);
  return corrector;
}

Corrector Corrector::imported(Parts parts, CorrectorChoice choice, CalibrationTable table,
                              std::vector<std::string> notes) {
  if (!parts.orientation) {
    const nlohmann::json nothing = nlohmann::json::object();
    parts.orientation = correctors::readNoneOrientation(JsonReader(nothing, "no orientation"));
  }
  Corrector corrector(std::move(parts));
  corrector.choice_ = std::move(choice);
  corrector.table_ = std::move(table);
  corrector.report_ = reportOf(corrector.table_.nodes, corrector);
  corrector.report_.notes = std::move(notes);
  return corrector;
}

Result<Corrector> Corrector::baked(double max_deviation_m, const RunControl& control) const {
  if (!(max_deviation_m > 0.0) || !std::isfinite(max_deviation_m))
    return fail(ErrorCode::kBadInput, "A lattice needs a largest deviation above 0 to be baked to");
  if (isBaked())
    return fail(ErrorCode::kUnsupported,
                "This calibration is baked already; bake anew from the one that was fitted, or fit it again");
  const auto bake = [&](Correction& correction, std::span<const Node> rows) -> Result<void> {
    std::vector<Eigen::Vector3d> places_m;
    for (const Node& node : rows) places_m.push_back(node.tracker_from_sensor.position_m);
    FT_TRY(correction.position, correctors::bakePosition(*correction.position, correction.region, places_m,
                                                         orientationsSeen(), max_deviation_m, control));
    correction.is_baked = true;
    return {};
  };
  Parts baked_parts = parts();
  for (auto& [sensor, correction] : baked_parts.by_sensor)
    FT_TRY_VOID(bake(correction, nodesOfSensor(table_.nodes, sensor)));
  if (baked_parts.by_sensor.empty())
    FT_TRY_VOID(bake(baked_parts, table_.nodes));
  else
    static_cast<Correction&>(baked_parts) = baked_parts.by_sensor.begin()->second;
  Corrector corrector(std::move(baked_parts));
  corrector.choice_ = choice_;
  corrector.align_ = align_;
  corrector.table_ = table_;
  corrector.setup_ = setup_;
  corrector.report_ = reportOf(table_.nodes, corrector);
  corrector.report_.notes = report_.notes;
  for (const auto& [sensor, correction] : corrector.parts().by_sensor)
    corrector.report_.notes.push_back(named("Sensor " + std::to_string(sensor), correction.position->note()));
  if (corrector.parts().by_sensor.empty()) corrector.report_.notes.push_back(corrector.parts().position->note());
  if (takesOrientation())
    corrector.report_.notes.push_back(
        "Baked with the sensor's orientation: within the bound at poses drawn in the region.");
  return corrector;
}

std::vector<Eigen::Quaterniond> Corrector::orientationsSeen() const {
  std::vector<Eigen::Quaterniond> orientations;
  for (const Node& node : table_.nodes)
    if (node.has_orientation) orientations.push_back(node.tracker_from_sensor.orientation);
  return distinctRotations(orientations, correctors::kSameOrientation_rad);
}

}  // namespace fieldtrue::calibration
