#pragma once

#include <span>
#include <string>

namespace blind {

/// Opens the seal of an answered folder and prints the scoreboard.
///
/// `score --in DIR [--controls DIR2] [--json OUT] [--markdown OUT]`; DIR2 is an answered folder of negative controls.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runScore(std::span<const std::string> words);

}  // namespace blind
