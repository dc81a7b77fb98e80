#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/blind/sealed_folder.h"
#include "tests/blind/statistics.h"

namespace blind {

/// What a figure should reach: met where the 95 % interval reaches it and the figure itself is short by no more than
/// the allowance.
struct Target {
  enum class Kind {
    kAtLeast,
    kAtMost,
    kBetween,
    kSurelyAtMost,  ///< The figure at most `value`, the end of its interval at most `upper`.
    kValueAtMost    ///< The figure itself, whatever its interval.
  };
  Kind kind = Kind::kAtLeast;
  double value = 0.0;
  double upper = 0.0;      ///< Of kBetween and kSurelyAtMost.
  double allowance = 0.0;  ///< In the figure's unit, where an interval decides.
};

/// One row of the scoreboard.
struct Figure {
  std::string section;
  std::string name;
  std::string group;  ///< Which sessions: a strength of gap to noise, an effect, or "all".
  std::string unit;   ///< "share", "cm", "s" or "" for a plain number.
  Interval interval;
  std::optional<Target> target;
};

/// How far a figure is from a target that it misses, 0 when it is met.
/// @return nothing without a target or when nothing was counted
std::optional<double> missedBy(const Figure& figure);

/// Sessions by true effect (rows) and by what was named (columns); a name of the truth's class counts as the truth.
struct ConfusionMatrix {
  std::vector<std::string> rows;
  std::vector<std::string> columns;
  std::map<std::string, std::map<std::string, std::size_t>> counts;
};

struct Scoreboard {
  std::size_t sessions = 0;
  std::vector<std::string> unanswered;  ///< File and why; they count as wrong everywhere.
  std::vector<Figure> figures;
  ConfusionMatrix confusion;
};

/// Every figure of a set, negative controls apart from the rest.
Scoreboard scoreboardOf(std::span<const Session> sessions);

}  // namespace blind
