#include "widgets/workbench/compared_methods.h"

#include "calib/calibration/alignment.h"
#include "calib/correctors/method_label.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

MethodRow rowOf(const std::vector<evaluation::MethodScore>& scores, const QString& method) {
  MethodRow best;
  for (std::size_t row = 0; row < scores.size(); ++row) {
    if (scores[row].skipped || scores[row].method == "none" || scores[row].method != method.toStdString()) continue;
    if (!best || scores[row].stats.rms < scores[*best].stats.rms) best = row;
  }
  return best;
}

/// The arrows' places with zero errors: what all fields of a comparison share.
ErrorField emptyField(const evaluation::Comparison& comparison, const CalibrationTable& table) {
  ErrorField field;
  const std::map<int, Eigen::Vector3d> true_m = truePositions_m(table);
  const auto alignment = calibration::fitAlignment(table.nodes, table.metadata.jig_tolerance_m);
  if (alignment) field.reference_from_tracker = alignment->reference_from_tracker;
  std::map<int, bool> validation;
  for (const Node& node : table.nodes) validation[node.node] = node.role == NodeRole::kValidation;
  for (const int node : comparison.places) {
    const auto place = true_m.find(node);
    FieldArrow& arrow = field.arrows.emplace_back();
    arrow.node = node;
    arrow.name = QString::fromStdString(comparison.names.of(node));
    if (place != true_m.end()) arrow.from_m = place->second;
    arrow.validation = validation[node];
  }
  return field;
}

const std::vector<Eigen::Vector3d>& residuals_m(const evaluation::Comparison& comparison, MethodRow row) {
  return row ? comparison.position.at(*row).residual_m : comparison.before_residual_m;
}

}  // namespace

QString positionLabel(const evaluation::MethodScore& score) {
  return QString::fromStdString(correctors::positionLabel(score.method, score.settings));
}
QString orientationLabel(const evaluation::MethodScore& score) {
  return QString::fromStdString(correctors::orientationLabel(score.method, score.settings));
}

QString positionLabel(const evaluation::Comparison& comparison, MethodRow row) {
  return row ? positionLabel(comparison.position.at(*row)) : QObject::tr("Before correction");
}

MethodRow positionRow(const evaluation::Comparison& comparison, const QString& method) {
  return rowOf(comparison.position, method);
}
MethodRow orientationRow(const evaluation::Comparison& comparison, const QString& method) {
  return rowOf(comparison.orientation, method);
}

const std::vector<double>& heldOutErrors_mm(const evaluation::Comparison& comparison, MethodRow row) {
  return row ? comparison.position.at(*row).place_errors : comparison.before_place_mm;
}

std::map<int, Eigen::Vector3d> truePositions_m(const CalibrationTable& table) {
  std::map<int, Eigen::Vector3d> sum_m;
  std::map<int, int> count;
  for (const Node& node : table.nodes) {
    if (node.role == NodeRole::kSkipped) continue;
    auto [place, fresh] = sum_m.try_emplace(node.node, Eigen::Vector3d::Zero());
    place->second += node.reference_from_sensor.position_m;
    ++count[node.node];
  }
  for (auto& [node, position_m] : sum_m) position_m /= count[node];
  return sum_m;
}

ErrorField heldOutField(const evaluation::Comparison& comparison, const CalibrationTable& table, MethodRow position,
                        MethodRow orientation, const QString& title) {
  ErrorField field = emptyField(comparison, table);
  field.title = title;
  const std::vector<Eigen::Vector3d>& residual_m = residuals_m(comparison, position);
  const std::vector<double>& angles_deg =
      orientation ? comparison.orientation.at(*orientation).place_errors : comparison.before_place_deg;
  for (std::size_t i = 0; i < field.arrows.size(); ++i) {
    if (i < residual_m.size()) field.arrows[i].error_m = residual_m[i];
    if (i < angles_deg.size()) field.arrows[i].angle_deg = angles_deg[i];
  }
  return field;
}

ErrorField differenceField(const evaluation::Comparison& comparison, const CalibrationTable& table, MethodRow a,
                           MethodRow b) {
  ErrorField field = emptyField(comparison, table);
  const auto &of_a_m = residuals_m(comparison, a), &of_b_m = residuals_m(comparison, b);
  const auto &error_a_mm = heldOutErrors_mm(comparison, a), &error_b_mm = heldOutErrors_mm(comparison, b);
  for (std::size_t i = 0; i < field.arrows.size() && i < of_a_m.size() && i < of_b_m.size(); ++i) {
    field.arrows[i].error_m = of_a_m[i] - of_b_m[i];
    field.arrows[i].better_mm = error_a_mm[i] - error_b_mm[i];
  }
  return field;
}

}  // namespace fieldtrue::widgets
