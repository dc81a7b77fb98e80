#include "calib/correctors/cells/place_grid.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "calib/correctors/base/fit_names.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

/// Places of one index that agree this well are one place: what gridIndex allows.
constexpr double kSamePlace_m = 0.02;

using Index = std::array<int, 3>;

const char* shapeOf(int dimension) {
  if (dimension == 2) return "in one plane";
  return dimension == 1 ? "on one line" : "at one point";
}

/// The grid as an array: number of the place at each index, -1 where there is none.
class Lattice {
 public:
  explicit Lattice(const Index& counts) : counts_(counts), place_(numberOf({counts[0], 0, 0}), -1) {}

  int& at(const Index& index) { return place_[numberOf(index)]; }
  /// @return -1 outside as well
  int find(const Index& index) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (index[axis] < 0 || index[axis] >= counts_[axis]) return -1;
    return place_[numberOf(index)];
  }
  std::optional<std::array<int, 8>> box(const Index& low, const Index& steps) const {
    std::array<int, 8> corners{};
    for (std::size_t c = 0; c < 8; ++c) {
      const Index corner = {low[0] + ((c & 1U) != 0 ? steps[0] : 0), low[1] + ((c & 2U) != 0 ? steps[1] : 0),
                            low[2] + ((c & 4U) != 0 ? steps[2] : 0)};
      corners[c] = find(corner);
      if (corners[c] < 0) return std::nullopt;
    }
    return corners;
  }

 private:
  /// Of an index among all, the last axis fastest.
  std::size_t numberOf(const Index& index) const {
    std::size_t number = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      number = number * static_cast<std::size_t>(counts_[axis]) + static_cast<std::size_t>(index[axis]);
    return number;
  }

  Index counts_;
  std::vector<int> place_;
};

/// Adds a place to the one that already has its index, as another visit.
void mergeInto(Places& merged, std::size_t at, const Places& places, std::size_t from) {
  const auto n_there = static_cast<double>(merged.rows[at].size());
  const auto n_more = static_cast<double>(places.rows[from].size());
  const double share = n_more / (n_there + n_more);
  merged.p_tracked_m[at] += share * (places.p_tracked_m[from] - merged.p_tracked_m[at]);
  merged.p_true_m[at] += share * (places.p_true_m[from] - merged.p_true_m[at]);
  merged.rows[at].insert(merged.rows[at].end(), places.rows[from].begin(), places.rows[from].end());
}

void append(Places& merged, const Places& places, std::size_t from) {
  merged.p_tracked_m.push_back(places.p_tracked_m[from]);
  merged.p_true_m.push_back(places.p_true_m[from]);
  merged.node.push_back(places.node[from]);
  merged.index.push_back(places.index[from]);
  merged.rows.push_back(places.rows[from]);
}

/// Fills the lattice with the places, one an index.
Result<Places> settle(const Places& places, Lattice& lattice, const std::string& method) {
  Places merged;
  for (std::size_t i = 0; i < places.size(); ++i) {
    int& at = lattice.at(places.index[i]);
    if (at < 0) {
      at = static_cast<int>(merged.size());
      append(merged, places, i);
      continue;
    }
    const auto there = static_cast<std::size_t>(at);
    if ((merged.p_true_m[there] - places.p_true_m[i]).norm() > kSamePlace_m)
      return fail(ErrorCode::kUnsupported,
                  method + " needs one place for each grid index, and " + namesOf(places).of(merged.node[there]) +
                      " (number " + std::to_string(merged.node[there]) + ") and " + namesOf(places).of(places.node[i]) +
                      " (number " + std::to_string(places.node[i]) +
                      ") share one though they stand more than 2 cm apart");
    mergeInto(merged, there, places, i);
  }
  return merged;
}

/// Axes in order of their mean step in tracked space, the shortest first.
Index axesByStep(const PlaceGrid& grid, const Lattice& lattice) {
  std::array<double, 3> mean_step_m{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double sum_m = 0.0;
    int n_steps = 0;
    for (std::size_t i = 0; i < grid.places.size(); ++i) {
      Index next = grid.places.index[i];
      ++next[axis];
      const int neighbour = lattice.find(next);
      if (neighbour < 0) continue;
      sum_m += (grid.places.p_tracked_m[static_cast<std::size_t>(neighbour)] - grid.places.p_tracked_m[i]).norm();
      ++n_steps;
    }
    mean_step_m[axis] = n_steps > 0 ? sum_m / n_steps : 0.0;
  }
  Index axes = {0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) {
    return mean_step_m[static_cast<std::size_t>(a)] < mean_step_m[static_cast<std::size_t>(b)];
  });
  return axes;
}

/// Steps of the boxes that may stand in for a cell, in the order in which they are tried.
std::array<Index, 7> boxSteps(const Index& axes) {
  constexpr std::array<std::array<bool, 3>, 7> kDoubled = {{{true, false, false},
                                                            {false, true, false},
                                                            {false, false, true},
                                                            {true, true, false},
                                                            {true, false, true},
                                                            {false, true, true},
                                                            {true, true, true}}};
  std::array<Index, 7> steps{};
  for (std::size_t i = 0; i < kDoubled.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) steps[i][static_cast<std::size_t>(axes[k])] = kDoubled[i][k] ? 2 : 1;
  return steps;
}

