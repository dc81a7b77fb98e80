#include "calib/evaluation/region/coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/number_text.h"
#include "calib/core/place_name.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/region/region_lattice.h"
#include "calib/geometry/convex_hull.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::evaluation {
namespace {

using nlohmann::json;

constexpr std::size_t kLatticePoints = 20000;
constexpr std::size_t kMostHoles = 20;
constexpr double kHoleRatio = 1.5;
/// As for a calibration's region: see Corrector::fit.
constexpr double kMarginOfSpacing = 0.25;

/// Median distance between neighbours along each axis of a grid [m]; none where an axis has no neighbours.
std::optional<Eigen::Vector3d> gridPitch_m(const correctors::Places& places) {
  if (places.index.empty()) return std::nullopt;
  std::map<std::array<int, 3>, std::size_t> at;
  for (std::size_t i = 0; i < places.size(); ++i) at.emplace(places.index[i], i);
  Eigen::Vector3d pitch_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> steps_m;
    for (const auto& [index, i] : at) {
      std::array<int, 3> next = index;
      ++next[axis];
      if (const auto found = at.find(next); found != at.end())
        steps_m.push_back((places.p_true_m[found->second] - places.p_true_m[i]).norm());
    }
    if (steps_m.empty()) return std::nullopt;
    pitch_m[static_cast<Eigen::Index>(axis)] = median(std::move(steps_m));
  }
  return pitch_m;
}

/// Distance from the middle of a cell to its corners, of a full grid as the places stand.
double fullGridGap_m(const correctors::Places& places, int dimension, double spacing_m) {
  if (const auto pitch_m = gridPitch_m(places); dimension == 3 && pitch_m) return 0.5 * pitch_m->norm();
  return 0.5 * std::sqrt(static_cast<double>(dimension)) * spacing_m;
}

/// Area of the convex polygon that points in a plane with this normal span.
double facetArea_m2(const std::vector<Eigen::Vector3d>& points_m, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  std::vector<Eigen::Vector2d> flat_m;
  for (const Eigen::Vector3d& p : points_m) flat_m.emplace_back(u.dot(p), v.dot(p));
  const std::vector<Eigen::Vector2d> corners_m = convexPolygon(std::move(flat_m));
  double doubled_m2 = 0.0;
  for (std::size_t i = 0; i < corners_m.size(); ++i) {
    const Eigen::Vector2d& a = corners_m[i];
    const Eigen::Vector2d& b = corners_m[(i + 1) % corners_m.size()];
    doubled_m2 += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * std::abs(doubled_m2);
}

/// Volume of the convex hull: a third of the sum over its facets of area times height above the centre.
double hullVolume_m3(std::span<const Eigen::Vector3d> points_m, const PointSpread& spread) {
  constexpr double kSameFacet = 1e-9;
  const auto normals = convexHullNormals(points_m);
  if (!normals) return 0.0;
  std::vector<Eigen::Vector3d> distinct;
  double volume_m3 = 0.0;
  for (const Eigen::Vector3d& normal : *normals) {
    const auto is_same = [&](const Eigen::Vector3d& other) { return (other - normal).norm() < 1e-6; };
    if (std::any_of(distinct.begin(), distinct.end(), is_same)) continue;
    distinct.push_back(normal);
    double height_m = 0.0;
    for (const Eigen::Vector3d& p : points_m) height_m = std::max(height_m, normal.dot(p - spread.center_m));
    std::vector<Eigen::Vector3d> on_facet;
    for (const Eigen::Vector3d& p : points_m)
      if (normal.dot(p - spread.center_m) > height_m - kSameFacet * std::max(1.0, spread.sd_m.x()))
        on_facet.push_back(p);
    volume_m3 += facetArea_m2(on_facet, normal) * height_m / 3.0;
  }
  return volume_m3;
}

/// Looks for the largest empty sphere near a start by steps that halve: the distance to the nearest place has creases,
/// along which a gradient would stall.
class GapSearch {
 public:
  GapSearch(const correctors::Places& places, const Region& region, const RegionLattice& lattice)
      : places_(places), region_(region), lattice_(lattice) {}

  Hole from(const Eigen::Vector3d& start_m) const {
    Hole best{start_m, nearestDistance_m(places_.p_true_m, start_m)};
    for (double step_m = lattice_.step_m; step_m > 1e-4 * lattice_.step_m;)
      if (!improve(best, step_m)) step_m *= 0.5;
    return best;
  }

 private:
  bool improve(Hole& best, double step_m) const {
    const Hole before = best;
    const int depth = lattice_.dimension == 3 ? 1 : 0;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -depth; z <= depth; ++z) {
          const Eigen::Vector3d p_m = before.center_m + step_m * (lattice_.axes * Eigen::Vector3d(x, y, z));
          if (region_.outside_m(p_m) > 1e-9) continue;
          const double radius_m = nearestDistance_m(places_.p_true_m, p_m);
          if (radius_m > best.radius_m) best = {p_m, radius_m};
        }
    return best.radius_m > before.radius_m;
  }

  const correctors::Places& places_;
  const Region& region_;
  const RegionLattice& lattice_;
};

