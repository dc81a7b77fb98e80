#pragma once

#include <cstddef>

namespace fieldtrue::bench {

/// Sum of the square roots of offset + values: what a multiquadric's evaluation takes at least where each root comes
/// from the processor's divider. Uses the widest registers there are.
double sumOfRoots(const double* values, std::size_t count, double offset);

}  // namespace fieldtrue::bench
