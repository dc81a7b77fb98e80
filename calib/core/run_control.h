#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>

namespace fieldtrue {

/// Calls body(i) for every i in [0, count), in any order, on any threads, and returns when all are done.
/// Results must not depend on the order: write only to slot i.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

/// The default: one after the other on the calling thread. `calib` starts no thread of its own.
inline void serialFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

/// How a long computation is run, watched and stopped by its caller.
struct RunControl {
  ParallelFor parallel_for = serialFor;
  std::function<void(double fraction)> progress = [](double) {
  };  ///< May be called from any thread, fraction in [0, 1].
  std::stop_token stop;
};

}  // namespace fieldtrue
