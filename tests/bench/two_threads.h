#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "calib/core/run_control.h"

namespace fieldtrue {

/// A loop on two threads; loops inside it run on the thread they are met on.
inline RunControl twoThreads() {
  RunControl control;
  control.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    thread_local bool inside = false;
    if (inside) return serialFor(count, body);
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      inside = true;
      for (std::size_t i = next++; i < count; i = next++) body(i);
      inside = false;
    };
    std::jthread helper(work);
    work();
  };
  return control;
}

}  // namespace fieldtrue
