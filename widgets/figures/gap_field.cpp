#include "widgets/figures/gap_field.h"

#include <map>
#include <utility>

#include "widgets/figures/gap_bodies.h"

namespace fieldtrue::widgets {

ErrorField gapField(const gap::GapReport& report, bool after, const CalibrationTable* table) {
  std::map<std::pair<int, int>, Eigen::Vector3d> places_m;
  if (table)
    for (const Node& row : table->nodes)
      places_m.emplace(std::pair(row.node, row.visit), row.reference_from_sensor.position_m);
  const Pose reference_from_tracker = inverse(report.tracker_from_reference);
  ErrorField field;
  field.title = after            ? QStringLiteral("Gap with the causes added")
                : report.against ? QStringLiteral("What changed since the earlier recording")
                                 : QStringLiteral("Gap as simulated now");
  field.reference_from_tracker = reference_from_tracker;
  field.bodies = believedBodies(report);
  for (const gap::GapNode& node : report.nodes) {
    FieldArrow arrow;
    const auto place = places_m.find({node.node, node.visit});
    arrow.from_m = place != places_m.end() ? place->second : reference_from_tracker * node.place_m;
    arrow.error_m = reference_from_tracker.orientation * (after ? node.after_m : node.before_m);
    arrow.node = node.node;
    arrow.name = QString::fromStdString(report.names.of(node.node));
    arrow.flagged = node.is_flagged;
    field.arrows.push_back(std::move(arrow));
  }
  return field;
}

}  // namespace fieldtrue::widgets
