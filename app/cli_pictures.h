#pragma once

#include "widgets/figures/picture_request.h"

namespace fieldtrue::cli {

/// Draws by the program `fieldtrue-pictures` beside this one. Where that is missing or fails every picture has the
/// reason, and what asked for it goes on.
std::vector<Result<QByteArray>> drawByProgram(std::span<const widgets::PictureRequest> requests);

}  // namespace fieldtrue::cli
