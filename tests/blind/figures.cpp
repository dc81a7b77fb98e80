#include "tests/blind/figures.h"

#include <algorithm>

#include "tests/blind/judgement.h"
#include "tests/blind/next_figures.h"
#include "tests/blind/oracle_figures.h"
#include "tests/blind/replicate_figures.h"
#include "tests/blind/section.h"

namespace blind {
namespace {

void addTimes(std::vector<Figure>& figures, const Sessions& sessions) {
  std::vector<double> seconds;
  for (const Session* session : sessions)
    if (session->answer.is_answered) seconds.push_back(session->answer.seconds);
  Section section(figures, "Time for one diagnosis on one thread");
  section.add("median", "all", "s", bootstrap(seconds, [](std::span<const double> v) { return quantileOf(v, 0.5); }));
  section.add("largest", "all", "s", bootstrap(seconds, [](std::span<const double> v) { return quantileOf(v, 1.0); }));
}

std::string columnOf(const Session& session) {
  if (!session.answer.is_answered) return "no answer";
  if (session.answer.verdict == "unexplained") return "unexplained";
  const std::string named = firstNamed(session);
  if (named == "none" || isOutsideCatalogue(session) || session.effects.empty()) return named;
  return isRight(session, named) ? session.effects.front().id : named;
}

ConfusionMatrix confusionOf(const Sessions& sessions) {
  ConfusionMatrix matrix;
  std::set<std::string> rows;
  std::set<std::string> columns;
  for (const Session* session : sessions) {
    const std::string row = isOutsideCatalogue(*session) ? "outside the catalogue"
                            : session->effects.empty()   ? "none"
                                                         : session->effects.front().id;
    const std::string column = columnOf(*session);
    ++matrix.counts[row][column];
    rows.insert(row);
    columns.insert(column);
  }
  matrix.rows.assign(rows.begin(), rows.end());
  matrix.columns.assign(columns.begin(), columns.end());
  return matrix;
}

}  // namespace

std::optional<double> missedBy(const Figure& figure) {
  if (!figure.target || figure.interval.count == 0) return std::nullopt;
  const Target& target = *figure.target;
  const auto& [value, low, high, count] = figure.interval;
  constexpr double kRounding = 1e-12;
  double off = 0.0;
  bool is_reached = false;
  switch (target.kind) {
    case Target::Kind::kAtLeast:
      off = target.value - value;
      is_reached = high >= target.value;
      break;
    case Target::Kind::kAtMost:
      off = value - target.value;
      is_reached = low <= target.value;
      break;
    case Target::Kind::kBetween:
      off = std::max(target.value - value, value - target.upper);
      is_reached = high >= target.value && low <= target.upper;
      break;
    case Target::Kind::kSurelyAtMost:
      off = std::max(value - target.value, high - target.upper);
      break;
    case Target::Kind::kValueAtMost:
      off = value - target.value;
      break;
  }
  return is_reached && off <= target.allowance + kRounding ? 0.0 : std::max(0.0, off);
}

Scoreboard scoreboardOf(std::span<const Session> sessions) {
  Scoreboard board;
  board.sessions = sessions.size();
  Sessions controls;
  Sessions answered_for;
  for (const Session& session : sessions) {
    (session.control.empty() ? answered_for : controls).push_back(&session);
    if (!session.answer.is_answered) board.unanswered.push_back(session.file + ": " + session.answer.trouble);
  }
  const Sessions none = onShelf(answered_for, "none");
  const Sessions single = onShelf(answered_for, "single");
  const Sessions off = onShelf(answered_for, "off");
  const Sessions unforeseen = onShelf(answered_for, "unforeseen");
  Sessions one_row_each;
  for (const Sessions* shelf : {&none, &single, &off, &unforeseen})
    one_row_each.insert(one_row_each.end(), shelf->begin(), shelf->end());
  addTopOne(board.figures, single);
  addTopOneByEffect(board.figures, single);
  addDetection(board.figures, none, single, controls);
  addAbstention(board.figures, single, off);
  addUnforeseen(board.figures, single, unforeseen);
  addRefusals(board.figures, single);
  addLocation(board.figures, single);
  const Sessions pairs = onShelf(answered_for, "pairs");
  addShrinkage(board.figures, single, pairs);
  addForetold(board.figures, single);
  addOracleFigures(board.figures, answered_for);
  addReplicateFigures(board.figures, single);
  addNextFigures(board.figures, answered_for);
  addCoverage(board.figures, single);
  addProbability(board.figures, answered_for, single);
  addSets(board.figures, pairs, single);
  addSignals(board.figures, onShelf(answered_for, "signals"));
  addControls(board.figures, controls);
  addTimes(board.figures, answered_for.empty() ? controls : answered_for);
  board.confusion = confusionOf(one_row_each);
  return board;
}

}  // namespace blind
