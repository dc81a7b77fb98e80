#pragma once

#include <span>
#include <string>

namespace blind {

/// Has sessions of one effect and at most 100 places diagnosed with replicates, and keeps how often the same was named.
///
/// `replicate --in DIR [--cli PATH] [--sessions N] [--replicates M] [--jobs J]` writes DIR/replicated.json.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runReplicate(std::span<const std::string> words);

}  // namespace blind
