#pragma once

#include <array>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/blind/figures.h"

/// What the sections of the scoreboard are made with.
namespace blind {

using Sessions = std::vector<const Session*>;
using Test = std::function<bool(const Session&)>;
using LevelTargets = std::array<std::optional<Target>, 4>;

Sessions where(const Sessions& sessions, const Test& test);
Sessions onShelf(const Sessions& sessions, const std::string& shelf);
/// The ids of the first effects of all sessions.
std::set<std::string> firstIds(const Sessions& sessions);
Sessions ofFirstId(const Sessions& sessions, const std::string& id);
/// Of a gap to noise from `rho` up; what is asked for is reached to 0.2 %.
Sessions fromStrength(const Sessions& sessions, double rho);

Interval shareOf(const Sessions& sessions, const Test& test);
/// The same with an interval by resampling kinds, the ids of the first effects, instead of sessions.
Interval shareByKind(const Sessions& sessions, const Test& test);
using Measure = std::function<std::optional<double>(const Session&)>;
/// Median of what can be measured, bootstrapped.
Interval medianOf(const Sessions& sessions, const Measure& measure);
/// What is wrong where it holds is wrong without an answer too.
Test orUnanswered(const Test& test);

Target atLeast(double value);
Target atMost(double value);
Target surelyAtMost(double value, double upper_end);
Target valueAtMost(double value);
/// Of 90 % intervals.
Target coverageTarget();

/// Collects rows of one section.
class Section {
 public:
  Section(std::vector<Figure>& figures, std::string title) : figures_(figures), title_(std::move(title)) {}

  void add(const std::string& name, const std::string& group, const std::string& unit, const Interval& interval,
           std::optional<Target> target = std::nullopt);
  /// A figure at each of the four strengths, between them and over all.
  void addByStrength(const std::string& name, const std::string& unit, const Sessions& sessions,
                     const std::function<Interval(const Sessions&)>& figure, const LevelTargets& targets = {},
                     std::optional<Target> target_of_all = std::nullopt);
  void addShares(const std::string& name, const Sessions& sessions, const Test& test, const LevelTargets& targets = {},
                 std::optional<Target> target_of_all = std::nullopt);

 private:
  std::vector<Figure>& figures_;
  std::string title_;
};

bool isFirstRight(const Session& session);

// The sections, in the order they are printed. `none`, `single` and so on are sessions of these shelves.

void addTopOne(std::vector<Figure>& figures, const Sessions& single);
void addTopOneByEffect(std::vector<Figure>& figures, const Sessions& single);
void addDetection(std::vector<Figure>& figures, const Sessions& none, const Sessions& single, const Sessions& controls);
void addAbstention(std::vector<Figure>& figures, const Sessions& single, const Sessions& off);
void addUnforeseen(std::vector<Figure>& figures, const Sessions& single, const Sessions& unforeseen);
/// What a rule that would rather say nothing costs: true causes of the catalogue that it did not let through.
void addRefusals(std::vector<Figure>& figures, const Sessions& single);
void addLocation(std::vector<Figure>& figures, const Sessions& single);
void addShrinkage(std::vector<Figure>& figures, const Sessions& single, const Sessions& pairs);
void addForetold(std::vector<Figure>& figures, const Sessions& single);
void addCoverage(std::vector<Figure>& figures, const Sessions& single);
void addProbability(std::vector<Figure>& figures, const Sessions& all, const Sessions& single);
void addSets(std::vector<Figure>& figures, const Sessions& pairs, const Sessions& single);
void addSignals(std::vector<Figure>& figures, const Sessions& signals);
void addControls(std::vector<Figure>& figures, const Sessions& controls);

}  // namespace blind
