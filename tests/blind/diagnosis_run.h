#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace blind {

/// The tables of one recording as text.
struct Recording {
  std::string nodes_csv;
  std::string samples_csv;  ///< "" where there is none.
};

Recording recordingOf(const std::filesystem::path& folder, const std::string& file);

/// Runs `fieldtrue-cli diagnose`, one thread, in a folder of its own that holds nothing but the tables.
/// @param more options beside those that name the tables
/// @return the report; null when the program ended with another status than 0, or not within 20 minutes
nlohmann::json diagnosed(const std::filesystem::path& cli, const Recording& recording,
                         const std::vector<std::string>& more = {});

}  // namespace blind
