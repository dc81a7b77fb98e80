#include "tests/blind/plan_classes.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/blind/subprocess.h"

namespace blind {

namespace {

/// Programs before that key said nothing of strength.
bool isTooWeak(const nlohmann::json& pair, double rho) {
  if (rho <= 0.0 || !pair.contains("told_apart_from")) return false;
  const nlohmann::json& from = pair["told_apart_from"];
  return !from.is_number() || rho < from.get<double>();
}

}  // namespace

std::optional<Classes> planCheckClasses(const std::filesystem::path& cli, const std::filesystem::path& nodes,
                                        const std::vector<std::string>& ids, double rho) {
  constexpr double kSame = 0.9;
  const Finished checked =
      runProgram({cli.string(), "plan-check", "--nodes", nodes.string(), "--json", "--threads", "1"});
  if (checked.exit_status != 0) return std::nullopt;
  const nlohmann::json answer = nlohmann::json::parse(checked.output, nullptr, false);
  if (!answer.is_object() || !answer.contains("pairs") || !answer["pairs"].is_array()) return std::nullopt;
  std::set<std::pair<std::string, std::string>> same;
  for (const nlohmann::json& pair : answer["pairs"]) {
    if (!pair.is_object() || !pair.contains("r2") || !pair["r2"].is_number()) continue;
    if (pair["r2"].get<double>() <= kSame && !isTooWeak(pair, rho)) continue;
    const std::string a = pair.value("a", ""), b = pair.value("b", "");
    same.emplace(std::min(a, b), std::max(a, b));
  }
  return joinedClasses(ids, [&](std::size_t a, std::size_t b) {
    return same.count({std::min(ids[a], ids[b]), std::max(ids[a], ids[b])}) > 0;
  });
}

}  // namespace blind
