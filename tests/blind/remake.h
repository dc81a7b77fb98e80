#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/blind/generate_session.h"

namespace blind {

/// Makes a session of a sealed set again, so that its world can be asked for more than the set holds.
/// @param truth of the whole set, as openSealed() gives it
/// @param file name of the session in it
/// @error std::runtime_error when what is made is not what the set holds: another build, or controls
MadeSession remadeSession(const std::filesystem::path& folder, const nlohmann::json& truth, const std::string& file);

}  // namespace blind
