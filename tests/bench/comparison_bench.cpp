#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/evaluation/comparison.h"
#include "tests/bench/two_threads.h"
#include "tests/support/bent_room.h"

/// How long it takes to score every method with leave-one-out on 567 nodes, on two threads: seconds a method and in
/// all, the slow network apart. Exits with 1 when all of them take more than 20 s.
namespace {

using namespace fieldtrue;

constexpr double kMost_s = 20.0;

/// Seconds that a comparison of these methods takes.
double compared_s(const CalibrationTable& table, const evaluation::ComparisonOptions& options,
                  std::string* skipped = nullptr) {
  const auto start = std::chrono::steady_clock::now();
  const auto comparison = evaluation::compareMethods(table, options, twoThreads());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!comparison) {
    std::fprintf(stderr, "%s\n", comparison.error().message.c_str());
    return HUGE_VAL;
  }
  for (const auto* scores : {&comparison->position, &comparison->orientation})
    for (const evaluation::MethodScore& score : *scores)
      if (skipped != nullptr && score.skipped) *skipped = *score.skipped;
  return seconds;
}

void printMethod(const char* kind, const std::string& id, double seconds, const std::string& skipped) {
  std::printf("  %-12s %-28s %8.2f s%s%s\n", kind, id.c_str(), seconds,
              skipped.empty() ? "" : "  not used: ", skipped.c_str());
  std::fflush(stdout);
}

}  // namespace

int main() {
  const CalibrationTable table = testing::bentRoom();
  const std::string network = "neural_network";
  evaluation::ComparisonOptions all;
  std::printf("leave-one-out on %zu nodes, two threads\n", table.nodes.size());
  for (const correctors::PositionMethod& method : correctors::positionMethods()) {
    evaluation::ComparisonOptions one;
    one.with_surroundings = false;
    one.position_methods = {{method.id, {}}};
    one.orientation_methods = {{"none", {}}};
    std::string skipped;
    const double seconds = compared_s(table, one, &skipped);
    printMethod("position", method.id, seconds, skipped);
    if (method.id != network) all.position_methods.push_back({method.id, {}});
  }
  for (const correctors::OrientationMethod& method : correctors::orientationMethods()) {
    evaluation::ComparisonOptions one;
    one.with_surroundings = false;
    one.position_methods = {{"none", {}}};
    one.orientation_methods = {{method.id, {}}};
    std::string skipped;
    const double seconds = compared_s(table, one, &skipped);
    printMethod("orientation", method.id, seconds, skipped);
  }
  const double total_s = compared_s(table, all);
  std::printf("all but %s, with coverage, fold-back and orientation dependence: %.2f s (at most %.0f s)\n",
              network.c_str(), total_s, kMost_s);
  return total_s <= kMost_s ? 0 : 1;
}
