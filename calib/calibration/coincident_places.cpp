#include "calib/calibration/coincident_places.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <span>

#include "calib/core/place_name.h"
#include "calib/tables/true_box.h"

namespace fieldtrue::calibration {
namespace {

constexpr double kTolerance = 1e-3;  ///< Of the diagonal of the box around the true positions.

/// The lowest number of each set of places that coincide, by the number of a place.
class Joined {
 public:
  int lowest(int place) const {
    const auto found = lower_.find(place);
    return found == lower_.end() ? place : lowest(found->second);
  }
  void join(int a, int b) {
    const auto [low, high] = std::minmax({lowest(a), lowest(b)});
    if (low != high) lower_[high] = low;
  }
  const std::map<int, int>& lower() const { return lower_; }

 private:
  std::map<int, int> lower_;
};

/// Calls f(a, b) for rows of two places that have one true position.
template <class Function>
void forEachCoincident(std::span<const Node> nodes, Function f) {
  const double tolerance_m = kTolerance * trueBox_m(nodes).diagonal().norm();
  const auto p_m = [&](std::size_t row) -> const Eigen::Vector3d& {
    return nodes[row].reference_from_sensor.position_m;
  };
  std::vector<std::size_t> along_x(nodes.size());
  std::iota(along_x.begin(), along_x.end(), std::size_t{0});
  std::sort(along_x.begin(), along_x.end(), [&](std::size_t a, std::size_t b) { return p_m(a).x() < p_m(b).x(); });
  for (std::size_t i = 0; i < along_x.size(); ++i) {
    const std::size_t a = along_x[i];
    for (std::size_t j = i + 1; j < along_x.size() && p_m(along_x[j]).x() - p_m(a).x() <= tolerance_m; ++j) {
      const std::size_t b = along_x[j];
      if (nodes[a].node != nodes[b].node && (p_m(a) - p_m(b)).norm() <= tolerance_m) f(nodes[a], nodes[b]);
    }
  }
}

Joined coincident(const std::vector<Node>& nodes) {
  Joined joined;
  forEachCoincident(nodes, [&](const Node& a, const Node& b) {
    if (a.sensor == b.sensor) joined.join(a.node, b.node);
  });
  return joined;
}

}  // namespace

std::map<int, std::set<int>> placesSharedBySensors(std::span<const Node> nodes) {
  std::map<int, std::set<int>> shared;
  if (nodes.empty()) return shared;
  forEachCoincident(nodes, [&](const Node& a, const Node& b) {
    if (a.sensor == b.sensor) return;
    shared[a.node].insert(b.node);
    shared[b.node].insert(a.node);
  });
  return shared;
}

double positionsAPlace(std::span<const Node> nodes) {
  std::map<const Node*, std::set<int>> others;
  if (!nodes.empty()) {
    forEachCoincident(nodes, [&](const Node& a, const Node& b) {
      others[&a].insert(b.node);
      others[&b].insert(a.node);
    });
  }
  struct Sum {
    double positions = 0.0;
    double rows = 0.0;
  };
  std::map<int, Sum> by_place;
  for (const Node& node : nodes) {
    const auto found = others.find(&node);
    Sum& sum = by_place[node.node];
    sum.positions += found == others.end() ? 1.0 : 1.0 / (1.0 + static_cast<double>(found->second.size()));
    sum.rows += 1.0;
  }
  double n_positions = 0.0;
  for (const auto& [place, sum] : by_place) n_positions += sum.positions / sum.rows;
  return by_place.empty() ? 1.0 : n_positions / static_cast<double>(by_place.size());
}

std::string joinCoincidentPlaces(std::vector<Node>& nodes) {
  if (nodes.empty()) return {};
  const PlaceNames names(nodes);
  const Joined joined = coincident(nodes);
  if (joined.lower().empty()) return {};
  for (Node& node : nodes) node.node = joined.lowest(node.node);
  const auto& [place, other] = *joined.lower().begin();
  const std::size_t n = joined.lower().size();
  return std::to_string(n) + (n == 1 ? " place has" : " places have") + " the true position of another, as " +
         names.of(place) + " that of " + names.of(joined.lowest(other)) + ": each such set counts as one place.";
}

}  // namespace fieldtrue::calibration
