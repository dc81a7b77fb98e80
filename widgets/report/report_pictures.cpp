#include "widgets/report/report_pictures.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "calib/correctors/corrector.h"
#include "widgets/report/numbers.h"
#include "widgets/views/field_scale.h"
#include "widgets/views/picture.h"

namespace fieldtrue {
namespace {

constexpr QSize kFieldSize(900, 700);
constexpr QSize kChartSize(900, 480);

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
  if (input.comparison.align == AlignMode::kNone) return {};
  std::vector<Node> nodes;
  for (const Node& node : input.table.nodes) {
    if (node.role != NodeRole::kSkipped) nodes.push_back(node);
  }
  const auto alignment = fitAlignment(nodes);
  return alignment ? alignment->reference_from_tracker : Pose{};
}

/// Collects the pictures, and the first reason why one could not be drawn.
class Album {
 public:
  void add(const std::string& id, const std::string& caption,
           const std::function<QImage(bool dark, QString* why)>& draw) {
    QString why;
    ReportPicture picture{id, draw(false, &why), {}, caption};
    if (!picture.light.isNull()) picture.dark = draw(true, &why);
    if (picture.light.isNull() || picture.dark.isNull()) {
      if (pictures_.missing.empty()) pictures_.missing = why.isEmpty() ? "no reason given" : why.toStdString();
      return;
    }
    pictures_.drawn.push_back(std::move(picture));
  }
  ReportPictures take() { return std::move(pictures_); }

 private:
  ReportPictures pictures_;
};

void addFields(Album& album, const ReportInput& input, const std::vector<PlaceSummary>& places,
               const Pose& reference_from_tracker) {
  const FieldScale scale = fieldScale(errorField(places, {}, false, reference_from_tracker));
  const std::string legend =
      "; colours to " + significantText(scale.max_mm) + " mm, arrows x" + significantText(scale.magnification, 2);
  const auto add = [&](const char* id, const std::string& title, bool after) {
    const ErrorField field = errorField(places, title, after, reference_from_tracker);
    album.add(id, title + legend, [&](bool dark, QString* why) {
      return renderFieldPicture(field, scale.max_mm, scale.magnification, kFieldSize, dark, why);
    });
  };
  add("before", "Error before", false);
  if (bestPosition(input.comparison) == nullptr) return;
  add("after", "Error after " + positionLabel(input.comparison.best_position) + ", on places the fit did not see",
      true);
}

void addHistogram(Album& album, const ReportInput& input, const std::vector<PlaceSummary>& places) {
  std::vector<QString> names{QStringLiteral("Before")};
  std::vector<std::vector<double>> values_mm(1);
  for (const PlaceSummary& place : places) values_mm.front().push_back(place.before_mm);
  if (bestPosition(input.comparison) != nullptr) {
    names.push_back(QString::fromStdString("After " + positionLabel(input.comparison.best_position)));
    values_mm.emplace_back();
    for (const PlaceSummary& place : places) values_mm.back().push_back(place.after_mm);
  }
  album.add("histogram", "How many places have which error", [&](bool dark, QString* why) {
    return renderHistogramPicture(names, values_mm, QStringLiteral("Position error (mm)"), kChartSize, dark, why);
  });
}

void addRoom(Album& album, const ReportInput& input, const Pose& reference_from_tracker) {
  std::vector<PlannedPlace> planned = input.places;
  std::vector<PlaceState> states = input.states;
  if (planned.empty()) {
    states.clear();
    for (const Node& node : input.table.nodes) {
      planned.push_back({node.node, node.visit, node.index, node.reference_from_sensor, node.role});
      states.push_back(node.role == NodeRole::kSkipped ? PlaceState::kSkipped : PlaceState::kDone);
    }
  }
  album.add("room", "The room: places by their state, and the transmitter", [&](bool dark, QString* why) {
    return renderRoomPicture(planned, states, reference_from_tracker, kFieldSize, dark, why);
  });
}

}  // namespace

ReportPictures drawReportPictures(const ReportInput& input, const std::vector<PlaceSummary>& places) {
  if (!input.with_pictures) return {{}, "they were not asked for"};
  const Pose reference_from_tracker = transmitterPose(input);
  Album album;
  addFields(album, input, places, reference_from_tracker);
  addHistogram(album, input, places);
  addRoom(album, input, reference_from_tracker);
  return album.take();
}

}  // namespace fieldtrue
