#pragma once

#include <QImage>
#include <QString>
#include <span>
#include <vector>

#include "widgets/figures/picture_request.h"

namespace fieldtrue::widgets {

/// Draws as the window's views do, but without a window; needs neither a display nor a QGuiApplication. Call from one
/// thread at a time.
/// @param why when given, receives the reason of a null picture in words
/// @return a null image when this machine offers no way to draw
QImage renderPicture(const PictureRequest& request, QString* why = nullptr);

/// The same as PNG files: a DrawPictures.
std::vector<Result<QByteArray>> drawPictures(std::span<const PictureRequest> requests);

}  // namespace fieldtrue::widgets
