#pragma once

#include "calib/core/run_control.h"

namespace fieldtrue {

/// Number of threads a request stands for: the request itself, or all of the machine's when it is 0 or less.
int threadCount(int requested);

/// A parallel loop over std::jthread. Bodies take the next free index, so results must not depend on the order (see
/// ParallelFor). A loop started from inside a body runs on that body's thread. A body that throws ends the loop early;
/// the first exception is thrown again on the calling thread.
/// @param threads 0 or less = all of the machine's; 1 = the calling thread only
ParallelFor threadedFor(int threads);

}  // namespace fieldtrue
