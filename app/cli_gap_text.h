#pragma once

#include <string>

#include "calib/gap/report.h"

/// What people read on the terminal of a diagnosis.
namespace fieldtrue::cli {

/// The verdict first, then where the gap lies, what was found, which causes were weighed, how far each shrinks it, what
/// remains, and the next measurement last.
std::string gapText(const gap::GapReport& report);

/// Pairs of effects by how alike they look on a grid, most alike first, and the advice.
std::string isolabilityText(const gap::Isolability& isolability);

}  // namespace fieldtrue::cli
