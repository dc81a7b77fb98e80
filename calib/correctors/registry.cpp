// To add a correction method:
// 1. Write `calib/correctors/<id>.{h,cpp}`: a model (PositionModel, or ErrorRotationModel for an orientation), its
//    fit, its load, and one function that returns its row. `parameters()` must hold every bit that `load` needs.
// 2. In the fit, check the data first (fit_checks.h) and say in one sentence what was seen and what is needed; treat
//    dimension 2 (one plane) or say in `note()` what is not claimed.
// 3. Declare settings with unit, range and default; take shared ones from shared_settings.h.
// 4. Include the header and add the row below, in the order menus shall show it.
// 5. Add to tests/calib/correctors/corrector_contract_test.cpp what the method must recover exactly. The other
//    contracts (same bits after reloading, same result twice, finite, errors on bad data) run over every row by
//    themselves.
#include "calib/correctors/registry.h"

#include "calib/correctors/affine.h"
#include "calib/correctors/automatic.h"
#include "calib/correctors/bspline.h"
#include "calib/correctors/gaussian_process.h"
#include "calib/correctors/harmonic_field.h"
#include "calib/correctors/hexahedral_shape.h"
#include "calib/correctors/hmq.h"
#include "calib/correctors/hmq_matrix.h"
#include "calib/correctors/local_briggs.h"
#include "calib/correctors/local_bump.h"
#include "calib/correctors/local_kindratenko.h"
#include "calib/correctors/local_linear.h"
#include "calib/correctors/local_quaternion.h"
#include "calib/correctors/neural_network.h"
#include "calib/correctors/none.h"
#include "calib/correctors/orientation_none.h"
#include "calib/correctors/orientation_rigid.h"
#include "calib/correctors/physics_residual.h"
#include "calib/correctors/polynomial.h"
#include "calib/correctors/polynomial_euler.h"
#include "calib/correctors/polynomial_quaternion.h"
#include "calib/correctors/rbf.h"
#include "calib/correctors/rigid.h"
#include "calib/correctors/slerp_trilinear.h"
#include "calib/correctors/tetrahedral.h"
#include "calib/correctors/tetrahedral_quaternion.h"
#include "calib/correctors/trilinear.h"

namespace fieldtrue {
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
                                                         hmqMatrixOrientation()};
  return methods;
}

Result<const PositionMethod*> findPositionMethod(std::string_view id) {
  return findMethod(positionMethods(), "position", id);
}

Result<const OrientationMethod*> findOrientationMethod(std::string_view id) {
  return findMethod(orientationMethods(), "orientation", id);
}

}  // namespace fieldtrue
