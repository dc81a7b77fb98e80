#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/gap/report.h"
#include "tests/blind/sealed_folder.h"
#include "tests/studies/deciding.h"

namespace fieldtrue::testing {

/// One setting of the thresholds: all as they are by default, or one of them at half or double.
struct Trial {
  std::string name;  ///< "default", "half of astray", "double of astray".
  identify::Thresholds thresholds;
};

/// Those that are tried, or of these the named ones.
/// @param names empty = all
/// @error std::invalid_argument for a name that none has
std::vector<Deciding> chosen(const std::vector<std::string>& names);

/// The default, then half and double of each.
std::vector<Trial> trialsOf(const std::vector<Deciding>& ones);

/// The answer that a report is, as the blind check reads it.
blind::Answer answerOf(const gap::GapReport& report);

/// What an answer is worth by the blind check's own rules; what does not apply to a session is null.
nlohmann::json scoreOf(const blind::Session& session);

/// Diagnoses every session of sealed folders under every trial, and keeps what it was worth in `tuning.json` of each
/// folder; what is there already is left.
/// @param most sessions of each folder, the first ones
void runTrials(const std::vector<std::filesystem::path>& folders, const std::vector<Deciding>& ones, std::size_t most,
               std::size_t jobs);

/// What half and double of each does, over all sessions of the folders, as a Markdown table.
std::string tuningTable(const std::vector<std::filesystem::path>& folders, const std::vector<Deciding>& ones);

}  // namespace fieldtrue::testing
