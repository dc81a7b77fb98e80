#pragma once

#include <QImage>
#include <QSize>
#include <QString>
#include <vector>

#include "acquisition/session/session_store.h"
#include "widgets/views/error_field.h"

namespace fieldtrue {

/// The error field as a picture, drawn as FieldView draws it but without a window; needs neither a display nor a
/// QGuiApplication. Call from one thread at a time.
/// @param size in pixels; text and lines grow with it
/// @param why when given, receives the reason of a null picture in words
/// @return a null image when this machine offers no way to draw
QImage renderFieldPicture(const ErrorField& field, double scale_max_mm, double magnification, QSize size, bool dark,
                          QString* why = nullptr);

/// The room with every place by its state, as RoomView draws it. @see renderFieldPicture
QImage renderRoomPicture(const std::vector<PlannedPlace>& places, const std::vector<PlaceState>& states,
                         const Pose& reference_from_tracker, QSize size, bool dark, QString* why = nullptr);

/// The histogram as HistogramView draws it. @see renderFieldPicture
QImage renderHistogramPicture(const std::vector<QString>& names, const std::vector<std::vector<double>>& values_mm,
                              const QString& axis_title, QSize size, bool dark, QString* why = nullptr);

}  // namespace fieldtrue
