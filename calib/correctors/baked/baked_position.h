#pragma once

#include <memory>
#include <span>

#include "calib/core/json_reader.h"
#include "calib/core/run_control.h"
#include "calib/correctors/base/position_model.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {

/// A correction on lattices: of position, one; where it takes orientation, as the model itself takes it apart. Then the
/// whole is held against the model at poses drawn in the region, turned at random and near the orientations given.
/// @param places_m, orientations tracked, of the fit; without orientations only random turns are tried
/// @error as bakeLattice; kUnsupported where lattices cannot follow how the correction takes orientation
Result<std::unique_ptr<PositionModel>> bakePosition(const PositionModel& model, const Region& region,
                                                    std::span<const Eigen::Vector3d> places_m,
                                                    std::span<const Eigen::Quaterniond> orientations,
                                                    double max_deviation_m, const RunControl& control);

/// @param parameters as a baked model's `parameters` stores them
std::unique_ptr<PositionModel> readBaked(const JsonReader& parameters);

}  // namespace fieldtrue::correctors
