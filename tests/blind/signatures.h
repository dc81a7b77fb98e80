#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/blind/plan_classes.h"
#include "tests/blind/session.h"

namespace blind {

/// What one effect would show, one whitened column per free amplitude, alignment not yet removed.
using Signatures = std::map<std::string, Eigen::MatrixXd>;

/// Linearised signatures of the catalogue for one design.
/// @param body_m where compact metal, plates and loops are taken to stand, transmitter frame [m]
/// @param normal of plates and loops, transmitter frame
Signatures catalogueSignatures(const Setup& setup, const Alignment& alignment, const Vector3d& body_m,
                               const Vector3d& normal);

/// Every effect of the catalogue in exactly one class: merged where each explains more than 0.9 of the other.
Classes equivalenceClasses(const Signatures& signatures, const Alignment& alignment);

}  // namespace blind
