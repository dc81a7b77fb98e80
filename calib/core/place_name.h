#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue {

/// What a person reads on a place: column letter, row number, level ("C4, pipe 3"); "P17" for scattered places.
std::string placeName(int node, const std::optional<std::array<int, 3>>& index);
std::string placeName(const PlannedPlace& place);

/// What the places of a table are called, by their numbers.
class PlaceNames {
 public:
  PlaceNames() = default;
  explicit PlaceNames(std::span<const Node> nodes);
  /// @param index one for each node, or none at all
  PlaceNames(std::span<const int> nodes, std::span<const std::array<int, 3>> index);

  std::string of(int node) const;  ///< "P17" for one that is not in the table.
  /// "A3, pipe 1", "A3, pipe 1 and B3, pipe 1", "A3, pipe 1; B3, pipe 1; C3, pipe 1 and 9 more"; each place once, by
  /// number.
  std::string list(std::vector<int> nodes, std::size_t most = 6) const;
  /// The same in the order given.
  /// @param nodes each place once
  std::string listInOrder(std::span<const int> nodes, std::size_t most = 6) const;

 private:
  std::map<int, std::string> names_;
};

}  // namespace fieldtrue
