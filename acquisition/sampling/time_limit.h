#pragma once

#include <string>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// What becomes of a take whose time is over before it has what was asked for.
enum class AtTimeLimit {
  kUsual,  ///< A mean that is known, though not as well as was asked for, is kept and marked; any other take fails.
  kKeep,   ///< What it has is kept and marked, where it can be averaged.
  kAgain,  ///< It is taken again, up to twice.
  kSkip,   ///< Its place is skipped.
  kAsk,    ///< A person says.
};

/// "keep", "again", "skip" or "ask". @error kBadInput: what it may be
Result<AtTimeLimit> readAtTimeLimit(const std::string& text);

}  // namespace fieldtrue::acquisition
