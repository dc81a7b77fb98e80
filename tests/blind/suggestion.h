#pragma once

#include <string>
#include <vector>

#include "tests/blind/session.h"

namespace blind {

/// Further rows that a report's sentence on the next measurement asks for.
struct Suggestion {
  std::string kind;       ///< "turned", "outer" or "later"; "" where the sentence asks for nothing that makes rows.
  std::vector<Row> rows;  ///< After the last row of the session; visits counted on where a place was seen before.
};

/// Reads what an operator would read.
/// @param text `next_measurement.text` of a report
/// @param setup rows of the session, in whose names ("C4, pipe 3", "P17") the sentence speaks
Suggestion suggestionIn(const std::string& text, const Setup& setup);

/// As many rows at places drawn in the box of the rows grown by one step on every side, attitudes those of the session.
/// @param after rows that these take the place of: their number and their times
std::vector<Row> randomRows(const Setup& setup, const std::vector<Row>& after, Random& random);

}  // namespace blind
