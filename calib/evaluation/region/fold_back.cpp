#include "calib/evaluation/region/fold_back.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "calib/calibration/alignment.h"
#include "calib/core/number_text.h"
#include "calib/core/place_name.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/region/region_lattice.h"

namespace fieldtrue::evaluation {
namespace {

using nlohmann::json;

constexpr std::size_t kProbes = 4000;
/// A measured cell counts as folded when its determinant is below zero by more than this many SDs of what jig and
/// noise make of it: with nine points in hundreds of cells two SDs would be chance.
constexpr double kSignificant = 3.0;
/// A determinant below this is near a fold: readings fill a fifth of the space that the places do.
constexpr double kNearFold = 0.2;

/// A cell of the grid: places at its eight corners, corner c at (c & 1, c >> 1 & 1, c >> 2).
using Corners = std::array<std::size_t, 8>;

std::vector<Corners> gridCells(const correctors::Places& places) {
  std::map<std::array<int, 3>, std::size_t> at;
  for (std::size_t i = 0; i < places.index.size(); ++i) at.emplace(places.index[i], i);
  std::vector<Corners> cells;
  for (const auto& [low, first] : at) {
    Corners corners{first};
    bool is_whole = true;
    for (unsigned c = 1; c < 8 && is_whole; ++c) {
      const auto found = at.find({low[0] + static_cast<int>(c & 1U), low[1] + static_cast<int>(c >> 1U & 1U),
                                  low[2] + static_cast<int>(c >> 2U)});
      is_whole = found != at.end();
      if (is_whole) corners[c] = found->second;
    }
    if (is_whole) cells.push_back(corners);
  }
  return cells;
}

/// Gradient of corner c's share in the trilinear map at a point of the unit cube.
Eigen::Vector3d shareGradient(unsigned c, const Eigen::Vector3d& u) {
  Eigen::Vector3d along;
  Eigen::Vector3d share;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_high = (c >> axis & 1U) != 0;
    share[axis] = is_high ? u[axis] : 1.0 - u[axis];
    along[axis] = is_high ? 1.0 : -1.0;
  }
  return {along.x() * share.y() * share.z(), share.x() * along.y() * share.z(), share.x() * share.y() * along.z()};
}

Eigen::Matrix3d trilinearJacobian(const Corners& corners, const std::vector<Eigen::Vector3d>& p_m,
                                  const Eigen::Vector3d& u) {
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
  for (unsigned c = 0; c < 8; ++c) jacobian += p_m[corners[c]] * shareGradient(c, u).transpose();
  return jacobian;
}

Eigen::Matrix3d adjugate(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d cofactors;
  cofactors.col(0) = m.col(1).cross(m.col(2));
  cofactors.col(1) = m.col(2).cross(m.col(0));
  cofactors.col(2) = m.col(0).cross(m.col(1));
  return cofactors.transpose();
}

double conditionOf(const Eigen::Matrix3d& jacobian) {
  const Eigen::Vector3d singular = Eigen::JacobiSVD<Eigen::Matrix3d>(jacobian).singularValues();
  return singular[2] > 0.0 ? singular[0] / singular[2] : HUGE_VAL;
}

/// What is known about how exactly the places stand and were read.
struct PlaceNoise {
  std::vector<Eigen::Matrix3d> tracked_m2;  ///< Covariance of each place's mean reading.
  double jig_m2 = 0.0;                      ///< Variance of placing per axis.
};

PlaceNoise noiseOf(const correctors::FitData& data, const correctors::Places& places) {
  PlaceNoise noise;
  noise.jig_m2 = data.jig_sd_m * data.jig_sd_m;
  for (const std::vector<std::size_t>& rows : places.rows) {
    Eigen::Matrix3d sum_m2 = Eigen::Matrix3d::Zero();
    if (!data.noise_m2.empty())
      for (const std::size_t row : rows) sum_m2 += data.noise_m2[row];
    const auto n = static_cast<double>(rows.size());
    noise.tracked_m2.push_back(sum_m2 / (n * n));
  }
  return noise;
}

/// The map true -> tracked at one point of a cell.
struct CellPoint {
  Eigen::Matrix3d tracked_from_true = Eigen::Matrix3d::Identity();
  double determinant = 1.0;
  double sd = 0.0;  ///< Of the determinant, by jig and noise.
};

/// @return none where the true cell itself has no volume
std::optional<CellPoint> cellPoint(const Corners& corners, const correctors::Places& places, const PlaceNoise& noise,
                                   const Eigen::Vector3d& u) {
  const Eigen::Matrix3d true_jacobian = trilinearJacobian(corners, places.p_true_m, u);
  const double size = true_jacobian.cwiseAbs().maxCoeff();
  if (!(std::abs(true_jacobian.determinant()) > 1e-9 * size * size * size)) return std::nullopt;
  const Eigen::Matrix3d from_true = true_jacobian.inverse();
  CellPoint point;
  const Eigen::Matrix3d& J = point.tracked_from_true = trilinearJacobian(corners, places.p_tracked_m, u) * from_true;
  point.determinant = J.determinant();
  // d det = sum over corners of (adj(J)^T g)^T (d tracked - J d true), g the gradient of the corner's share by p_true.
  const Eigen::Matrix3d adjugate_t = adjugate(J).transpose();
  double variance = 0.0;
  for (unsigned c = 0; c < 8; ++c) {
    const Eigen::Vector3d h = adjugate_t * (from_true.transpose() * shareGradient(c, u));
    variance += h.dot(noise.tracked_m2[corners[c]] * h) + noise.jig_m2 * (J.transpose() * h).squaredNorm();
  }
  point.sd = std::sqrt(variance);
  return point;
}

/// The nine points of a cell that are looked at: corners and centre.
std::array<Eigen::Vector3d, 9> probesOfCell() {
  std::array<Eigen::Vector3d, 9> probes;
  for (unsigned c = 0; c < 8; ++c) probes[c] = Eigen::Vector3d(c & 1U, c >> 1U & 1U, c >> 2U);
  probes[8] = Eigen::Vector3d::Constant(0.5);
  return probes;
}

struct GridVerdict {
  std::vector<FoldBackCell> cells;
  std::size_t n_doubtful = 0;  ///< Folded, but by no more than jig and noise explain.
};

GridVerdict judgeGrid(const correctors::FitData& data, const Pose& reference_from_tracker) {
  const correctors::Places places = correctors::mergePlaces(data);
  const PlaceNoise noise = noiseOf(data, places);
  GridVerdict verdict;
  for (const Corners& corners : gridCells(places)) {
    std::optional<CellPoint> worst;
    bool is_folded = false;
    for (const Eigen::Vector3d& u : probesOfCell()) {
      const auto point = cellPoint(corners, places, noise, u);
      if (!point) continue;
      is_folded = is_folded || (point->determinant <= 0.0 && point->determinant <= -kSignificant * point->sd);
      if (!worst || point->determinant < worst->determinant) worst = point;
    }
    if (!worst) continue;
    FoldBackCell cell;
    for (const std::size_t corner : corners) {
      cell.center_m += reference_from_tracker * places.p_true_m[corner] / 8.0;
      cell.nodes.push_back(places.node[corner]);
    }
    cell.size_m =
        std::cbrt(std::abs(trilinearJacobian(corners, places.p_true_m, Eigen::Vector3d::Constant(0.5)).determinant()));
    cell.determinant = worst->determinant;
    cell.condition = conditionOf(worst->tracked_from_true);
    cell.one_to_one = !is_folded;
    cell.is_near_fold = worst->determinant > 0.0 && worst->determinant < kNearFold &&
                        worst->determinant + kSignificant * worst->sd < 1.0;
    verdict.n_doubtful += !is_folded && worst->determinant <= 0.0;
    verdict.cells.push_back(std::move(cell));
  }
  return verdict;
}

/// The corrector's own Jacobian between the nodes.
std::vector<FoldBackCell> judgeCorrector(const calibration::Corrector& corrector, const correctors::FitData& data) {
  const RegionLattice lattice = latticeInside(data.p_tracked_m, data.dimension, corrector.region(), kProbes);
  std::vector<FoldBackCell> cells;
  for (const Eigen::Vector3d& p_tracked_m : lattice.points_m) {
    if (!corrector.covers(p_tracked_m)) continue;
    const Eigen::Matrix3d jacobian = corrector.jacobian(p_tracked_m);
    if (!jacobian.allFinite()) continue;
    FoldBackCell cell;
    cell.center_m = corrector.correctPosition_m(p_tracked_m);
    cell.size_m = lattice.step_m;
    cell.determinant = 1.0 / jacobian.determinant();
    cell.condition = conditionOf(jacobian);
    cell.one_to_one = jacobian.determinant() > 0.0;
    cell.is_near_fold = cell.one_to_one && cell.determinant < kNearFold;
    cells.push_back(std::move(cell));
  }
  return cells;
}

/// Neighbours that a linear map is fitted to; it needs four, and noise of few would turn it.
constexpr std::size_t kNeighbours = 12;

/// The places nearest to one, itself among them.
std::vector<std::size_t> nearestPlaces(const std::vector<Eigen::Vector3d>& p_true_m, std::size_t to) {
  std::vector<std::size_t> order(p_true_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t n = std::min(order.size(), kNeighbours + 1);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n), order.end(),
                    [&](std::size_t a, std::size_t b) {
                      const auto far_m2 = [&](std::size_t i) { return (p_true_m[i] - p_true_m[to]).squaredNorm(); };
                      return far_m2(a) < far_m2(b);
                    });
  order.resize(n);
  return order;
}

