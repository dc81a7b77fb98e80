#pragma once

#include <type_traits>
#include <utility>

#include "calib/core/exception_barrier.h"

namespace fieldtrue::cli {

void rememberThrown();

/// withBarrier around what a command does, remembered for `endProgram`. Nothing is left half written: every file is
/// written beside its place and moved there whole.
template <class Work>
auto commandBarrier(Work&& work) {
  return withBarrier("no file was left half written", [&]() -> std::invoke_result_t<Work> {
    try {
      return std::forward<Work>(work)();
    } catch (...) {
      rememberThrown();
      throw;
    }
  });
}

/// The end of main. After something was thrown no other thread is waited for: a thread of OpenBLAS that finds no memory
/// for its buffer tries again for ever, and an orderly end would join it.
/// @return status
int endProgram(int status);

}  // namespace fieldtrue::cli
