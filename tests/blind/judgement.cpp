#include "tests/blind/judgement.h"

#include <algorithm>
#include <array>
#include <span>

namespace blind {
namespace {

/// Shares of the excess above which the file contract calls it partly explained, and unexplained.
constexpr double kPartlyLeft = 0.15;
constexpr double kMostLeft = 0.5;

constexpr std::array<std::string_view, 3> kFloorEffects = {"range_noise", "correlated_samples", "quantization"};
constexpr std::array<std::string_view, 5> kSignalEffects = {"range_noise", "correlated_samples", "quantization",
                                                            "mains_interference", "hemisphere_flip"};
constexpr std::array<std::string_view, 5> kMetal = {"compact_metal", "closed_loop", "finite_plate", "metal_plane",
                                                    "metal_moved"};

bool isUnnamed(std::string_view effect) { return effect.rfind("unnamed_", 0) == 0; }

std::string labelOf(const Session& session, std::string_view effect) {
  std::vector<std::string> ids = classOf(session, effect);
  std::sort(ids.begin(), ids.end());
  std::string label;
  for (const std::string& id : ids) label += (label.empty() ? "" : "+") + id;
  return label;
}

const NamedCause* rightCandidate(const Session& session) {
  const NamedCause* first = firstCandidate(session);
  return first != nullptr && isRight(session, first->effect) ? first : nullptr;
}

bool holds(const AnsweredParameter& parameter, double truth) {
  return *parameter.low90 <= truth && truth <= *parameter.high90;
}

}  // namespace

std::vector<std::string> classOf(const Session& session, std::string_view effect) {
  for (const std::vector<std::string>& ids : session.classes)
    if (std::find(ids.begin(), ids.end(), effect) != ids.end()) return ids;
  return {std::string(effect)};
}

bool areAlike(const Session& session, std::string_view a, std::string_view b) {
  return labelOf(session, a) == labelOf(session, b);
}

const NamedCause* firstCandidate(const Session& session) {
  if (!session.answer.is_answered) return nullptr;
  for (const NamedCause& candidate : session.answer.candidates)
    if (!isUnnamed(candidate.effect)) return &candidate;
  return nullptr;
}

std::string firstNamed(const Session& session) {
  if (!session.answer.is_answered) return "";
  const NamedCause* first = firstCandidate(session);
  return isSilent(session) || first == nullptr ? "none" : first->effect;
}

std::vector<const NamedCause*> namedCauses(const Session& session) {
  std::vector<const NamedCause*> named;
  const Answer& answer = session.answer;
  if (!answer.is_answered || (answer.verdict != "explained" && answer.verdict != "partly_explained")) return named;
  for (const NamedCause& cause : answer.selected)
    if (!isUnnamed(cause.effect)) named.push_back(&cause);
  return named;
}

std::string firstSelected(const Session& session) {
  if (!session.answer.is_answered) return "";
  const auto named = namedCauses(session);
  return named.empty() ? "none" : named.front()->effect;
}

bool isRight(const Session& session, std::string_view named) {
  if (session.effects.empty()) return named == "none";
  return std::any_of(session.effects.begin(), session.effects.end(),
                     [&](const TrueEffect& effect) { return areAlike(session, effect.id, named); });
}

bool isAbstention(const Session& session) {
  return session.answer.is_answered &&
         (session.answer.verdict == "unexplained" || session.answer.verdict == "partly_explained");
}

bool isSilent(const Session& session) { return session.answer.is_answered && session.answer.verdict == "no_gap"; }

bool isOutsideCatalogue(const Session& session) { return session.shelf == "off" || session.shelf == "unforeseen"; }

bool namesCause(const Session& session) {
  const auto named = namedCauses(session);
  return std::any_of(named.begin(), named.end(),
                     [](const NamedCause* cause) { return !isAmong(kSignalEffects, cause->effect); });
}

bool namesOtherCause(const Session& session) {
  const auto named = namedCauses(session);
  return std::any_of(named.begin(), named.end(), [&](const NamedCause* cause) {
    return !isAmong(kSignalEffects, cause->effect) && !isRight(session, cause->effect);
  });
}

bool namesMetal(const Session& session) {
  const auto named = namedCauses(session);
  return std::any_of(named.begin(), named.end(),
                     [](const NamedCause* cause) { return isAmong(kMetal, cause->effect); });
}

std::set<std::string> trueClasses(const Session& session) {
  std::set<std::string> labels;
  for (const TrueEffect& effect : session.effects) labels.insert(labelOf(session, effect.id));
  return labels;
}

std::set<std::string> selectedClasses(const Session& session) {
  std::set<std::string> labels;
  const auto is_true = [&](const std::string& id) {
    return std::any_of(session.effects.begin(), session.effects.end(), [&](const auto& e) { return e.id == id; });
  };
  for (const NamedCause* cause : namedCauses(session))
    // The readings of every session are filtered, some quantised: to say so is neither asked for nor wrong.
    if (!isAmong(kFloorEffects, cause->effect) || is_true(cause->effect))
      labels.insert(labelOf(session, cause->effect));
  return labels;
}

bool isFound(const Session& session) {
  if (!session.answer.is_answered) return false;
  const auto is_right = [&](const std::string& effect) { return isRight(session, effect); };
  return std::any_of(session.answer.findings.begin(), session.answer.findings.end(), is_right) ||
         std::any_of(session.answer.selected.begin(), session.answer.selected.end(),
                     [&](const NamedCause& cause) { return is_right(cause.effect); });
}

double firstProbability(const Session& session) {
  double probability = 0.0;
  for (const NamedCause& candidate : session.answer.candidates)
    if (areAlike(session, candidate.effect, session.answer.candidates.front().effect))
      probability += candidate.probability;
  return std::min(1.0, probability);
}

std::optional<Forecast> forecastOf(const Session& session) {
  if (!session.answer.is_answered) return Forecast{1.0, false};
  if (session.answer.candidates.empty()) return std::nullopt;
  const std::string& first = session.answer.candidates.front().effect;
  const bool is_left_open = isOutsideCatalogue(session) && isUnnamed(first);
  const bool is_of_signal = session.shelf == "signals" && first == "none" && isFound(session);
  return Forecast{firstProbability(session), is_left_open || is_of_signal || isRight(session, first)};
}

std::optional<double> locationError(const Session& session) {
  const NamedCause* named = rightCandidate(session);
  if (named == nullptr || !named->location_m) return std::nullopt;
  if (session.effects.empty() || !session.effects.front().location_m) return std::nullopt;
  return (*named->location_m - *session.effects.front().location_m).norm();
}

std::optional<double> relativeShrinkage(const Session& session) {
  if (!session.oracle_fraction || *session.oracle_fraction <= 0.0) return std::nullopt;
  if (!session.answer.is_answered || isSilent(session)) return 0.0;
  return std::min(1.0, (1.0 - session.answer.remaining_fraction.value_or(1.0)) / *session.oracle_fraction);
}

std::optional<double> shrinkage(const Session& session) {
  if (!session.oracle_fraction) return std::nullopt;
  if (!session.answer.is_answered || isSilent(session)) return 0.0;
  return 1.0 - session.answer.remaining_fraction.value_or(1.0);
}

std::optional<double> foretoldShrinkage(const Session& session, bool is_inside) {
  const Answer& answer = session.answer;
  if (!answer.is_answered || isSilent(session) || answer.verdict == "unexplained") return 0.0;
  if (answer.cannot_be_simulated) return 0.0;
  const auto& left = is_inside ? answer.left_inside : answer.left_outside;
  if (!left) return std::nullopt;
  return 1.0 - *left;
}

std::optional<bool> leftIsCovered(const Session& session) {
  const Answer& answer = session.answer;
  if (namedCauses(session).empty() || !answer.left_inside || !answer.remaining_low90 || !answer.remaining_high90)
    return std::nullopt;
  return *answer.remaining_low90 <= *answer.left_inside && *answer.left_inside <= *answer.remaining_high90;
}

std::optional<double> leftWidth(const Session& session) {
  const Answer& answer = session.answer;
  if (namedCauses(session).empty() || !answer.remaining_low90 || !answer.remaining_high90) return std::nullopt;
  return *answer.remaining_high90 - *answer.remaining_low90;
}

bool explainsInVain(const Session& session) {
  const Answer& answer = session.answer;
  if (!answer.is_answered || answer.verdict != "explained") return false;
  return answer.cannot_be_simulated || (answer.left_inside && *answer.left_inside > kMostLeft);
}

bool explainsSurely(const Session& session) {
  const Answer& answer = session.answer;
  return answer.is_answered && answer.verdict == "explained" && answer.remaining_low90 && answer.remaining_high90 &&
         *answer.remaining_high90 <= kPartlyLeft &&
         *answer.remaining_high90 - *answer.remaining_low90 <= kMostLeft - kPartlyLeft;
}

bool leavesAPart(const Session& session) {
  return session.answer.cannot_be_simulated || session.answer.left_inside.value_or(0.0) > kPartlyLeft;
}

std::optional<double> leftStatedOff(const Session& session) {
  const Answer& answer = session.answer;
  if (namedCauses(session).empty() || !answer.left_inside || !answer.remaining_fraction) return std::nullopt;
  return *answer.remaining_fraction - *answer.left_inside;
}

std::vector<bool> locationCoverage(const Session& session) {
  const NamedCause* named = rightCandidate(session);
  if (named == nullptr || session.effects.empty() || !session.effects.front().location_m) return {};
  const Eigen::Vector3d truth = *session.effects.front().location_m;
  std::vector<bool> covered;
  for (const std::string stem : {"center", "position", "location"}) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto found = named->parameters.find(stem + "_" + "xyz"[axis] + "_m");
      if (found == named->parameters.end() || !found->second.low90 || !found->second.high90) continue;
      covered.push_back(holds(found->second, truth[axis]));
    }
    if (!covered.empty()) break;
  }
  return covered;
}

