#pragma once

#include <QString>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue::widgets {

/// A page of the guide: `resources/guide/<id>.md`, compiled in.
struct GuidePage {
  QString id;
  QString title;  ///< As the index calls it.
};

inline constexpr const char* kGuideIndex = "index";

/// The index, then the pages that it links to, in its order.
const std::vector<GuidePage>& guidePages();

/// A page's Markdown.
/// @error kBadInput naming the pages there are
Result<QString> guideText(const QString& id);

}  // namespace fieldtrue::widgets
