#pragma once

#include <span>
#include <string>

namespace blind {

/// Writes sessions that carry nothing to be named, made from those of a sealed folder.
///
/// `controls --in DIR --out DIR2 [--count N]`, N sessions (20) of each kind: `shuffled` and `mirrored` from sessions
/// with one effect, `jig_tolerance_+20%` and `jig_tolerance_-20%` (stated tolerance wrong by that much) and
/// `time_reversed` from sessions without one: an effect that stands still is the same backwards. DIR2 has its own truth
/// and seal, and is answered and scored like any other folder.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runControls(std::span<const std::string> words);

}  // namespace blind
