#include "tests/blind/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "tests/blind/generate_session.h"
#include "tests/blind/judgement.h"
#include "tests/blind/next_figures.h"
#include "tests/blind/oracle_figures.h"
#include "tests/blind/replicate_figures.h"

namespace blind {
namespace {

using Sessions = std::vector<const Session*>;
using Test = std::function<bool(const Session&)>;

constexpr double kAllowance = 0.03;
const std::array<std::string, 4> kLevelNames = {"rho 0.35", "rho 0.7", "rho 1.4", "rho 2.8"};

Sessions where(const Sessions& sessions, const Test& test) {
  Sessions kept;
  for (const Session* session : sessions)
    if (test(*session)) kept.push_back(session);
  return kept;
}

Sessions onShelf(const Sessions& sessions, const std::string& shelf) {
  return where(sessions, [&](const Session& session) { return session.shelf == shelf; });
}

Sessions atLevel(const Sessions& sessions, double level) {
  return where(sessions, [level](const Session& session) {
    return session.rho_level && std::abs(*session.rho_level - level) < 1e-6;
  });
}

Sessions betweenLevels(const Sessions& sessions) {
  return where(sessions, [](const Session& session) { return !session.rho_level; });
}

Interval shareOf(const Sessions& sessions, const Test& test) {
  return wilson(where(sessions, test).size(), sessions.size());
}

Target atLeast(double value) { return {Target::Kind::kAtLeast, value, 0.0, kAllowance}; }
Target atMost(double value, double allowance) { return {Target::Kind::kAtMost, value, 0.0, allowance}; }
Target valueAtMost(double value) { return {Target::Kind::kValueAtMost, value, 0.0, 0.0}; }
Target coverageTarget() { return {Target::Kind::kBetween, 0.85, 0.95, kAllowance}; }

using LevelTargets = std::array<std::optional<Target>, 4>;

/// Collects rows of one section.
class Section {
 public:
  Section(std::vector<Figure>& figures, std::string title) : figures_(figures), title_(std::move(title)) {}

  void add(const std::string& name, const std::string& group, const std::string& unit, const Interval& interval,
           std::optional<Target> target = std::nullopt) {
    if (interval.count > 0) figures_.push_back({title_, name, group, unit, interval, target});
  }

  /// A figure at each of the four strengths, between them and over all.
  void addByStrength(const std::string& name, const std::string& unit, const Sessions& sessions,
                     const std::function<Interval(const Sessions&)>& figure, const LevelTargets& targets = {},
                     std::optional<Target> target_of_all = std::nullopt) {
    for (std::size_t at = 0; at < kLevels.size(); ++at)
      add(name, kLevelNames[at], unit, figure(atLevel(sessions, kLevels[at])), targets[at]);
    add(name, "other rho", unit, figure(betweenLevels(sessions)));
    add(name, "all", unit, figure(sessions), target_of_all);
  }

  void addShares(const std::string& name, const Sessions& sessions, const Test& test, const LevelTargets& targets = {},
                 std::optional<Target> target_of_all = std::nullopt) {
    addByStrength(
        name, "share", sessions, [&](const Sessions& some) { return shareOf(some, test); }, targets, target_of_all);
  }

