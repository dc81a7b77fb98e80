#include "widgets/pages/error_fields.h"

#include <map>

namespace fieldtrue {
namespace {

const MethodScore* findScore(const std::vector<MethodScore>& scores, const QString& method) {
  for (const MethodScore& score : scores)
    if (!score.skipped && score.method == method.toStdString()) return &score;
  return nullptr;
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

}  // namespace

std::vector<double> heldOutErrors_mm(const Comparison& comparison, const QString& method) {
  const MethodScore* score = findScore(comparison.position, method);
  return score ? score->place_errors : comparison.before_place_mm;
}

ErrorField heldOutField(const Comparison& comparison, const CalibrationTable& table, const QString& method,
                        const QString& orientation_method, const QString& title) {
  ErrorField field;
  field.title = title;
  const MethodScore* score = findScore(comparison.position, method);
  const MethodScore* turned =
      findScore(comparison.orientation, orientation_method.isEmpty() ? QStringLiteral("none") : orientation_method);
  const std::vector<Eigen::Vector3d>& residual_m = score ? score->residual_m : comparison.before_residual_m;
  const std::map<int, Eigen::Vector3d> true_m = truePositions_m(table);
  const auto alignment = fitAlignment(table.nodes);
  if (alignment) field.reference_from_tracker = alignment->reference_from_tracker;
  for (std::size_t i = 0; i < comparison.places.size() && i < residual_m.size(); ++i) {
    const auto place = true_m.find(comparison.places[i]);
    if (place == true_m.end()) continue;
    FieldArrow arrow;
    arrow.from_m = place->second;
    arrow.error_m = residual_m[i];
    arrow.node = comparison.places[i];
    if (turned && i < turned->place_errors.size()) arrow.angle_deg = turned->place_errors[i];
    field.arrows.push_back(arrow);
  }
  return field;
}

}  // namespace fieldtrue