/// Places of no grid, by the linear map from true to tracked positions around each.
void judgePlacesAlone(const correctors::FitData& data, FoldBack& fold_back) {
  if (data.dimension < 3) return;
  const correctors::Places places = correctors::mergePlaces(data);
  for (std::size_t i = 0; i < places.p_true_m.size(); ++i) {
    Eigen::Matrix3d true_m2 = Eigen::Matrix3d::Zero(), both_m2 = Eigen::Matrix3d::Zero();
    Eigen::Vector3d middle_true_m = Eigen::Vector3d::Zero(), middle_tracked_m = Eigen::Vector3d::Zero();
    const std::vector<std::size_t> near = nearestPlaces(places.p_true_m, i);
    for (const std::size_t k : near) {
      middle_true_m += places.p_true_m[k] / static_cast<double>(near.size());
      middle_tracked_m += places.p_tracked_m[k] / static_cast<double>(near.size());
    }
    for (const std::size_t k : near) {
      const Eigen::Vector3d from_middle_m = places.p_true_m[k] - middle_true_m;
      true_m2 += from_middle_m * from_middle_m.transpose();
      both_m2 += (places.p_tracked_m[k] - middle_tracked_m) * from_middle_m.transpose();
    }
    const Eigen::FullPivLU<Eigen::Matrix3d> spread(true_m2);
    if (!spread.isInvertible()) continue;
    ++fold_back.n_places;
    // The map is both_m2 true_m2^-1, and the determinant of a spread is positive.
    fold_back.n_places_folded += both_m2.determinant() < 0.0;
  }
}

