#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace blind {

/// Sessions of a part.
inline constexpr std::size_t kPart = 100;

/// What score and next read of a report, and nothing else of it; numbers to six digits.
nlohmann::json reducedReport(const nlohmann::json& report);

/// Writes every whole part of a set that is answered and foretold and not kept yet, as FOLDER/part_NN.json, and what
/// oracle, replicate and next found so far, as FOLDER/oracle.json and so on.
/// @param engine commit id of the program that answered
/// @return how many parts were written
/// @error std::runtime_error where the folder keeps another set or another engine's answers
std::size_t keepParts(const std::filesystem::path& set, const std::filesystem::path& folder, const std::string& engine);

/// Puts what a folder keeps back into the set, where nothing of it is answered yet.
/// @return how many sessions were put back
/// @error std::runtime_error where the folder keeps another set
std::size_t restoreParts(const std::filesystem::path& set, const std::filesystem::path& folder);

/// Commands `keep` and `restore`. @return the status, see --help
int runKeep(std::span<const std::string> words);
int runRestore(std::span<const std::string> words);

}  // namespace blind
