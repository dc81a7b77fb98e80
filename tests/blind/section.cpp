#include "tests/blind/section.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/blind/generate_session.h"
#include "tests/blind/judgement.h"

namespace blind {
namespace {

constexpr double kAllowance = 0.02;
const std::array<std::string, 4> kLevelNames = {"rho 0.35", "rho 0.7", "rho 1.4", "rho 2.8"};

Sessions atLevel(const Sessions& sessions, double level) {
  return where(sessions, [level](const Session& session) {
    return session.rho_level && std::abs(*session.rho_level - level) < 1e-6;
  });
}

Sessions betweenLevels(const Sessions& sessions) {
  return where(sessions, [](const Session& session) { return !session.rho_level; });
}

}  // namespace

Sessions where(const Sessions& sessions, const Test& test) {
  Sessions kept;
  for (const Session* session : sessions)
    if (test(*session)) kept.push_back(session);
  return kept;
}

Sessions onShelf(const Sessions& sessions, const std::string& shelf) {
  return where(sessions, [&](const Session& session) { return session.shelf == shelf; });
}

std::set<std::string> firstIds(const Sessions& sessions) {
  std::set<std::string> ids;
  for (const Session* session : sessions) ids.insert(session->effects.front().id);
  return ids;
}

Sessions ofFirstId(const Sessions& sessions, const std::string& id) {
  return where(sessions, [&](const Session& session) { return session.effects.front().id == id; });
}

Sessions fromStrength(const Sessions& sessions, double rho) {
  return where(sessions, [rho](const Session& session) {
    return session.rho >= rho - 1e-6 || (session.rho_level && *session.rho_level >= rho - 1e-6);
  });
}

Interval shareOf(const Sessions& sessions, const Test& test) {
  return wilson(where(sessions, test).size(), sessions.size());
}

Interval shareByKind(const Sessions& sessions, const Test& test) {
  std::map<std::string, Tally> by_kind;
  for (const Session* session : sessions) {
    Tally& kind = by_kind[session->effects.front().id];
    kind.hits += test(*session) ? 1.0 : 0.0;
    kind.count += 1.0;
  }
  std::vector<Tally> kinds;
  for (const auto& [id, tally] : by_kind) kinds.push_back(tally);
  return pooledShare(kinds);
}

Interval medianOf(const Sessions& sessions, const Measure& measure) {
  std::vector<double> values;
  for (const Session* session : sessions)
    if (const auto value = measure(*session)) values.push_back(*value);
  return bootstrap(values, [](std::span<const double> drawn) { return quantileOf(drawn, 0.5); });
}

Test orUnanswered(const Test& test) {
  return [test](const Session& session) { return !session.answer.is_answered || test(session); };
}

Target atLeast(double value) { return {Target::Kind::kAtLeast, value, 0.0, kAllowance}; }
Target atMost(double value) { return {Target::Kind::kAtMost, value, 0.0, kAllowance}; }
Target surelyAtMost(double value, double upper_end) { return {Target::Kind::kSurelyAtMost, value, upper_end, 0.0}; }
Target valueAtMost(double value) { return {Target::Kind::kValueAtMost, value, 0.0, 0.0}; }
Target coverageTarget() { return {Target::Kind::kBetween, 0.85, 0.95, kAllowance}; }

void Section::add(const std::string& name, const std::string& group, const std::string& unit, const Interval& interval,
                  std::optional<Target> target) {
  if (interval.count > 0) figures_.push_back({title_, name, group, unit, interval, target});
}

void Section::addByStrength(const std::string& name, const std::string& unit, const Sessions& sessions,
                            const std::function<Interval(const Sessions&)>& figure, const LevelTargets& targets,
                            std::optional<Target> target_of_all) {
  for (std::size_t at = 0; at < kLevels.size(); ++at)
    add(name, kLevelNames[at], unit, figure(atLevel(sessions, kLevels[at])), targets[at]);
  add(name, "other rho", unit, figure(betweenLevels(sessions)));
  add(name, "all", unit, figure(sessions), target_of_all);
}

void Section::addShares(const std::string& name, const Sessions& sessions, const Test& test,
                        const LevelTargets& targets, std::optional<Target> target_of_all) {
  addByStrength(
      name, "share", sessions, [&](const Sessions& some) { return shareOf(some, test); }, targets, target_of_all);
}

bool isFirstRight(const Session& session) { return isRight(session, firstNamed(session)); }

}  // namespace blind