FoldCount countCells(const FoldBack& fold_back, bool of_grid) {
  FoldCount count;
  for (const FoldBackCell& cell : fold_back.cells) {
    if (cell.nodes.empty() == of_grid) continue;
    ++count.n_judged;
    count.n_folded += cell.one_to_one ? 0 : 1;
  }
  return count;
}

std::optional<double> smallestDeterminant(const FoldBack& fold_back, bool of_grid) {
  std::optional<double> smallest;
  for (const FoldBackCell& cell : fold_back.cells)
    if (cell.nodes.empty() != of_grid) smallest = std::min(smallest.value_or(cell.determinant), cell.determinant);
  return smallest;
}

/// "smallest determinant 0.10 of the field and 0.32 of the correction".
std::string determinantText(const FoldBack& fold_back) {
  const auto& of_field = fold_back.smallest_determinant;
  const auto& of_correction = fold_back.smallest_correction_determinant;
  return "smallest determinant " + (of_field ? significantText(*of_field, 2) + " of the field" : std::string()) +
         (of_field && of_correction ? " and " : "") +
         (of_correction ? significantText(*of_correction, 2) + " of the correction" : std::string());
}

std::string whereText(const FoldBackCell& cell, const PlaceNames& names) {
  return (cell.nodes.empty() ? std::string() : "between " + names.list(cell.nodes, 8) + ", ") + "around " +
         pointText(cell.center_m);
}

