#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace blind {

/// What a negative control should be answered with. Effects of the signal are no cause anywhere.
enum class Wanted {
  kNoGap,         ///< Nothing departs by more than is stated.
  kNoCause,       ///< A gap may be seen, and must be left without a cause.
  kNoOtherCause,  ///< The effect is still there, and nothing else may be named.
};

/// @return nothing for a kind that is not in the table of controls
std::optional<Wanted> wantedOf(std::string_view control);
/// Whether it is one of the families without an effect that false alarms are counted in, beside the set's own shelf.
bool isEffectFreeFamily(std::string_view control);

/// Writes negative controls made from the sessions of a sealed folder.
///
/// `controls --in DIR --out DIR2 [--count N] [--effect-free M]`, N sessions (20) of each row of the table of controls,
/// M (N) of the effect-free families. DIR2 has its own truth and seal, and is answered and scored like any other
/// folder.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runControls(std::span<const std::string> words);

}  // namespace blind
