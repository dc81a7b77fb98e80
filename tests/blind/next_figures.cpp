#include "tests/blind/next_figures.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/blind/judgement.h"

namespace blind {
namespace {

using nlohmann::json;

constexpr const char* kNextSection =
    "Next measurement, where a report leaves the cause open: as suggested, against random places";

/// A session that was measured further in both ways, both diagnosed.
struct Pair {
  const Session* session = nullptr;
  const json* before = nullptr;
  const json* suggested = nullptr;
  const json* random = nullptr;
};

const json* causeNamed(const json& causes, const std::string& effect) {
  const auto found =
      std::find_if(causes.begin(), causes.end(), [&](const json& cause) { return cause.at("effect") == effect; });
  return found == causes.end() ? nullptr : &*found;
}

bool isNamedRight(const Session& session, const json& causes) {
  return !causes.empty() && isRight(session, causes.front().at("effect").get<std::string>());
}

Interval medianOf(const std::vector<double>& values) {
  return bootstrap(values, [](std::span<const double> drawn) { return quantileOf(drawn, 0.5); });
}

void addPairs(std::vector<Figure>& figures, const std::string& group, const std::vector<Pair>& pairs) {
  const auto add = [&](const std::string& name, const std::string& unit, const Interval& interval) {
    if (interval.count > 0) figures.push_back({kNextSection, name, group, unit, interval, std::nullopt});
  };
  std::vector<double> volumes, differences;
  std::vector<Tally> entropies, entropies_before;
  std::size_t right_before = 0, right_suggested = 0, right_random = 0;
  for (const Pair& pair : pairs) {
    if (const auto ratio = volumeRatio(*pair.session, *pair.suggested, *pair.random)) volumes.push_back(*ratio);
    const double suggested = classEntropy(*pair.session, *pair.suggested);
    const double random = classEntropy(*pair.session, *pair.random);
    differences.push_back(suggested - random);
    entropies.push_back({suggested, random});
    entropies_before.push_back({suggested, classEntropy(*pair.session, *pair.before)});
    right_before += isNamedRight(*pair.session, *pair.before) ? 1 : 0;
    right_suggested += isNamedRight(*pair.session, *pair.suggested) ? 1 : 0;
    right_random += isNamedRight(*pair.session, *pair.random) ? 1 : 0;
  }
  add("volume of the true cause's intervals, suggested over random, median", "", medianOf(volumes));
  add("entropy of the causes, suggested less random, median [nat]", "", medianOf(differences));
  add("entropy of the causes, suggested over random, of sums", "", ratioOfSums(entropies));
  add("entropy of the causes, suggested over before, of sums", "", ratioOfSums(entropies_before));
  add("named right before", "share", wilson(right_before, pairs.size()));
  add("named right after the suggested rows", "share", wilson(right_suggested, pairs.size()));
  add("named right after the random rows", "share", wilson(right_random, pairs.size()));
}

}  // namespace

std::optional<double> volumeRatio(const Session& session, const json& suggested, const json& random) {
  const auto cause = std::find_if(suggested.begin(), suggested.end(), [&](const json& one) {
    return isRight(session, one.at("effect").get<std::string>());
  });
  if (cause == suggested.end()) return std::nullopt;
  const json* other = causeNamed(random, cause->at("effect").get<std::string>());
  if (other == nullptr) return std::nullopt;
  std::optional<double> ratio;
  for (const auto& [name, width] : cause->at("widths90").items()) {
    const double other_width = other->at("widths90").value(name, 0.0);
    if (width.get<double>() > 0 && other_width > 0) ratio = ratio.value_or(1.0) * width.get<double>() / other_width;
  }
  return ratio;
}

double classEntropy(const Session& session, const json& causes) {
  std::map<std::vector<std::string>, double> probability_of;
  for (const json& cause : causes)
    probability_of[classOf(session, cause.at("effect").get<std::string>())] += cause.at("probability").get<double>();
  double entropy = 0;
  for (const auto& [ids, probability] : probability_of)
    if (probability > 0) entropy -= probability * std::log(probability);
  return entropy;
}

void addNextFigures(std::vector<Figure>& figures, const std::vector<const Session*>& sessions) {
  std::vector<Pair> pairs;
  std::size_t open = 0, suggesting = 0;
  for (const Session* session : sessions) {
    const auto found = session->results.find("next");
    if (found == session->results.end()) continue;
    const json& entry = found->second;
    ++open;
    if (entry.at("kind").is_null()) continue;
    ++suggesting;
    if (entry.at("before").is_null() || entry.at("suggested").is_null() || entry.at("random").is_null()) continue;
    pairs.push_back({session, &entry.at("before"), &entry.at("suggested"), &entry.at("random")});
  }
  if (open == 0) return;
  figures.push_back(
      {kNextSection, "further rows are suggested", "all", "share", wilson(suggesting, open), std::nullopt});
  for (const char* kind : {"turned", "outer", "later"}) {
    std::vector<Pair> of_kind;
    for (const Pair& pair : pairs)
      if (pair.session->results.at("next").at("kind") == kind) of_kind.push_back(pair);
    if (!of_kind.empty()) addPairs(figures, kind, of_kind);
  }
  if (!pairs.empty()) addPairs(figures, "all", pairs);
}

}  // namespace blind
