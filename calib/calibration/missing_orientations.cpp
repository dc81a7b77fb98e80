#include "calib/calibration/missing_orientations.h"

#include <algorithm>

namespace fieldtrue::calibration {

std::string missingOrientationsNote(std::span<const Node> nodes) {
  const auto n_without =
      std::count_if(nodes.begin(), nodes.end(), [](const Node& node) { return !node.has_orientation; });
  if (n_without == 0 || static_cast<std::size_t>(n_without) == nodes.size()) return {};
  return std::to_string(n_without) + " of " + std::to_string(nodes.size()) +
         " rows have no orientation, so that no orientation is used: complete these rows, or leave them out.";
}

}  // namespace fieldtrue::calibration
