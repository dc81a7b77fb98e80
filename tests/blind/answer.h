#pragma once

#include <span>
#include <string>

namespace blind {

/// Runs the diagnosis on every session of a sealed folder, several side by side, and records seconds and exit status.
///
/// `answer --in DIR [--cli PATH] [--jobs J] [--from A] [--to B] [--limit SECONDS] [--again]`. The diagnosis works in a
/// folder of its own that holds the node table and, where there is one, the sample table, nothing else. Sessions A to B
/// are counted from 1, so that several machines or processes can share a set. An answer is written once: what is
/// answered is left out, so that a stopped run can be started again; `--again` replaces it.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runAnswer(std::span<const std::string> words);

}  // namespace blind
