#pragma once

#include <memory>
#include <string>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/position_model.h"
#include "calib/correctors/polynomial/polynomial_choice.h"
#include "calib/correctors/polynomial/polynomial_field.h"

namespace fieldtrue::correctors {

/// The position correction p_true = p_tracked + polynomial(p_tracked), shared by `affine` and `polynomial`. In a plane
/// the polynomial is one of the two coordinates in it.
/// @param name stands in messages
/// @error as PolynomialField::fit; kBadInput for numbers that are not finite
Result<std::unique_ptr<PositionModel>> fitPolynomialPosition(const FitData& data, const PolynomialDegree& degree,
                                                             const std::string& name);

/// The same with rows left out, by PolynomialHoldOut.
/// @error as fitPolynomialPosition
Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutPolynomialPosition(const FitData& data,
                                                                              const PolynomialDegree& degree,
                                                                              const std::string& name);

/// Of any degree, the affine map included.

/// p_true - p_tracked of every row [m].
std::vector<Eigen::Vector3d> displacements_m(const FitData& data);

/// What a fitted polynomial has to tell: that it was fitted in the plane, that it is poorly determined; empty when
/// nothing.
std::string polynomialNote(const PolynomialField& field);

}  // namespace fieldtrue::correctors