struct Box {
  Index low{};
  std::array<int, 8> corners{};
};

std::optional<Box> boxAround(const Index& cell, const Lattice& lattice, const std::array<Index, 7>& all_steps) {
  for (const Index& steps : all_steps)
    for (int i = steps[0] - 1; i >= 0; --i)
      for (int j = steps[1] - 1; j >= 0; --j)
        for (int k = steps[2] - 1; k >= 0; --k) {
          const Index low = {cell[0] - i, cell[1] - j, cell[2] - k};
          if (const auto corners = lattice.box(low, steps)) return Box{low, *corners};
        }
  return std::nullopt;
}

bool isOdd(const Index& low) { return (low[0] + low[1] + low[2]) % 2 != 0; }

void addCells(PlaceGrid& grid, const Lattice& lattice) {
  const std::array<Index, 7> steps = boxSteps(axesByStep(grid, lattice));
  std::vector<GridCell> boxes;
  std::set<std::array<int, 8>> seen;
  for (int i = 0; i + 1 < grid.counts[0]; ++i)
    for (int j = 0; j + 1 < grid.counts[1]; ++j)
      for (int k = 0; k + 1 < grid.counts[2]; ++k) {
        const Index low = {i, j, k};
        if (const auto corners = lattice.box(low, {1, 1, 1})) {
          grid.cells.push_back({*corners, isOdd(low), false});
        } else if (const auto box = boxAround(low, lattice, steps)) {
          if (seen.insert(box->corners).second) boxes.push_back({box->corners, isOdd(box->low), true});
        } else {
          ++grid.n_empty;
        }
      }
  grid.n_boxes = static_cast<int>(boxes.size());
  grid.cells.insert(grid.cells.end(), boxes.begin(), boxes.end());
}

Error noWholeCell(std::size_t n_places, const Index& counts, const std::string& method) {
  return {ErrorCode::kTooFewNodes,
          method + " needs a cell of the grid with a place at each of its 8 corners, and the " +
              std::to_string(n_places) + " places on a grid of " + std::to_string(counts[0]) + " x " +
              std::to_string(counts[1]) + " x " + std::to_string(counts[2]) + " levels have none"};
}

}  // namespace

std::array<int, 3> rankLevels(std::vector<Index>& index) {
  Index counts{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<int> levels;
    levels.reserve(index.size());
    for (const Index& at : index) levels.push_back(at[axis]);
    std::sort(levels.begin(), levels.end());
    levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
    for (Index& at : index)
      at[axis] = static_cast<int>(std::lower_bound(levels.begin(), levels.end(), at[axis]) - levels.begin());
    counts[axis] = static_cast<int>(levels.size());
  }
  return counts;
}

Result<void> checkVolume(const FitData& data, const std::string& method) {
  if (auto checked = checkPositions(data, method); !checked) return checked;
  const int dimension = std::min(data.dimension, pointSpread(data.p_tracked_m).dimension);
  if (dimension >= 3) return {};
  return fail(ErrorCode::kDegenerate,
              method + " needs places that span a volume, and these " + std::to_string(data.size()) + " rows lie " +
                  shapeOf(dimension) +
                  (dimension == 2 ? "; polynomial, affine and hmq can be fitted in a plane" : std::string()));
}

Result<PlaceGrid> placeGrid(const FitData& data, const std::string& method, const std::string& otherwise) {
  FT_TRY_VOID(checkVolume(data, method));
  if (data.index.empty())
    return fail(ErrorCode::kUnsupported, method + " needs places on a grid, and these " + std::to_string(data.size()) +
                                             " rows have no grid index and show none; " + otherwise +
                                             " works on scattered places");
  FT_CHECK(data.index.size() == data.size());
  return placeGrid(mergePlaces(data), method);
}

Result<PlaceGrid> placeGrid(Places places, const std::string& method) {
  PlaceGrid grid;
  grid.counts = rankLevels(places.index);
  constexpr double kMostNodesPerPlace = 100.0;
  if (static_cast<double>(grid.counts[0]) * grid.counts[1] * grid.counts[2] >
      kMostNodesPerPlace * static_cast<double>(places.size()))
    return tl::unexpected(noWholeCell(places.size(), grid.counts, method));
  Lattice lattice(grid.counts);
  FT_TRY(auto settled, settle(places, lattice, method));
  grid.places = std::move(settled);
  addCells(grid, lattice);
  if (grid.cells.empty()) return tl::unexpected(noWholeCell(grid.places.size(), grid.counts, method));
  return grid;
}

std::string gridNote(const PlaceGrid& grid) {
  std::string note;
  if (grid.n_boxes > 0)
    note = "Next to missing places it is interpolated over " + std::to_string(grid.n_boxes) +
           (grid.n_boxes == 1 ? " box" : " boxes") + " of two steps of the grid.";
  if (grid.n_empty > 0)
    note += std::string(note.empty() ? "" : " ") + "Missing places leave " + std::to_string(grid.n_empty) +
            (grid.n_empty == 1 ? " cell" : " cells") + " of the grid uncovered.";
  return note;
}

std::string joinedNotes(const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes)
    if (!note.empty()) text += (text.empty() ? "" : " ") + note;
  return text;
}

}  // namespace fieldtrue::correctors
