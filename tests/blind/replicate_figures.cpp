#include "tests/blind/replicate_figures.h"

#include <algorithm>

#include "tests/blind/generate_effects.h"
#include "tests/blind/judgement.h"

namespace blind {
namespace {

/// The selected effects that replicates can name: those of the signal show in samples alone.
std::vector<std::string> ofPoses(const nlohmann::json& selected) {
  std::vector<std::string> effects;
  for (const nlohmann::json& effect : selected)
    if (std::find(signalIds().begin(), signalIds().end(), effect) == signalIds().end()) effects.push_back(effect);
  return effects;
}

/// Whether each is the true effect, or what the design cannot tell from it.
bool areRight(const Session& session, const std::vector<std::string>& effects) {
  return std::all_of(effects.begin(), effects.end(),
                     [&](const std::string& effect) { return isRight(session, effect); });
}

}  // namespace

void addReplicateFigures(std::vector<Figure>& figures, const std::vector<const Session*>& sessions) {
  std::vector<Forecast> forecasts;
  std::vector<double> shares, differences;
  std::size_t right = 0;
  for (const Session* session : sessions) {
    const auto found = session->results.find("replicated");
    if (found == session->results.end() || found->second.contains("trouble")) continue;
    const nlohmann::json& entry = found->second;
    const std::vector<std::string> named = ofPoses(entry.at("selected"));
    if (named.empty() || entry.at("n").get<int>() == 0) continue;
    const double share = entry.at("named_so").get<double>() / entry.at("n").get<double>();
    const bool is_right = areRight(*session, named);
    forecasts.push_back({share, is_right});
    shares.push_back(share);
    differences.push_back(share - (is_right ? 1.0 : 0.0));
    right += is_right ? 1 : 0;
  }
  if (forecasts.empty()) return;
  const auto add = [&](const std::string& name, const std::string& unit, const Interval& interval) {
    figures.push_back(
        {"Replicates, where one effect is true and something was named", name, "all", unit, interval, std::nullopt});
  };
  add("replicates that name the same, mean", "share", bootstrap(shares, meanOf));
  add("named is the truth, in its class", "share", wilson(right, forecasts.size()));
  add("the first less the second", "", bootstrap(differences, meanOf));
  add("Brier score of the replicates' share", "", brierScore(forecasts));
  add("calibration error (ECE) of the replicates' share", "", calibrationError(forecasts));
}

}  // namespace blind
