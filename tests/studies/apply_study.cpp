#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/evaluation/comparison.h"
#include "tests/studies/accuracy_study.h"
#include "tests/studies/halves.h"
#include "tests/studies/rooms.h"
#include "tests/studies/workers.h"

namespace fieldtrue::testing {
namespace {

constexpr int kSplits = 200;

/// How often the verdict says "apply" over splits of one table.
struct Tally {
  std::string name;
  bool helps = false;  ///< By leaving each place out of all of them.
  int splits = 0;
  int applied_auto = 0;  ///< The calibration chosen on the fitted half.
  int applied_best = 0;  ///< The best of all methods, chosen on the half that judges: with hindsight.
};

void addSplit(const CalibrationTable& table, std::uint64_t seed, Tally& tally) {
  const CalibrationTable halves = splitInHalves(table, seed);
  tally.applied_auto += saysApply(halves, {{"auto", {}}}) ? 1 : 0;
  tally.applied_best += saysApply(halves, {}) ? 1 : 0;
  ++tally.splits;
}

nlohmann::json report(const std::vector<Tally>& tallies) {
  std::printf(
      "\n| table | helps, by all places | splits | applied: chosen on the fitted half | applied: best of all on the "
      "judging half |\n|---|---|---|---|---|\n");
  nlohmann::json rows = nlohmann::json::array();
  Tally not_helped{"all where it does not help", false, 0, 0, 0};
  for (const Tally& tally : tallies) {
    std::printf("| %s | %s | %d | %d | %d |\n", tally.name.c_str(), tally.helps ? "yes" : "no", tally.splits,
                tally.applied_auto, tally.applied_best);
    rows.push_back({{"table", tally.name},
                    {"helps", tally.helps},
                    {"splits", tally.splits},
                    {"applied_auto", tally.applied_auto},
                    {"applied_best", tally.applied_best}});
    if (tally.helps) continue;
    not_helped.splits += tally.splits;
    not_helped.applied_auto += tally.applied_auto;
    not_helped.applied_best += tally.applied_best;
  }
  if (not_helped.splits > 0)
    std::printf("\nFalse \"apply\": %.1f %% of %d splits chosen on the fitted half, %.1f %% with hindsight\n",
                100.0 * not_helped.applied_auto / not_helped.splits, not_helped.splits,
                100.0 * not_helped.applied_best / not_helped.splits);
  return rows;
}

}  // namespace

nlohmann::json applyStudy(const StudyOptions& options) {
  std::vector<Tally> tallies;
  std::vector<CalibrationTable> tables;
  const char* folder = std::getenv("FIELDTRUE_REAL_DATA");
  if (folder == nullptr) std::printf("\nFIELDTRUE_REAL_DATA is not set: the real recordings are left out\n");
  for (const char* condition : kAnserConditions) {
    if (folder == nullptr) break;
    tables.push_back(readAnser(std::filesystem::path(folder) / "anser_duplo/nodes.csv", condition));
    tallies.push_back({std::string("anser_duplo, ") + condition});
  }
  const Scene mixed = readRoom(FIELDTRUE_RESOURCES, "mixed");
  tables.push_back(tableToFit(recordRoom(mixed, 1, 0, 2)));
  tallies.push_back({"mixed room, 5x5x4"});
  inParallel(options.threads, tables.size(), "verdicts", [&](std::size_t t) {
    Tally& tally = tallies[t];
    const bool is_room = t + 1 == tables.size();
    tally.helps = helpsByAllPlaces(tables[t]);
    for (int split = 0; split < kSplits; ++split) {
      const auto seed = static_cast<std::uint64_t>(split + 1);
      addSplit(is_room ? tableToFit(recordRoom(mixed, seed, 0, 2)) : tables[t], seed, tally);
    }
  });
  return report(tallies);
}

}  // namespace fieldtrue::testing
