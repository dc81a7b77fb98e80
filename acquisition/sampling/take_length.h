#pragma once

#include <string>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// When a take of a place is complete.
struct TakeLength {
  enum class Until {
    kSamples,        ///< So many good samples.
    kSeconds,        ///< Good samples over so long a time.
    kStandardError,  ///< The mean position is known so well, correlation of the samples counted in [m, 3-D].
  };
  Until until = Until::kSamples;
  double amount = 60.0;
  bool operator==(const TakeLength&) const = default;
};

/// The same length, where it is one. @error kBadInput: what is possible, and what was asked for
Result<TakeLength> checked(const TakeLength& length);

/// "60" samples, "2.5s", or "0.05mm" of standard error. @error kBadInput
Result<TakeLength> readTakeLength(const std::string& text);
/// As readTakeLength reads it.
std::string textOf(const TakeLength& length);

}  // namespace fieldtrue::acquisition
