#pragma once

#include <QByteArray>
#include <QString>
#include <functional>
#include <span>
#include <variant>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "widgets/figures/error_field.h"

/// What a picture shows, told without drawing it: a page can be written where nothing can be drawn, and drawn
/// elsewhere.
namespace fieldtrue::widgets {

/// The error field as FieldView draws it.
struct FieldPicture {
  ErrorField field;
  double scale_max_mm = 1.0;
  double magnification = 1.0;
};

/// How many places have which error, as HistogramView draws it.
struct HistogramPicture {
  std::vector<QString> names;  ///< Of the series.
  std::vector<std::vector<double>> values_mm;
  QString axis_title;
};

/// The room with every place by its state, as RoomView draws it.
struct RoomPicture {
  std::vector<PlannedPlace> places;
  std::vector<acquisition::PlaceState> states;  ///< One a place.
  Pose reference_from_tracker;
};

struct PictureRequest {
  std::variant<FieldPicture, HistogramPicture, RoomPicture> content;
  int width_px = 0;  ///< Text and lines grow with it.
  int height_px = 0;
  bool dark = false;
};

/// Draws pictures as PNG files. @return one for each request; @error why it could not be drawn, without a full stop
using DrawPictures = std::function<std::vector<Result<QByteArray>>(std::span<const PictureRequest> requests)>;

/// Requests and drawn pictures as bytes, for a program that draws for another one of the same version.
QByteArray toBytes(std::span<const PictureRequest> requests);
QByteArray toBytes(std::span<const Result<QByteArray>> drawn);
/// @error kBadInput for bytes that are cut short, or of another version
Result<std::vector<PictureRequest>> requestsFromBytes(const QByteArray& bytes);
Result<std::vector<Result<QByteArray>>> picturesFromBytes(const QByteArray& bytes);

}  // namespace fieldtrue::widgets
