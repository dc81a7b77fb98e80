#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tests/blind/figures.h"

namespace blind {

/// The scoreboard for reading on a terminal.
std::string plainText(const Scoreboard& board);
/// The scoreboard as tables for a README.
std::string markdown(const Scoreboard& board);
/// The scoreboard for programs: `{"schema": "fieldtrue.blind-score/1", "sessions", "unanswered", "figures",
/// "confusion"}`.
nlohmann::json toJson(const Scoreboard& board);

}  // namespace blind
