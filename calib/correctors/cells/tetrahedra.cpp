#include "calib/correctors/cells/tetrahedra.h"

#include <cmath>

#include "calib/core/declare.h"
#include "calib/correctors/base/fit_names.h"
#include "calib/correctors/cells/place_grid.h"
#include "calib/correctors/numerics/delaunay.h"

namespace fieldtrue::correctors {
namespace {

using Corners = TetrahedralMesh::Corners;

/// A flatter tetrahedron may be turned inside out by the noise of its corners.
constexpr double kTrustedVolume = 0.01;

constexpr std::array<Corners, 5> kFiveOfEven = {{{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 3, 6}, {4, 0, 5, 6}, {7, 3, 5, 6}}};
constexpr std::array<Corners, 5> kFiveOfOdd = {{{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 2, 7}, {5, 1, 4, 7}, {6, 2, 4, 7}}};
/// Around the diagonal from the low to the high corner.
constexpr std::array<Corners, 6> kSix = {
    {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};

std::vector<Corners> splitCells(const std::vector<GridCell>& cells, bool into_six) {
  std::vector<Corners> tetrahedra;
  tetrahedra.reserve(6 * cells.size());
  for (const GridCell& cell : cells) {
    std::span<const Corners> pattern = into_six      ? std::span<const Corners>(kSix)
                                       : cell.is_odd ? std::span<const Corners>(kFiveOfOdd)
                                                     : std::span<const Corners>(kFiveOfEven);
    for (const Corners& corners : pattern) {
      Corners numbers{};
      for (std::size_t c = 0; c < 4; ++c) numbers[c] = cell.corners[static_cast<std::size_t>(corners[c])];
      tetrahedra.push_back(numbers);
    }
  }
  return tetrahedra;
}

Result<Tetrahedra> gridTetrahedra(const FitData& data, bool into_six, const std::string& method) {
  FT_TRY(auto grid, placeGrid(data, method, "split=delaunay"));
  Tetrahedra tetrahedra;
  tetrahedra.note = gridNote(grid);
  tetrahedra.mesh = TetrahedralMesh(grid.places.p_tracked_m, splitCells(grid.cells, into_six));
  tetrahedra.places = std::move(grid.places);
  return tetrahedra;
}

Result<Tetrahedra> delaunayOf(const FitData& data, const std::string& method) {
  FT_TRY_VOID(checkVolume(data, method));
  Tetrahedra tetrahedra;
  tetrahedra.places = mergePlaces(data);
  FT_TRY(const auto delaunay, Delaunay::of(tetrahedra.places.p_tracked_m, method));
  tetrahedra.mesh = TetrahedralMesh(tetrahedra.places.p_tracked_m, delaunay.tetrahedra());
  return tetrahedra;
}

std::string foldNote(const Tetrahedra& tetrahedra) {
  const std::vector<std::size_t> inverted = invertedTetrahedra(tetrahedra);
  if (inverted.empty()) return {};
  std::vector<int> nodes;
  for (const std::size_t cell : inverted)
    for (const int place : tetrahedra.mesh.corners(cell))
      nodes.push_back(tetrahedra.places.node[static_cast<std::size_t>(place)]);
  return "The field folds back in " + std::to_string(inverted.size()) +
         (inverted.size() == 1 ? " tetrahedron, " : " tetrahedra, ") + "near " +
         namesOf(tetrahedra.places).list(std::move(nodes)) +
         ": there one tracked position stands for several true ones.";
}

}  // namespace

Setting splitSetting() {
  return declare::choice(
      "split", "Tetrahedra", {"auto", "5", "6", "delaunay"}, "auto",
      "Tetrahedra for each cell of the grid, or Delaunay; auto is 5 on a grid and Delaunay for scattered places.");
}

std::vector<std::size_t> invertedTetrahedra(const Tetrahedra& tetrahedra) {
  std::vector<std::size_t> inverted;
  for (std::size_t cell = 0; cell < tetrahedra.mesh.size(); ++cell) {
    const Corners& corners = tetrahedra.mesh.corners(cell);
    const double tracked = relativeVolume(corners, tetrahedra.places.p_tracked_m);
    const double truth = relativeVolume(corners, tetrahedra.places.p_true_m);
    if (tracked * truth < 0.0 && std::min(std::abs(tracked), std::abs(truth)) > kTrustedVolume)
      inverted.push_back(cell);
  }
  return inverted;
}

bool isByDelaunay(const FitData& data, const std::string& split) {
  return split == "delaunay" || (split == "auto" && data.index.empty());
}

Result<Tetrahedra> tetrahedraOf(const FitData& data, const std::string& split, const std::string& method) {
  const bool by_delaunay = isByDelaunay(data, split);
  auto tetrahedra = by_delaunay ? delaunayOf(data, method) : gridTetrahedra(data, split == "6", method);
  const bool has_no_cells = !tetrahedra && (tetrahedra.error().code == ErrorCode::kUnsupported ||
                                            tetrahedra.error().code == ErrorCode::kTooFewNodes);
  if (split == "auto" && has_no_cells && !by_delaunay) tetrahedra = delaunayOf(data, method);
  if (!tetrahedra) return tetrahedra;
  if (tetrahedra->mesh.size() == 0)
    return fail(ErrorCode::kDegenerate, method +
                                            " needs places that enclose a volume, and every tetrahedron between "
                                            "these " +
                                            std::to_string(tetrahedra->places.size()) + " is flat");
  tetrahedra->note = joinedNotes({tetrahedra->note, foldNote(*tetrahedra)});
  return tetrahedra;
}

}  // namespace fieldtrue::correctors