std::vector<bool> amplitudeCoverage(const Session& session) {
  const NamedCause* named = rightCandidate(session);
  if (named == nullptr || session.effects.empty()) return {};
  const TrueEffect& effect = session.effects.front();
  if (effect.amplitude_name.empty() || named->effect != effect.id) return {};
  const auto found = named->parameters.find(effect.amplitude_name);
  if (found == named->parameters.end() || !found->second.low90 || !found->second.high90) return {};
  return {holds(found->second, effect.amplitude)};
}

std::optional<CredibleSet> credibleSet(const Session& session) {
  if (!session.answer.is_answered || session.answer.candidates.empty()) return std::nullopt;
  std::vector<const NamedCause*> candidates;
  for (const NamedCause& candidate : session.answer.candidates) candidates.push_back(&candidate);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const NamedCause* a, const NamedCause* b) { return a->probability > b->probability; });
  CredibleSet set;
  double held = 0.0;
  std::set<std::string> labels;
  for (const NamedCause* candidate : candidates) {
    if (held >= 0.9 - 1e-9) break;
    held += candidate->probability;
    labels.insert(labelOf(session, candidate->effect));
    set.holds_truth = set.holds_truth || isRight(session, candidate->effect);
  }
  set.size = labels.size();
  return set;
}

}  // namespace blind
