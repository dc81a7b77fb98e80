#include "calib/correctors/cells/tracked_grid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/declare.h"
#include "calib/correctors/base/fit_names.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/regrid/regrid.h"
#include "calib/geometry/geometry.h"
#include "calib/geometry/grid_index.h"

namespace fieldtrue::correctors {
namespace {

/// Coordinates of the levels along each of the tracker's axes [m].
using Levels = std::array<std::vector<double>, 3>;

/// The place farthest off its level, in pitches.
struct Deviation {
  double pitches = 0.0;
  double off_m = 0.0;
  int node = 0;
};

Levels meanLevels_m(const PlaceGrid& grid) {
  Levels levels_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n_levels = static_cast<std::size_t>(grid.counts[axis]);
    std::vector<double> sums_m(n_levels, 0.0);
    std::vector<double> n_places(n_levels, 0.0);
    for (std::size_t i = 0; i < grid.places.size(); ++i) {
      const auto level = static_cast<std::size_t>(grid.places.index[i][axis]);
      sums_m[level] += grid.places.p_tracked_m[i][static_cast<Eigen::Index>(axis)];
      n_places[level] += 1.0;
    }
    for (std::size_t level = 0; level < n_levels; ++level) levels_m[axis].push_back(sums_m[level] / n_places[level]);
  }
  return levels_m;
}

Deviation worstDeviation(const PlaceGrid& grid, const Levels& levels_m) {
  Deviation worst;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double pitch_m = HUGE_VAL;
    for (std::size_t i = 1; i < levels_m[axis].size(); ++i)
      pitch_m = std::min(pitch_m, std::abs(levels_m[axis][i] - levels_m[axis][i - 1]));
    for (std::size_t i = 0; i < grid.places.size(); ++i) {
      const double level_m = levels_m[axis][static_cast<std::size_t>(grid.places.index[i][axis])];
      const double off_m = std::abs(grid.places.p_tracked_m[i][static_cast<Eigen::Index>(axis)] - level_m);
      // Levels that coincide belong to another axis: no place stands on such a grid.
      const double pitches = pitch_m > 0.0 ? off_m / pitch_m : HUGE_VAL;
      if (pitches > worst.pitches) worst = {pitches, off_m, grid.places.node[i]};
    }
  }
  return worst;
}

TrackedGrid gridOn(const Levels& levels_m, const PlaceGrid& grid, std::vector<Eigen::Vector3d> v_m, std::string note) {
  std::vector<Eigen::Vector3d> corners_m;
  for (const std::array<int, 3>& at : grid.places.index)
    corners_m.emplace_back(levels_m[0][static_cast<std::size_t>(at[0])], levels_m[1][static_cast<std::size_t>(at[1])],
                           levels_m[2][static_cast<std::size_t>(at[2])]);
  std::vector<HexahedralCells::Corners> cells;
  for (const GridCell& cell : grid.cells) cells.push_back(cell.corners);
  return {HexahedralCells(std::move(corners_m), std::move(cells)), std::move(v_m), std::move(note)};
}

/// The places as they stand, where they form a grid in tracked space.
Result<TrackedGrid> ownGrid(const Places& places, const std::string& method) {
  const std::string need = method + " needs a grid along the tracker's axes in tracked space, every place within " +
                           std::to_string(static_cast<int>(100.0 * kRectilinearTolerance)) +
                           " % of the pitch of its level, and ";
  const std::string remedy =
      "; resample=briggs, livingston or czernuszenko makes such a grid, and tetrahedral and hexahedral_shape need none";
  Deviation least{HUGE_VAL, 0.0, 0};
  for (const auto& index : {std::optional(places.index), gridIndex(places.p_tracked_m)}) {
    if (!index || index->empty()) continue;
    Places indexed = places;
    indexed.index = *index;
    const auto grid = placeGrid(std::move(indexed), method);
    if (!grid) {
      if (grid.error().code == ErrorCode::kTooFewNodes) return tl::unexpected(grid.error());
      continue;
    }
    const Levels levels_m = meanLevels_m(*grid);
    const Deviation deviation = worstDeviation(*grid, levels_m);
    if (deviation.pitches <= kRectilinearTolerance)
      return gridOn(levels_m, *grid, errorVectors_m(grid->places), gridNote(*grid));
    if (deviation.pitches < least.pitches) least = deviation;
  }
  if (!std::isfinite(least.pitches))
    return fail(ErrorCode::kUnsupported,
                need + "these " + std::to_string(places.size()) + " places form none in tracked space" + remedy);
  return fail(ErrorCode::kUnsupported, need + namesOf(places).of(least.node) + " is " +
                                           std::to_string(std::lround(1000.0 * least.off_m)) + " mm off, " +
                                           std::to_string(std::lround(100.0 * least.pitches)) + " %" + remedy);
}

