#pragma once

#include <string>

#include "calib/core/settings.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/cells/tetrahedral_mesh.h"

namespace fieldtrue::correctors {

/// `split`: 5 or 6 tetrahedra a cell of the grid, or Delaunay; `auto` (default) is 5 on a grid and Delaunay for
/// scattered places.
Setting splitSetting();

/// Places joined to tetrahedra in tracked space.
struct Tetrahedra {
  Places places;
  TetrahedralMesh mesh;
  std::string note;
};

/// Whether scattered places are asked for, or all that there is.
bool isByDelaunay(const FitData& data, const std::string& split);

/// Joins the places to tetrahedra. Five a cell mirror from cell to cell, six all lie alike: either way the faces of
/// neighbours match. Next to missing places the boxes of PlaceGrid are cut the same way, and faces there may not match.
/// @param split as in splitSetting
/// @param method named in messages
/// @error as checkVolume and placeGrid; kDegenerate when nothing but flat tetrahedra is found
Result<Tetrahedra> tetrahedraOf(const FitData& data, const std::string& split, const std::string& method);

/// Tetrahedra whose corners run the other way round in true than in tracked space: the field folds back there. Those
/// so flat that noise may turn them do not count.
std::vector<std::size_t> invertedTetrahedra(const Tetrahedra& tetrahedra);

}  // namespace fieldtrue::correctors
