#pragma once

#include <string>
#include <vector>

#include "widgets/figures/picture_request.h"

namespace fieldtrue::widgets {

class HtmlWriter;

inline constexpr int kFieldWidth_px = 900;
inline constexpr int kFieldHeight_px = 700;

/// One picture of a page.
struct CaptionedPicture {
  std::string id;  ///< Of its figure.
  std::string caption;
  PictureRequest content;  ///< In light colours.
};

/// Draws every picture for a light and for a dark page and writes them as figures; says why some or all are missing.
/// @param draw none = they were not asked for
void writePictures(HtmlWriter& html, const std::vector<CaptionedPicture>& pictures, const DrawPictures& draw);

}  // namespace fieldtrue::widgets