/// `count` levels evenly from low to high.
std::vector<double> evenLevels(double low_m, double high_m, int count) {
  std::vector<double> levels_m;
  for (int i = 0; i < count; ++i) levels_m.push_back(low_m + (high_m - low_m) * i / (count - 1));
  return levels_m;
}

/// The tracker axis along which each axis of the index runs: the assignment with the largest share of the way.
std::array<std::size_t, 3> trackerAxes(const std::array<Eigen::Vector3d, 3>& directions) {
  std::array<std::size_t, 3> axes = {0, 1, 2};
  std::array<std::size_t, 3> best = axes;
  double most = -1.0;
  do {
    double along = 0.0;
    for (std::size_t i = 0; i < 3; ++i) along += std::abs(directions[i][static_cast<Eigen::Index>(axes[i])]);
    if (along > most) {
      most = along;
      best = axes;
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return best;
}

/// As many levels as the index has, between its outermost levels.
Levels levelsOfIndex_m(const Places& places, const Eigen::AlignedBox3d& bounds) {
  std::vector<std::array<int, 3>> index = places.index;
  const std::array<int, 3> counts = rankLevels(index);
  std::array<Eigen::Vector3d, 3> directions;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < places.size(); ++i)
      sum += (index[i][axis] - 0.5 * (counts[axis] - 1)) * (places.p_tracked_m[i] - bounds.center());
    directions[axis] = sum.normalized();
  }
  const std::array<std::size_t, 3> tracker_axes = trackerAxes(directions);
  Levels levels_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<Eigen::Index>(tracker_axes[axis]);
    const bool runs_up = directions[axis][along] > 0.0;
    // In a bent grid the innermost reading of an outer level leaves out much, the outermost has little around it. On a
    // floor that shifts places by more than a pitch, half way between the two covers most.
    double innermost_low_m = bounds.min()[along];
    double innermost_high_m = bounds.max()[along];
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double at_m = places.p_tracked_m[i][along];
      const bool is_first = index[i][axis] == 0;
      const bool is_last = index[i][axis] == counts[axis] - 1;
      if (runs_up ? is_first : is_last) innermost_low_m = std::max(innermost_low_m, at_m);
      if (runs_up ? is_last : is_first) innermost_high_m = std::min(innermost_high_m, at_m);
    }
    // A grid that stands askew to the tracker has readings of every level on either side of the middle.
    innermost_low_m = std::min(innermost_low_m, bounds.center()[along]);
    innermost_high_m = std::max(innermost_high_m, bounds.center()[along]);
    levels_m[tracker_axes[axis]] =
        evenLevels(0.5 * (bounds.min()[along] + innermost_low_m), 0.5 * (bounds.max()[along] + innermost_high_m),
                   std::max(2, counts[axis]));
  }
  return levels_m;
}

/// Levels over the extent of scattered places, about as many nodes as places.
Levels levelsOfScatter_m(const Places& places, const Eigen::AlignedBox3d& bounds) {
  const double pitch_m = std::cbrt(bounds.volume() / static_cast<double>(places.size()));
  Levels levels_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const long steps = std::max(1L, std::lround(bounds.sizes()[i] / pitch_m));
    levels_m[axis] = evenLevels(bounds.min()[i], bounds.max()[i], static_cast<int>(steps) + 1);
  }
  return levels_m;
}

