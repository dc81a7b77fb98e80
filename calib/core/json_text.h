#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue {

/// Levels of brackets in JSON that is read; our own files need about ten. Printing and comparing a tree recurse, so a
/// deeper one could end the program.
inline constexpr int kDeepestJson = 64;

enum class JsonComments { kRefused, kSkipped };

/// The one reader of JSON that came from outside: a file, a session, a setting.
/// @param name stands in messages
/// @error kBadInput with the line for what is not JSON; for deeper nesting; for a number that no double holds
Result<nlohmann::json> parseJson(const std::string& text, const std::string& name,
                                 JsonComments comments = JsonComments::kRefused);

}  // namespace fieldtrue
