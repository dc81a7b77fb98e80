#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "calib/core/error.h"

namespace fieldtrue {

/// One sentence for the exception that is being handled; to be called inside a catch.
/// @param what_stands what can still be relied on, as a clause: "nothing was changed"
std::string thrownText(const std::string& what_stands);

/// The error of that sentence, kUnsupported.
Error thrownError(const std::string& what_stands);

template <class T>
struct AsResult {
  using type = Result<T>;
};
template <class T>
struct AsResult<tl::expected<T, Error>> {
  using type = tl::expected<T, Error>;
};

/// The barrier at the end of every command, background job and slot: what `work` throws (memory that is not there, an
/// internal check) comes back as an error. What it returns, a Result or a plain value, comes back as a Result.
template <class Work>
auto withBarrier(const std::string& what_stands, Work&& work) ->
    typename AsResult<std::decay_t<std::invoke_result_t<Work>>>::type {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      std::forward<Work>(work)();
      return {};
    } else {
      return std::forward<Work>(work)();
    }
  } catch (...) {
    return tl::unexpected<Error>(thrownError(what_stands));
  }
}

}  // namespace fieldtrue
