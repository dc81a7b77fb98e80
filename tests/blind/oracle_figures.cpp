#include "tests/blind/oracle_figures.h"

#include <cmath>
#include <cstdio>

#include "tests/blind/generate_session.h"
#include "tests/blind/judgement.h"

namespace blind {
namespace {

/// Shares of the squares at the start that were taken away in the hull of one session.
struct TakenAway {
  const Session* session = nullptr;
  double start_m2 = 0;
  double report = 0, oracle = 0, parameters_known = 0;
};

double leftIn(const nlohmann::json& entry) {
  const nlohmann::json& inside = entry.at("inside");
  return inside.at("after_m2").get<double>() / inside.at("start_m2").get<double>();
}

std::vector<TakenAway> takenAwayIn(const std::vector<const Session*>& sessions) {
  std::vector<TakenAway> taken;
  for (const Session* session : sessions) {
    const auto oracle = session->results.find("oracle");
    if (oracle == session->results.end()) continue;
    const nlohmann::json& entry = oracle->second;
    taken.push_back({session, entry.at("inside").at("start_m2").get<double>(),
                     foretoldShrinkage(*session, true).value_or(0.0), 1 - leftIn(entry),
                     1 - leftIn(entry.at("parameters_known"))});
  }
  return taken;
}

void addGroup(std::vector<Figure>& figures, const std::string& group, const std::vector<TakenAway>& taken) {
  if (taken.empty()) return;
  const auto add = [&](const std::string& name, const Interval& interval) {
    figures.push_back({"Excess taken away in the hull, over what the true effects fitted again take", name, group, "",
                       interval, std::nullopt});
  };
  const auto mean = [&](double TakenAway::*member) {
    std::vector<double> values;
    for (const TakenAway& one : taken) values.push_back(one.*member);
    return bootstrap(values, meanOf);
  };
  std::vector<Tally> by_session, pooled;
  for (const TakenAway& one : taken) {
    by_session.push_back({one.report, one.oracle});
    pooled.push_back({one.start_m2 * one.report, one.start_m2 * one.oracle});
  }
  add("report over oracle, each session's start counts alike", ratioOfSums(by_session));
  add("report over oracle, squares of all sessions summed", ratioOfSums(pooled));
  add("of the report, mean", mean(&TakenAway::report));
  add("of the oracle, mean", mean(&TakenAway::oracle));
  add("of the true parameters, alignment fitted, mean", mean(&TakenAway::parameters_known));
}

}  // namespace

void addOracleFigures(std::vector<Figure>& figures, const std::vector<const Session*>& sessions) {
  const std::vector<TakenAway> all = takenAwayIn(sessions);
  const bool is_foretold = std::any_of(all.begin(), all.end(),
                                       [](const TakenAway& one) { return one.session->results.count("foretold") > 0; });
  if (!is_foretold) return;
  const auto some = [&](const std::string& shelf, const auto& test) {
    std::vector<TakenAway> kept;
    for (const TakenAway& one : all)
      if (one.session->shelf == shelf && test(*one.session)) kept.push_back(one);
    return kept;
  };
  for (const double level : kLevels) {
    char group[32];
    std::snprintf(group, sizeof group, "rho %.2g", level);
    addGroup(figures, group, some("single", [level](const Session& session) {
               return session.rho_level && std::abs(*session.rho_level - level) < 1e-6;
             }));
  }
  addGroup(figures, "other rho", some("single", [](const Session& session) { return !session.rho_level; }));
  const auto any = [](const Session&) { return true; };
  addGroup(figures, "one effect", some("single", any));
  addGroup(figures, "two or three at once", some("pairs", any));
  addGroup(figures, "outside the catalogue", some("off", any));
}

}  // namespace blind