std::string sentence(const FoldBack& fold_back, std::size_t n_grid, std::size_t n_doubtful, const PlaceNames& names) {
  const std::size_t n_probes = fold_back.cells.size() - n_grid;
  if (fold_back.cells.empty())
    return "Whether the field folds back cannot be told: the places make no cell of a grid and enclose no region.";
  const std::string looked_at = (n_grid > 0 ? countText(n_grid, "cell", "cells") + " of the grid and " : "") +
                                countText(n_probes, "point", "points") + " between the places";
  const std::string doubtful = n_doubtful == 0 ? std::string()
                                               : "; " + countText(n_doubtful, "cell folds", "cells fold") +
                                                     " by no more than jig tolerance and noise explain";
  const std::string figures =
      looked_at + ", " + determinantText(fold_back) + ", worst condition " + fixedText(fold_back.worst_condition, 1);
  if (fold_back.n_folded == 0 && fold_back.n_near_fold > 0) {
    const auto nearest = std::find_if(fold_back.cells.begin(), fold_back.cells.end(),
                                      [](const FoldBackCell& cell) { return cell.is_near_fold; });
    return "The field does not fold back but comes near to it at " + std::to_string(fold_back.n_near_fold) + " of " +
           std::to_string(fold_back.cells.size()) + " (" + figures + "), nearest " + whereText(*nearest, names) +
           ": readings hardly change with the place there, and the correction multiplies their noise" + doubtful + ".";
  }
  if (fold_back.n_folded == 0) return "The field does not fold back (" + figures + ")" + doubtful + ".";
  const FoldCount of_places = foldsOfPlaces(fold_back);
  const std::size_t folded_probes = foldsOfCorrection(fold_back).n_folded;
  const auto worst = std::find_if(fold_back.cells.begin(), fold_back.cells.end(),
                                  [](const FoldBackCell& cell) { return !cell.one_to_one; });
  if (of_places.n_folded == 0)
    return "The measured places do not fold back, but the correction does at " + std::to_string(folded_probes) +
           " of " + std::to_string(n_probes) + " points between them, worst " + whereText(*worst, names) +
           ": it sends different readings to one place there" + doubtful + ".";
  return std::string("The field folds back ") + (n_grid > 0 ? "in " : "around ") + std::to_string(of_places.n_folded) +
         " of " + std::to_string(of_places.n_judged) + (n_grid > 0 ? " cells of the grid" : " places") + " and at " +
         std::to_string(folded_probes) + " of " + std::to_string(n_probes) + " points between the places, worst " +
         whereText(*worst, names) + ": a reading there stands for more than one place and no correction is unique" +
         doubtful + ".";
}

}  // namespace

FoldCount foldsOfPlaces(const FoldBack& fold_back) {
  const FoldCount of_grid = countCells(fold_back, true);
  if (of_grid.n_judged > 0) return of_grid;
  return {static_cast<std::size_t>(fold_back.n_places_folded), static_cast<std::size_t>(fold_back.n_places)};
}

