#pragma once

#include <vector>

#include "tests/blind/figures.h"

namespace blind {

/// How often the replicates of a diagnosis name what it named, beside how often that is the truth, where one effect is
/// true and something was named; nothing where `replicate` did not run.
void addReplicateFigures(std::vector<Figure>& figures, const std::vector<const Session*>& sessions);

}  // namespace blind
