#pragma once

#include <vector>

#include "tests/blind/figures.h"

namespace blind {

/// What the reports take away in the hull over what the oracle does, by strength; nothing where `oracle` or `foretell`
/// did not run. A session that was not answered, or whose answer explains nothing, took nothing away.
void addOracleFigures(std::vector<Figure>& figures, const std::vector<const Session*>& sessions);

}  // namespace blind
