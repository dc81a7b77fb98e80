// To add a correction method:
// 1. Write `calib/correctors/<family>/<id>.cpp`: a model (PositionModel, or ErrorRotationModel for an orientation), its
//    fit, its load, and one function that returns its row, declared in base/rows.h. `parameters()` must hold every bit
//    that `load` needs.
// 2. In the fit, check the data first (fit_checks.h) and say in one sentence what was seen and what is needed; treat
//    dimension 2 (one plane) or say in `note()` what is not claimed.
// 3. Declare settings with unit, range and default.
// 4. Add the row below, in the order menus shall show it, and its reader in readers.cpp, which the runtime uses too.
// 5. Add to tests/calib/correctors/corrector_contract_test.cpp what the method must recover exactly. The other
//    contracts (same bits after reloading, same result twice, finite, errors on bad data) run over every row by
//    themselves.
#include "calib/correctors/registry.h"

#include "calib/correctors/base/method.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/multiquadric/hmq.h"

namespace fieldtrue::correctors {
namespace {

template <class Model>
Result<const CorrectionMethod<Model>*> findMethod(std::span<const CorrectionMethod<Model>> methods,
                                                  const std::string& kind, std::string_view id) {
  std::string known;
  for (const CorrectionMethod<Model>& method : methods) {
    if (method.id == id) return &method;
    known += (known.empty() ? "" : ", ") + method.id;
  }
  return fail(ErrorCode::kBadInput, "No " + kind + " method is called '" + std::string(id) + "'; there are: " + known);
}

}  // namespace

std::span<const PositionMethod> positionMethods() {
  static const std::vector<PositionMethod> methods = {nonePosition(),
                                                      rigidPosition(),
                                                      affinePosition(),
                                                      trilinearPosition(),
                                                      hexahedralShapePosition(),
                                                      tetrahedralPosition(),
                                                      localLinearPosition(),
                                                      localBumpPosition(),
                                                      localKindratenkoPosition(),
                                                      localBriggsPosition(),
                                                      polynomialPosition(),
                                                      hmqPosition(),
                                                      neuralNetworkPosition(),
                                                      rbfPosition(),
                                                      gaussianProcessPosition(),
                                                      bsplinePosition(),
                                                      harmonicFieldPosition(),
                                                      physicsResidualPosition(),
                                                      automaticPosition()};
  return methods;
}

std::span<const OrientationMethod> orientationMethods() {
  static const std::vector<OrientationMethod> methods = {noneOrientation(),
                                                         rigidOrientation(),
                                                         slerpTrilinearOrientation(),
                                                         tetrahedralQuaternionOrientation(),
                                                         localQuaternionOrientation(),
                                                         polynomialEulerOrientation(),
                                                         polynomialQuaternionOrientation(),
                                                         hmqMatrixOrientation(),
                                                         gaussianProcessOrientation()};
  return methods;
}

Result<const PositionMethod*> findPositionMethod(std::string_view id) {
  static const PositionMethod imported = importedPosition();
  if (id == imported.id) return &imported;
  return findMethod(positionMethods(), "position", id);
}

Result<const OrientationMethod*> findOrientationMethod(std::string_view id) {
  static const OrientationMethod imported = importedOrientation();
  if (id == imported.id) return &imported;
  return findMethod(orientationMethods(), "orientation", id);
}

}  // namespace fieldtrue::correctors