void findHoles(const correctors::Places& places, const Region& hull, const RegionLattice& lattice, double threshold_m,
               Coverage& coverage) {
  std::vector<double> distance_m;
  for (const Eigen::Vector3d& p : lattice.points_m) distance_m.push_back(nearestDistance_m(places.p_true_m, p));
  std::vector<std::size_t> order(lattice.points_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return distance_m[a] > distance_m[b]; });
  const GapSearch search(places, hull, lattice);
  std::vector<Hole> looked_at;
  for (const std::size_t i : order) {
    // Half a diagonal of the lattice may lie between a lattice point and the middle of a gap.
    const bool may_be_hole = distance_m[i] + 0.87 * lattice.step_m > threshold_m;
    if (!looked_at.empty() && (!may_be_hole || looked_at.size() >= kMostHoles)) break;
    const bool is_known = std::any_of(looked_at.begin(), looked_at.end(), [&](const Hole& hole) {
      return (hole.center_m - lattice.points_m[i]).norm() < hole.radius_m;
    });
    if (is_known) continue;
    const Hole gap = search.from(lattice.points_m[i]);
    const bool is_new = std::none_of(looked_at.begin(), looked_at.end(), [&](const Hole& hole) {
      return (hole.center_m - gap.center_m).norm() < hole.radius_m;
    });
    looked_at.push_back({is_new ? gap.center_m : lattice.points_m[i], is_new ? gap.radius_m : distance_m[i]});
    coverage.largest_gap_m = std::max(coverage.largest_gap_m, gap.radius_m);
    if (is_new && gap.radius_m > threshold_m) coverage.holes.push_back(gap);
  }
  std::stable_sort(coverage.holes.begin(), coverage.holes.end(),
                   [](const Hole& a, const Hole& b) { return a.radius_m > b.radius_m; });
}

std::vector<int> skippedPlaces(const CalibrationTable& table) {
  std::set<int> skipped;
  for (const Node& node : table.nodes)
    if (node.role == NodeRole::kSkipped) skipped.insert(node.node);
  for (const Node& node : table.nodes)
    if (node.role != NodeRole::kSkipped) skipped.erase(node.node);
  return {skipped.begin(), skipped.end()};
}

std::string sentence(const Coverage& coverage, int dimension, const PlaceNames& names) {
  std::string text = countText(static_cast<std::size_t>(coverage.n_places), "place", "places");
  const Eigen::Vector3d extent_m = coverage.high_m - coverage.low_m;
  const std::string box =
      fixedText(extent_m.x(), 2) + " x " + fixedText(extent_m.y(), 2) + " x " + fixedText(extent_m.z(), 2) + " m";
  if (dimension < 2) {
    text += " on one line or at one point: they enclose no region";
  } else {
    text += std::string(dimension == 2 ? " in one plane" : "") + " span " + box + ", " +
            fixedText(coverage.spacing_m, 2) + " m apart; ";
    text += coverage.holes.empty()
                ? "no hole (the largest gap reaches " + fixedText(coverage.largest_gap_m, 2) + " m from a place)"
                : countText(coverage.holes.size(), "hole", "holes") + ", the largest " +
                      fixedText(coverage.holes.front().radius_m, 2) + " m from the nearest place around " +
                      pointText(coverage.holes.front().center_m);
  }
  if (!coverage.missing.empty()) text += "; planned but skipped: " + names.list(coverage.missing);
  return text + ".";
}

}  // namespace

Coverage coverageOf(const CalibrationTable& table) {
  std::vector<Node> nodes;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(nodes), [](const Node& node) {
    return node.role != NodeRole::kSkipped && node.reference_from_sensor.position_m.allFinite();
  });
  Coverage coverage;
  coverage.missing = skippedPlaces(table);
  const correctors::FitData data = calibration::makeFitData(nodes, table.metadata, calibration::Alignment{});
  const correctors::Places places = correctors::mergePlaces(data);
  coverage.n_places = static_cast<int>(places.size());
  if (places.size() > 0) {
    coverage.low_m = coverage.high_m = places.p_true_m.front();
    for (const Eigen::Vector3d& p_m : places.p_true_m) {
      coverage.low_m = coverage.low_m.cwiseMin(p_m);
      coverage.high_m = coverage.high_m.cwiseMax(p_m);
    }
    const PointSpread spread = pointSpread(places.p_true_m);
    coverage.spacing_m = medianSpacing_m(places.p_true_m);
    coverage.region = Region::around(places.p_true_m, spread.dimension, kMarginOfSpacing * coverage.spacing_m);
    if (spread.dimension == 3) coverage.volume_m3 = hullVolume_m3(places.p_true_m, spread);
    const Region hull = Region::around(places.p_true_m, spread.dimension, 0.0);
    const RegionLattice lattice = latticeInside(places.p_true_m, spread.dimension, hull, kLatticePoints);
    findHoles(places, hull, lattice, kHoleRatio * fullGridGap_m(places, spread.dimension, coverage.spacing_m),
              coverage);
    coverage.text = sentence(coverage, spread.dimension, PlaceNames(table.nodes));
  } else {
    coverage.text = sentence(coverage, 0, PlaceNames(table.nodes));
  }
  return coverage;
}

json toJson(const Coverage& coverage) {
  const auto vector = [](const Eigen::Vector3d& v) { return json::array({v.x(), v.y(), v.z()}); };
  json holes = json::array();
  for (const Hole& hole : coverage.holes)
    holes.push_back({{"center_m", vector(hole.center_m)}, {"radius_m", hole.radius_m}});
  return {{"places", coverage.n_places},        {"low_m", vector(coverage.low_m)},
          {"high_m", vector(coverage.high_m)},  {"volume_m3", coverage.volume_m3},
          {"spacing_m", coverage.spacing_m},    {"largest_gap_m", coverage.largest_gap_m},
          {"holes", std::move(holes)},          {"missing", coverage.missing},
          {"region", coverage.region.toJson()}, {"text", coverage.text}};
}

}  // namespace fieldtrue::evaluation