FoldCount foldsOfCorrection(const FoldBack& fold_back) { return countCells(fold_back, false); }

bool foldsByItself(const FoldBack& fold_back) {
  return foldsOfPlaces(fold_back).n_folded == 0 && foldsOfCorrection(fold_back).n_folded > 0;
}

FoldBack foldBackOf(const calibration::Corrector& corrector) {
  const Pose& reference_from_tracker = corrector.alignment().reference_from_tracker;
  const correctors::FitData data =
      calibration::makeFitData(corrector.table().nodes, corrector.table().metadata, corrector.alignment());
  GridVerdict grid = judgeGrid(data, reference_from_tracker);
  std::vector<FoldBackCell> probes = judgeCorrector(corrector, data);
  // Worst first, so that whoever lists cells names the worst.
  for (std::vector<FoldBackCell>* cells : {&grid.cells, &probes})
    std::stable_sort(cells->begin(), cells->end(), [](const FoldBackCell& a, const FoldBackCell& b) {
      const auto ease = [](const FoldBackCell& cell) {
        return cell.one_to_one + (cell.one_to_one && !cell.is_near_fold);
      };
      return ease(a) != ease(b) ? ease(a) < ease(b) : a.condition > b.condition;
    });
  FoldBack fold_back;
  fold_back.cells = std::move(grid.cells);
  const std::size_t n_grid = fold_back.cells.size();
  std::move(probes.begin(), probes.end(), std::back_inserter(fold_back.cells));
  for (const FoldBackCell& cell : fold_back.cells) {
    fold_back.n_folded += !cell.one_to_one;
    fold_back.n_near_fold += cell.is_near_fold;
    fold_back.worst_condition = std::max(fold_back.worst_condition, cell.condition);
  }
  if (n_grid == 0) judgePlacesAlone(data, fold_back);
  fold_back.smallest_determinant = smallestDeterminant(fold_back, true);
  fold_back.smallest_correction_determinant = smallestDeterminant(fold_back, false);
  fold_back.text = sentence(fold_back, n_grid, grid.n_doubtful, PlaceNames(corrector.table().nodes));
  return fold_back;
}

namespace {

json orNothing(const std::optional<double>& value) { return value ? json(*value) : json(nullptr); }

json toJson(const FoldBackCell& cell) {
  return {{"center_m", {cell.center_m.x(), cell.center_m.y(), cell.center_m.z()}},
          {"size_m", cell.size_m},
          {"determinant", cell.determinant},
          {"condition", std::isfinite(cell.condition) ? json(cell.condition) : json(nullptr)},
          {"nodes", cell.nodes}};
}

}  // namespace

json toJson(const FoldBack& fold_back) {
  json folded = json::array();
  json near = json::array();
  for (const FoldBackCell& cell : fold_back.cells) {
    if (!cell.one_to_one) folded.push_back(toJson(cell));
    if (cell.is_near_fold) near.push_back(toJson(cell));
  }
  return {
      {"n_judged", fold_back.cells.size()},
      {"n_folded", fold_back.n_folded},
      {"worst_condition", std::isfinite(fold_back.worst_condition) ? json(fold_back.worst_condition) : json(nullptr)},
      {"smallest_determinant", orNothing(fold_back.smallest_determinant)},
      {"n_correction_folded", foldsOfCorrection(fold_back).n_folded},
      {"smallest_correction_determinant", orNothing(fold_back.smallest_correction_determinant)},
      {"n_places_judged", fold_back.n_places},
      {"n_places_folded", fold_back.n_places_folded},
      {"n_near_fold", fold_back.n_near_fold},
      {"folded", std::move(folded)},
      {"near_fold", std::move(near)},
      {"text", fold_back.text}};
}

}  // namespace fieldtrue::evaluation