/// Every node of the levels, with the error vector there where it has support.
Places regridded(const Places& places, const Levels& levels_m, const RegridOptions& options, std::size_t& n_missing) {
  std::vector<Eigen::Vector3d> targets_m;
  std::vector<std::array<int, 3>> index;
  for (std::size_t i = 0; i < levels_m[0].size(); ++i)
    for (std::size_t j = 0; j < levels_m[1].size(); ++j)
      for (std::size_t k = 0; k < levels_m[2].size(); ++k) {
        targets_m.emplace_back(levels_m[0][i], levels_m[1][j], levels_m[2][k]);
        index.push_back({static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)});
      }
  const auto weights = regridWeights(places.p_tracked_m, targets_m, options);
  const std::vector<Eigen::Vector3d> v_m = errorVectors_m(places);
  Places nodes;
  for (std::size_t i = 0; i < targets_m.size(); ++i) {
    if (weights[i].empty()) {
      ++n_missing;
      continue;
    }
    Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
    for (const RegridWeight& share : weights[i]) sum_m += share.weight * v_m[share.place];
    nodes.node.push_back(static_cast<int>(i));
    nodes.index.push_back(index[i]);
    nodes.p_tracked_m.push_back(targets_m[i]);
    nodes.p_true_m.push_back(targets_m[i] + sum_m);
    nodes.rows.push_back({i});
  }
  return nodes;
}

Result<TrackedGrid> resampledGrid(const Places& places, RegridMethod regrid, const Settings& settings,
                                  const std::string& method) {
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& p_m : places.p_tracked_m) bounds.extend(p_m);
  const Levels levels_m = places.index.empty() ? levelsOfScatter_m(places, bounds) : levelsOfIndex_m(places, bounds);
  RegridOptions options;
  options.method = regrid;
  options.width_pitches = numberSetting(settings, "width_pitches");
  options.pitch_m = 0.0;
  std::string counts;
  for (const std::vector<double>& axis_m : levels_m) {
    options.pitch_m =
        std::max(options.pitch_m, (axis_m.back() - axis_m.front()) / static_cast<double>(axis_m.size() - 1));
    counts += (counts.empty() ? "" : " x ") + std::to_string(axis_m.size());
  }
  std::size_t n_missing = 0;
  FT_TRY(auto grid, placeGrid(regridded(places, levels_m, options, n_missing), method));
  std::string note = "The error vectors were resampled to a grid of " + counts + " in tracked space (" +
                     regridMethodId(regrid) + ")" +
                     (n_missing == 0 ? "." : ", of which " + std::to_string(n_missing) + " nodes have no support.");
  return gridOn(meanLevels_m(grid), grid, errorVectors_m(grid.places), joinedNotes({note, gridNote(grid)}));
}

}  // namespace

std::vector<Setting> resampleSettings() {
  return {declare::choice("resample", "Resampling", {"none", "briggs", "livingston", "czernuszenko"}, "none",
                          "How error vectors of places that form no grid in tracked space are brought to one; none "
                          "asks for such a grid."),
          declare::number(
              "width_pitches", "Width of Livingston's kernel", {0.1, 3.0, "pitches"}, 1.0,
              "SD of the Gaussian kernel of resample=livingston; its width is not published, one pitch is ours.")};
}

std::string trackedGridReading() {
  return "Tracked places never form a rectilinear grid to the last digit: each within " +
         std::to_string(static_cast<int>(100.0 * kRectilinearTolerance)) +
         " % of the pitch of its level counts as standing at the mean of the level. With resample=briggs the "
         "surrounding tetrahedron is sought among the " +
         std::to_string(Regridder::kTetrahedronCandidates) +
         " nearest places, then twice and four times as many; with livingston the kernel's cut-off is three of the "
         "largest pitch.";
}

Result<TrackedGrid> trackedGrid(const FitData& data, const Settings& settings, const std::string& method) {
  FT_TRY_VOID(checkVolume(data, method));
  const Places places = mergePlaces(data);
  const std::string& resample = choiceSetting(settings, "resample");
  if (resample == "none") return ownGrid(places, method);
  FT_TRY(const auto regrid, findRegridMethod(resample));
  return resampledGrid(places, regrid, settings, method);
}

}  // namespace fieldtrue::correctors
