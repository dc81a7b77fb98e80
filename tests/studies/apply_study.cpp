#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/evaluation/comparison.h"
#include "tests/studies/accuracy_study.h"
#include "tests/studies/rooms.h"
#include "tests/studies/verdict_outcome.h"
#include "tests/studies/workers.h"

namespace fieldtrue::testing {
namespace {

constexpr int kSplits = 200;

/// How often the verdict said "apply" over splits of one table, and how often that did harm on places that nothing had
/// seen.
struct Count {
  int applied = 0;
  int wrongly = 0;
  void add(const VerdictOutcome& outcome) {
    applied += outcome.applied ? 1 : 0;
    wrongly += outcome.isFalse() ? 1 : 0;
  }
  void add(const Count& other) {
    applied += other.applied;
    wrongly += other.wrongly;
  }
};

struct Tally {
  std::string name;
  int splits = 0;
  Count automatic;  ///< The calibration chosen on the fitted half.
  Count best;       ///< The best of all methods, chosen on the quarter that judges: with hindsight.
};

void addSplit(const CalibrationTable& table, std::uint64_t seed, Tally& tally) {
  const CalibrationTable split = splitForVerdict(table, seed);
  tally.automatic.add(verdictOutcome(split, {{"auto", {}}}));
  tally.best.add(verdictOutcome(split, {}));
  ++tally.splits;
}

nlohmann::json report(const std::vector<Tally>& tallies) {
  std::printf(
      "\n| table | splits | applied: chosen on the fitted half | wrongly | applied: best of all on the judging quarter "
      "| wrongly |\n|---|---|---|---|---|---|\n");
  nlohmann::json rows = nlohmann::json::array();
  Tally all;
  for (const Tally& tally : tallies) {
    std::printf("| %s | %d | %d | %d | %d | %d |\n", tally.name.c_str(), tally.splits, tally.automatic.applied,
                tally.automatic.wrongly, tally.best.applied, tally.best.wrongly);
    rows.push_back({{"table", tally.name},
                    {"splits", tally.splits},
                    {"applied_auto", tally.automatic.applied},
                    {"wrongly_auto", tally.automatic.wrongly},
                    {"applied_best", tally.best.applied},
                    {"wrongly_best", tally.best.wrongly}});
    all.splits += tally.splits;
    all.automatic.add(tally.automatic);
    all.best.add(tally.best);
  }
  std::printf("\nFalse \"apply\": %.1f %% of %d splits chosen on the fitted half, %.1f %% with hindsight\n",
              100.0 * all.automatic.wrongly / all.splits, all.splits, 100.0 * all.best.wrongly / all.splits);
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
    tallies.push_back({std::string("anser_duplo, ") + condition, 0, {}, {}});
  }
  const simulation::Scene mixed = readRoom(FIELDTRUE_RESOURCES, "mixed");
  tables.push_back(tableToFit(recordRoom(mixed, 1, 0, 2)));
  tallies.push_back({"mixed room, 5x5x4", 0, {}, {}});
  inParallel(options.threads, tables.size(), "verdicts", [&](std::size_t t) {
    Tally& tally = tallies[t];
    const bool is_room = t + 1 == tables.size();
    for (int split = 0; split < kSplits; ++split) {
      const auto seed = static_cast<std::uint64_t>(split + 1);
      addSplit(is_room ? tableToFit(recordRoom(mixed, seed, 0, 2)) : tables[t], seed, tally);
    }
  });
  return report(tallies);
}

}  // namespace fieldtrue::testing