 private:
  std::vector<Figure>& figures_;
  std::string title_;
};

bool isFirstRight(const Session& session) { return isRight(session, firstNamed(session)); }

void addTopOne(std::vector<Figure>& figures, const Sessions& single) {
  const LevelTargets pose = {atLeast(0.80), atLeast(0.95), atLeast(0.97), atLeast(0.97)};
  const LevelTargets positions = {atLeast(0.60), atLeast(0.93), atLeast(0.95), atLeast(0.95)};
  const auto part = [&](bool is_position_only, bool is_random) {
    return where(single, [=](const Session& session) {
      return session.is_position_only == is_position_only && (session.order == "random") == is_random;
    });
  };
  const Sessions random_poses = part(false, true);
  Section section(figures, "Top-1: the effect named first is in the truth's class");
  section.addShares("poses, random order", random_poses, isFirstRight, pose);
  section.addShares("poses, random order, first selected", random_poses,
                    [](const Session& session) { return isRight(session, firstSelected(session)); });
  section.addShares("positions only, random order", part(true, true), isFirstRight, positions);
  section.addShares("poses, serpentine order", part(false, false), isFirstRight);
  section.addShares("positions only, serpentine order", part(true, false), isFirstRight);
  section.addShares("poses, random order, classes by the generator's physics", random_poses,
                    [](const Session& session) {
                      Session other = session;
                      if (!session.own_classes.empty()) other.classes = session.own_classes;
                      return isFirstRight(other);
                    });
  section.add("the class stated with the right name holds the truth itself", "all", "share",
              shareOf(where(single, isFirstRight), [](const Session& session) {
                const std::vector<std::string>& stated = session.answer.candidates.front().equivalents;
                return std::find(stated.begin(), stated.end(), session.effects.front().id) != stated.end();
              }));
}

void addTopOneByEffect(std::vector<Figure>& figures, const Sessions& single) {
  std::set<std::string> ids;
  for (const Session* session : single) ids.insert(session->effects.front().id);
  Section section(figures, "Top-1 by effect, all data, rho 0.7 and more");
  for (const std::string& id : ids) {
    const Sessions of_effect = where(
        single, [&](const Session& session) { return session.effects.front().id == id && session.rho >= 0.7 - 1e-6; });
    section.add("named right", id, "share", shareOf(of_effect, isFirstRight));
  }
}

void addDetection(std::vector<Figure>& figures, const Sessions& none, const Sessions& single) {
  Section section(figures, "Detection");
  const Test is_alarm = [](const Session& session) { return !isSilent(session); };
  // Facts of the field: at most 3 % with the upper end of the interval below 5 %.
  section.add("false alarms without an effect", "all", "share", shareOf(none, is_alarm), atMost(0.03, 0.02));
  for (const bool is_position_only : {false, true}) {
    section.add(
        "false alarms without an effect", is_position_only ? "positions only" : "poses", "share",
        shareOf(where(none, [=](const Session& session) { return session.is_position_only == is_position_only; }),
                is_alarm));
  }
  section.addShares("effects of the catalogue missed (no_gap)", single, isSilent);
}

void addAbstention(std::vector<Figure>& figures, const Sessions& single, const Sessions& off) {
  Section section(figures, "Outside the catalogue");
  section.addShares("called unexplained or partly explained", off, isAbstention);
  const auto is_strong = [](const Session& session) { return session.rho >= 1.4 - 1e-6; };
  section.add("called unexplained or partly explained", "rho 1.4 and more", "share",
              shareOf(where(off, is_strong), isAbstention), atLeast(0.90));
  std::set<std::string> ids;
  for (const Session* session : off) ids.insert(session->effects.front().id);
  for (const std::string& id : ids) {
    const Sessions of_kind = where(
        off, [&](const Session& session) { return session.effects.front().id == id && session.rho >= 1.4 - 1e-6; });
    section.add("so called from rho 1.4 up, by kind", id, "share", shareOf(of_kind, isAbstention));
  }
  section.addShares("in the catalogue, but so called", single, isAbstention, {}, atMost(0.05, kAllowance));
}

/// What a rule that would rather say nothing costs: true causes of the catalogue that it did not let through.
void addRefusals(std::vector<Figure>& figures, const Sessions& single) {
  std::set<std::string> ids;
  for (const Session* session : single) ids.insert(session->effects.front().id);
  Section section(figures, "True causes refused: a gap is seen, and called unexplained or partly explained");
  for (const std::string& id : ids)
    section.addShares(id, where(single, [&](const Session& session) { return session.effects.front().id == id; }),
                      isAbstention);
  section.addByStrength("width of the interval of what is left, median", "", single, [](const Sessions& some) {
    std::vector<double> widths;
    for (const Session* session : some)
      if (const auto width = leftWidth(*session)) widths.push_back(*width);
    return bootstrap(widths, [](std::span<const double> values) { return quantileOf(values, 0.5); });
  });
  section.addShares("no interval of what is left can be told",
                    where(single, [](const Session& session) { return !session.answer.selected.empty(); }),
                    [](const Session& session) { return !leftWidth(session); });
}

void addLocation(std::vector<Figure>& figures, const Sessions& single) {
  static const std::array<std::string, 5> kPlaced = {"compact_metal", "closed_loop", "metal_moved", "finite_plate", ""};
  const std::array<double, 4> medians = {20.0, 9.0, 6.0, 5.0};
  const std::array<double, 4> tails = {40.0, 15.0, 10.0, 8.0};
  Section section(figures, "Location error, where the class was named right");
  for (const std::string& id : kPlaced) {
    const Sessions placed = where(single, [&](const Session& session) {
      const std::string& true_id = session.effects.front().id;
      return id.empty() ? std::find(kPlaced.begin(), kPlaced.end(), true_id) != kPlaced.end() : true_id == id;
    });
    for (const double share : {0.5, 0.9}) {
      LevelTargets targets;
      for (std::size_t at = 0; at < targets.size(); ++at)
        targets[at] = valueAtMost(share < 0.7 ? medians[at] : tails[at]);
      section.addByStrength(
          (id.empty() ? std::string("these four") : id) + (share < 0.7 ? ", median" : ", 90 %"), "cm", placed,
          [&](const Sessions& some) {
            std::vector<double> errors_cm;
            for (const Session* session : some)
              if (const auto error_m = locationError(*session)) errors_cm.push_back(100.0 * *error_m);
            return bootstrap(errors_cm, [=](std::span<const double> values) { return quantileOf(values, share); });
          },
          targets);
    }
  }
}

void addShrinkage(std::vector<Figure>& figures, const Sessions& single, const Sessions& pairs) {
  Section section(figures, "Shrinkage by the selected effects, median");
  using Measure = std::optional<double> (*)(const Session&);
  const auto medianOf = [](Measure measure) {
    return [measure](const Sessions& some) {
      std::vector<double> values;
      for (const Session* session : some)
        if (const auto value = measure(*session)) values.push_back(*value);
      return bootstrap(values, [](std::span<const double> drawn) { return quantileOf(drawn, 0.5); });
    };
  };
  const auto over_oracle = medianOf(relativeShrinkage);
  const LevelTargets targets = {atLeast(0.9), atLeast(0.9), atLeast(0.9), atLeast(0.9)};
  section.addByStrength("one effect, over the oracle's", "", single, over_oracle, targets, atLeast(0.9));
  section.addByStrength("one effect named right, over the oracle's", "", where(single, isFirstRight), over_oracle);
  section.add("two or three at once, over the oracle's", "all", "", over_oracle(pairs));
  section.addByStrength("one effect, itself", "", single, medianOf(shrinkage));
}

void addForetold(std::vector<Figure>& figures, const Sessions& sessions) {
  const Sessions foretold =
      where(sessions, [](const Session& session) { return session.answer.left_inside.has_value(); });
  if (foretold.empty()) return;
  Section section(figures, "At places that no table held, nothing fitted again");
  for (const bool is_inside : {true, false})
    section.addByStrength(is_inside ? "excess taken away in the hull, median" : "outside it, median", "", foretold,
                          [is_inside](const Sessions& some) {
                            std::vector<double> values;
                            for (const Session* session : some)
                              if (const auto value = foretoldShrinkage(*session, is_inside)) values.push_back(*value);
                            return bootstrap(values, [](std::span<const double> v) { return quantileOf(v, 0.5); });
                          });
  const auto stated = where(foretold, [](const Session& session) { return leftIsCovered(session).has_value(); });
  const std::optional<Target> covered = coverageTarget();
  section.addShares(
      "the interval of what is left holds it", stated, [](const Session& session) { return *leftIsCovered(session); },
      {covered, covered, covered, covered}, covered);
  section.addShares("what is left is stated within 0.1", stated,
                    [](const Session& session) { return std::abs(*leftStatedOff(session)) <= 0.1; },
                    {std::nullopt, std::nullopt, atLeast(0.9), atLeast(0.9)});
}

void addCoverage(std::vector<Figure>& figures, const Sessions& single) {
  Section section(figures, "Coverage of 90 % intervals, where the class was named right");
  const auto add = [&](const std::string& name, const auto& coverage) {
    std::vector<Tally> tallies;
    for (const Session* session : single) {
      const std::vector<bool> covered = coverage(*session);
      tallies.push_back(
          {static_cast<double>(std::count(covered.begin(), covered.end(), true)), static_cast<double>(covered.size())});
    }
    section.add(name, "all", "share", pooledShare(tallies), coverageTarget());
  };
  add("components of the location", locationCoverage);
  add("amplitude", amplitudeCoverage);
}

void addProbability(std::vector<Figure>& figures, const Sessions& judged) {
  std::vector<Forecast> forecasts;
  std::vector<double> set_sizes;
  std::size_t sets_right = 0;
  for (const Session* session : judged) {
    if (!session->answer.is_answered || session->answer.candidates.empty()) continue;
    forecasts.push_back({firstProbability(*session), isRight(*session, session->answer.candidates.front().effect)});
    if (session->shelf != "single" || session->rho < 0.7 - 1e-6) continue;
    const CredibleSet set = *credibleSet(*session);
    set_sizes.push_back(static_cast<double>(set.size));
    sets_right += set.holds_truth ? 1 : 0;
  }
  Section section(figures, "Probability of the first candidate, sessions with one effect or none");
  section.add("Brier score", "all", "", brierScore(forecasts), valueAtMost(0.10));
  section.add("expected calibration error", "all", "", calibrationError(forecasts), valueAtMost(0.05));
  section.add("90 % set holds the truth", "rho 0.7 and more", "share", wilson(sets_right, set_sizes.size()),
              atLeast(0.90));
  section.add("classes in the 90 % set, mean", "rho 0.7 and more", "", bootstrap(set_sizes, meanOf), valueAtMost(1.5));
}

/// Effects of several sessions, by how often they were called for and how often called.
struct SetCounts {
  std::vector<Tally> recalled;
  std::vector<Tally> precise;
  std::size_t exact = 0;
};

SetCounts countSets(const Sessions& sessions) {
  SetCounts counts;
  for (const Session* session : sessions) {
    const std::set<std::string> truth = trueClasses(*session);
    const std::set<std::string> selected = selectedClasses(*session);
    double shared = 0.0;
    for (const std::string& label : selected) shared += static_cast<double>(truth.count(label));
    counts.recalled.push_back({shared, static_cast<double>(truth.size())});
    counts.precise.push_back({shared, static_cast<double>(selected.size())});
    counts.exact += session->answer.is_answered && truth == selected ? 1 : 0;
  }
  return counts;
}

void addSets(std::vector<Figure>& figures, const Sessions& pairs, const Sessions& single) {
  Section section(figures, "Sets of effects, by class");
  const auto add = [&](const std::string& group, const Sessions& some, bool has_target) {
    const SetCounts counts = countSets(some);
    const auto target = [&](double value) { return has_target ? std::optional(atLeast(value)) : std::nullopt; };
    section.add("true effects selected (recall)", group, "share", pooledShare(counts.recalled), target(0.95));
    section.add("selected effects true (precision)", group, "share", pooledShare(counts.precise), target(0.95));
    section.add("set exact", group, "share", wilson(counts.exact, some.size()), target(0.85));
  };
  add("two or three at once", pairs, true);
  const auto holds = [](std::size_t count) {
    return [count](const Session& session) { return session.effects.size() == count; };
  };
  add("two at once", where(pairs, holds(2)), false);
  add("three at once", where(pairs, holds(3)), false);
  add("two or three, each of rho 0.7 and more",
      where(pairs,
            [](const Session& session) {
              return std::all_of(session.effects.begin(), session.effects.end(),
                                 [](const TrueEffect& e) { return e.rho >= 0.7 - 1e-6; });
            }),
      false);
  add("one effect", single, false);
}

void addSignals(std::vector<Figure>& figures, const Sessions& signals) {
  Section section(figures, "Effects of the signal, found in findings or selected");
  std::set<std::string> ids;
  for (const Session* session : signals) ids.insert(session->effects.front().id);
  for (const std::string& id : ids)
    section.add(
        "found", id, "share",
        shareOf(where(signals, [&](const Session& session) { return session.effects.front().id == id; }), isFound));
  section.add("found", "all", "share", shareOf(signals, isFound));
}

void addControls(std::vector<Figure>& figures, const Sessions& controls) {
  Section section(figures, "Negative controls");
  std::set<std::string> names;
  for (const Session* session : controls) names.insert(session->control);
  const Test is_passed = [](const Session& session) { return session.answer.is_answered && !namesCause(session); };
  for (const std::string& name : names) {
    const Sessions of_name = where(controls, [&](const Session& session) { return session.control == name; });
    section.add("no cause named", name, "share", shareOf(of_name, is_passed));
    section.add("called unexplained", name, "share",
                shareOf(of_name, [](const Session& session) { return session.answer.verdict == "unexplained"; }));
    section.add("called no_gap", name, "share", shareOf(of_name, isSilent));
  }
  section.add("no cause named", "all", "share", shareOf(controls, is_passed));
}

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
  if (named == "none" || session.shelf == "off" || session.effects.empty()) return named;
  return isRight(session, named) ? session.effects.front().id : named;
}

ConfusionMatrix confusionOf(const Sessions& sessions) {
  ConfusionMatrix matrix;
  std::set<std::string> rows;
  std::set<std::string> columns;
  for (const Session* session : sessions) {
    const std::string row = session->shelf == "off"    ? "outside the catalogue"
                            : session->effects.empty() ? "none"
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
  const double below = target.value - target.allowance - figure.interval.low;
  switch (target.kind) {
    case Target::Kind::kAtLeast:
      return std::max(0.0, below);
    case Target::Kind::kAtMost:
      return std::max(0.0, figure.interval.high - target.value - target.allowance);
    case Target::Kind::kBetween:
      return std::max({0.0, below, figure.interval.high - target.upper - target.allowance});
    case Target::Kind::kValueAtMost:
      break;
  }
  return std::max(0.0, figure.interval.value - target.value);
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
  Sessions single_or_none = none;
  single_or_none.insert(single_or_none.end(), single.begin(), single.end());
  Sessions one_row_each = single_or_none;
  one_row_each.insert(one_row_each.end(), off.begin(), off.end());
  addTopOne(board.figures, single);
  addTopOneByEffect(board.figures, single);
  addDetection(board.figures, none, single);
  addAbstention(board.figures, single, off);
  addRefusals(board.figures, single);
  addLocation(board.figures, single);
  const Sessions pairs = onShelf(answered_for, "pairs");
  addShrinkage(board.figures, single, pairs);
  addForetold(board.figures, single);
  addOracleFigures(board.figures, answered_for);
  addReplicateFigures(board.figures, single);
  addNextFigures(board.figures, answered_for);
  addCoverage(board.figures, single);
  addProbability(board.figures, single_or_none);
  addSets(board.figures, pairs, single);
  addSignals(board.figures, onShelf(answered_for, "signals"));
  addControls(board.figures, controls);
  addTimes(board.figures, answered_for.empty() ? controls : answered_for);
  board.confusion = confusionOf(one_row_each);
  return board;
}

}  // namespace blind
