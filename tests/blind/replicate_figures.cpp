#include "tests/blind/replicate_figures.h"

#include "tests/blind/judgement.h"

namespace blind {
namespace {

/// Whether nothing but the true effect, or what the design cannot tell from it, was selected.
bool isWhollyRight(const Session& session, const nlohmann::json& selected) {
  return std::all_of(selected.begin(), selected.end(),
                     [&](const nlohmann::json& effect) { return isRight(session, effect.get<std::string>()); });
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
    if (entry.at("selected").empty() || entry.at("n").get<int>() == 0) continue;
    const double share = entry.at("named_so").get<double>() / entry.at("n").get<double>();
    const bool is_right = isWhollyRight(*session, entry.at("selected"));
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
