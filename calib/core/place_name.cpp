#include "calib/core/place_name.h"

#include <algorithm>

#include "calib/core/error.h"

namespace fieldtrue {

namespace {

std::string columnLetters(int column) {
  std::string letters;
  for (int rest = column + 1; rest > 0; rest = (rest - 1) / 26) {
    letters.insert(letters.begin(), static_cast<char>('A' + (rest - 1) % 26));
  }
  return letters;
}

}  // namespace

std::string placeName(int node, const std::optional<std::array<int, 3>>& index) {
  if (!index) return "P" + std::to_string(node);
  const auto [i, j, k] = *index;
  if (i < 0 || j < 0 || k < 0) return "P" + std::to_string(node);
  return columnLetters(i) + std::to_string(j + 1) + ", pipe " + std::to_string(k + 1);
}

std::string placeName(const PlannedPlace& place) { return placeName(place.node, place.index); }

PlaceNames::PlaceNames(std::span<const Node> nodes) {
  for (const Node& node : nodes) names_.try_emplace(node.node, placeName(node.node, node.index));
}

PlaceNames::PlaceNames(std::span<const int> nodes, std::span<const std::array<int, 3>> index) {
  FT_CHECK(index.empty() || index.size() == nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    names_.try_emplace(nodes[i], placeName(nodes[i], index.empty() ? std::nullopt : std::optional(index[i])));
  }
}

std::string PlaceNames::of(int node) const {
  const auto name = names_.find(node);
  return name == names_.end() ? placeName(node, std::nullopt) : name->second;
}

std::string PlaceNames::list(std::vector<int> nodes, std::size_t most) const {
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return listInOrder(nodes, most);
}

std::string PlaceNames::listInOrder(std::span<const int> nodes, std::size_t most) const {
  const std::size_t named = nodes.size() <= most + 1 ? nodes.size() : most;
  std::string text;
  for (std::size_t i = 0; i < named; ++i) {
    const bool is_last = i + 1 == nodes.size();
    text += (i == 0 ? "" : is_last ? " and " : "; ") + of(nodes[i]);
  }
  return named < nodes.size() ? text + " and " + std::to_string(nodes.size() - named) + " more" : text;
}

}  // namespace fieldtrue
