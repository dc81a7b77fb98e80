#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "tests/blind/pose_solver.h"
#include "tests/blind/session_table.h"

namespace blind {

/// The sealed places of a session with the exact pose that the tracker would report there.
/// @param session as truth.json has it
/// @error std::runtime_error when the file was changed after it was sealed
SessionTable sealedPlaces(const std::filesystem::path& folder, const nlohmann::json& session);

/// Mean squares in the hull (`inside`) and outside it, of position and rotation: `start` of the alignment alone, fitted
/// to the same recording, and `after` of what is put to the test.
/// @param nodes table of the recording
/// @param after a pose for each row of `unseen`
nlohmann::json comparedWithSealed(const SessionTable& nodes, const SessionTable& unseen,
                                  std::span<const SolvedPose> after);

}  // namespace blind
