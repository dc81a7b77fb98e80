#pragma once

#include <string>

#include "calib/core/memory_limit.h"
#include "calib/core/run_control.h"

namespace fieldtrue::correctors {

/// Books the memory of a dense fit that has at its peak so many n x n matrices alive; to be held while it runs, and as
/// long as what it leaves behind holds such a matrix.
/// @param name of the method, as the subject of a sentence
/// @error as MemoryBooking::book
inline Result<MemoryBooking> bookSquareMatrices(const std::string& name, double n_matrices, std::size_t n_places,
                                                const RunControl& control) {
  const auto n = static_cast<double>(n_places);
  return MemoryBooking::book(name + " on " + std::to_string(n_places) + " places", n_matrices * 8.0 * n * n,
                             control.stop);
}

}  // namespace fieldtrue::correctors
