#include "widgets/report/report_pictures.h"

#include <utility>

#include "acquisition/plan/place_state.h"
#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/number_text.h"
#include "calib/correctors/method_label.h"
#include "widgets/figures/field_scale.h"
#include "widgets/report/numbers.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kChartHeight_px = 480;

std::string bestLabel(const evaluation::Comparison& comparison) {
  const evaluation::MethodScore* best = bestPosition(comparison);
  return best == nullptr ? correctors::positionLabel("none") : correctors::positionLabel(best->method, best->settings);
}

ErrorField errorField(const std::vector<PlaceSummary>& places, const std::string& title, bool after,
                      const Pose& reference_from_tracker) {
  ErrorField field;
  field.title = QString::fromStdString(title);
  field.reference_from_tracker = reference_from_tracker;
  for (const PlaceSummary& place : places) {
    FieldArrow arrow;
    arrow.from_m = place.p_true_m;
    arrow.error_m = after ? place.after_m : place.before_m;
    arrow.node = place.node;
    arrow.validation = place.validation;
    if (!after) arrow.angle_deg = place.before_deg;
    arrow.name = QString::fromStdString(place.name);
    field.arrows.push_back(std::move(arrow));
  }
  return field;
}

/// Where the transmitter stands, as well as the table tells.
Pose transmitterPose(const ReportInput& input) {
  if (input.comparison.align == calibration::AlignMode::kNone) return {};
  std::vector<Node> nodes;
  for (const Node& node : input.table.nodes) {
    if (node.role != NodeRole::kSkipped) nodes.push_back(node);
  }
  const auto alignment = calibration::fitAlignment(nodes, input.table.metadata.jig_tolerance_m);
  return alignment ? alignment->reference_from_tracker : Pose{};
}

void addFields(std::vector<CaptionedPicture>& pictures, const ReportInput& input,
               const std::vector<PlaceSummary>& places, const Pose& reference_from_tracker) {
  const FieldScale scale = fieldScale(errorField(places, {}, false, reference_from_tracker));
  const std::string legend =
      "; colours to " + significantText(scale.max_mm) + " mm, arrows x" + significantText(scale.magnification, 2);
  const auto add = [&](const char* id, const std::string& title, bool after) {
    FieldPicture field{errorField(places, title, after, reference_from_tracker), scale.max_mm, scale.magnification};
    pictures.push_back({id, title + legend, {std::move(field), kFieldWidth_px, kFieldHeight_px}});
  };
  add("before", "Error before", false);
  if (bestPosition(input.comparison) == nullptr) return;
  add("after", "Error after " + bestLabel(input.comparison) + ", on places the fit did not see", true);
}

CaptionedPicture histogram(const ReportInput& input, const std::vector<PlaceSummary>& places) {
  HistogramPicture histogram{{QStringLiteral("Before")}, {{}}, QStringLiteral("Position error (mm)")};
  for (const PlaceSummary& place : places) histogram.values_mm.front().push_back(place.before_mm);
  if (bestPosition(input.comparison) != nullptr) {
    histogram.names.push_back(QString::fromStdString("After " + bestLabel(input.comparison)));
    histogram.values_mm.emplace_back();
    for (const PlaceSummary& place : places) histogram.values_mm.back().push_back(place.after_mm);
  }
  return {"histogram", "How many places have which error", {std::move(histogram), kFieldWidth_px, kChartHeight_px}};
}

CaptionedPicture room(const ReportInput& input, const Pose& reference_from_tracker) {
  RoomPicture room{input.places, input.states, reference_from_tracker};
  if (room.places.empty()) {
    room.states.clear();
    for (const Node& node : input.table.nodes) {
      room.places.push_back({node.node, node.visit, node.index, node.reference_from_sensor, node.role});
      room.states.push_back(node.role == NodeRole::kSkipped ? acquisition::PlaceState::kSkipped
                                                            : acquisition::PlaceState::kDone);
    }
  }
  return {"room",
          "The room: places by their state, and the transmitter",
          {std::move(room), kFieldWidth_px, kFieldHeight_px}};
}

}  // namespace

std::vector<CaptionedPicture> reportPictures(const ReportInput& input, const std::vector<PlaceSummary>& places) {
  const Pose reference_from_tracker = transmitterPose(input);
  std::vector<CaptionedPicture> pictures;
  addFields(pictures, input, places, reference_from_tracker);
  pictures.push_back(histogram(input, places));
  pictures.push_back(room(input, reference_from_tracker));
  return pictures;
}

}  // namespace fieldtrue::widgets
