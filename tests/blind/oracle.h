#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "tests/blind/generate_session.h"
#include "tests/blind/session_table.h"

namespace blind {

/// How far the readings of a session allow its own effects to be known: their parameters and the alignment fitted
/// again, and what is then left at the sealed places.
/// @param made the session with its true effects
/// @param nodes its recorded table, rows in the order of the setup
/// @param unseen its sealed places
/// @return `inside` and `outside` with the parameters fitted again, the same under `parameters_known` with the true
/// ones, and the costs of both fits on the recorded rows
nlohmann::json oracleOf(const MadeSession& made, const SessionTable& nodes, const SessionTable& unseen);

/// Writes DIR/oracle.json, which score sets the shrinkage of the reports against.
///
/// `oracle --in DIR [--jobs J] [--from A] [--to B]`, sessions counted from 1.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runOracle(std::span<const std::string> words);

}  // namespace blind
