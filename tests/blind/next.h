#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace blind {

/// Whether a report leaves open which cause it is: several in the first candidate's class, or less than 0.9 for it.
bool leavesOpen(const nlohmann::json& report);

/// Makes the measurement that undecided reports suggest, and beside it as many rows at random places, and has both
/// extended tables diagnosed.
///
/// `next --in DIR [--cli PATH] [--sessions N] [--jobs J]` writes DIR/next.json.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runNext(std::span<const std::string> words);

}  // namespace blind
