#pragma once

#include <QString>

#include "calib/evaluation/comparison.h"
#include "widgets/views/error_field.h"

namespace fieldtrue {

/// The held-out error field of a method as arrows at the true positions.
/// @param method id of a position method; empty = before correction
/// @param orientation_method whose held-out angles are drawn; empty = before
ErrorField heldOutField(const Comparison& comparison, const CalibrationTable& table, const QString& method,
                        const QString& orientation_method, const QString& title);

/// Held-out errors per place [mm] of a method; empty method = before.
std::vector<double> heldOutErrors_mm(const Comparison& comparison, const QString& method);

}  // namespace fieldtrue
