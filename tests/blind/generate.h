#pragma once

#include <span>
#include <string>

namespace blind {

/// Writes the sealed sessions: node tables without any label, truth.json and seal.json.
/// @param arguments everything after `generate` on the command line
/// @return exit status: 0 done, 1 the files could not be written, 2 wrong usage
int runGenerate(std::span<const std::string> arguments);

}  // namespace blind
