#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/evaluation/comparison.h"
#include "tests/bench/two_threads.h"
#include "tests/support/bent_room.h"

/// How long a comparison takes on two threads, in ten folds as soon as a tuned method takes part, and how soon it ends
/// after it was told to stop:
///
///   comparison_bench            each method, all fixed methods together, auto; 567 and 1152 places
///   comparison_bench stop       the longest of some stops at random times, of each costly method, 567 places
namespace {

using namespace fieldtrue;
using Clock = std::chrono::steady_clock;

const std::string kAutomatic = "auto";

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

evaluation::ComparisonOptions ofMethods(const std::vector<std::string>& position) {
  evaluation::ComparisonOptions options;
  options.with_surroundings = false;
  options.orientation_methods = {{"none", {}}};
  for (const std::string& id : position) options.position_methods.push_back({id, {}});
  return options;
}

/// Seconds that a comparison takes, and why a method was not used.
double compared_s(const CalibrationTable& table, const evaluation::ComparisonOptions& options, std::string& skipped) {
  const auto start = Clock::now();
  const auto comparison = evaluation::compareMethods(table, options, twoThreads());
  const double seconds = secondsSince(start);
  if (!comparison) {
    skipped = comparison.error().message;
    return HUGE_VAL;
  }
  for (const evaluation::MethodScore& score : comparison->position)
    if (score.skipped) skipped += score.method + ": " + *score.skipped + " ";
  return seconds;
}

void printTime(const std::string& what, double seconds, const std::string& skipped, double aim_s = 0.0) {
  std::printf("  %-24s %8.2f s", what.c_str(), seconds);
  if (aim_s > 0.0) std::printf("   aim %.0f s: %s", aim_s, seconds <= aim_s ? "met" : "missed");
  std::printf("%s%s\n", skipped.empty() ? "" : "   not used: ", skipped.c_str());
  std::fflush(stdout);
}

void timeMethods(const CalibrationTable& table, double fixed_aim_s, double automatic_aim_s) {
  std::printf("%zu places, two threads\n", table.nodes.size());
  std::vector<std::string> fixed;
  for (const correctors::PositionMethod& method : correctors::positionMethods()) {
    std::string skipped;
    const double seconds = compared_s(table, ofMethods({method.id}), skipped);
    printTime(method.id, seconds, skipped, method.id == kAutomatic ? automatic_aim_s : 0.0);
    if (method.id != kAutomatic) fixed.push_back(method.id);
  }
  std::string skipped;
  evaluation::ComparisonOptions options = ofMethods(fixed);
  options.with_surroundings = true;
  const double seconds = compared_s(table, options, skipped);
  printTime("all fixed methods", seconds, skipped, fixed_aim_s);
}

/// Seconds from the request to stop until a comparison has ended, stopped after some time.
double stopped_s(const CalibrationTable& table, const evaluation::ComparisonOptions& options, double after_s) {
  std::stop_source source;
  RunControl control = twoThreads();
  control.stop = source.get_token();
  std::jthread worker([&] { (void)evaluation::compareMethods(table, options, control); });
  std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
  const auto start = Clock::now();
  source.request_stop();
  worker.join();
  return secondsSince(start);
}

void timeStops(const CalibrationTable& table) {
  constexpr int kStops = 20;
  std::printf("%zu places, two threads: the longest of %d stops at random times (aim 2 s)\n", table.nodes.size(),
              kStops);
  std::mt19937_64 generator(1);
  for (const correctors::PositionMethod& method : correctors::positionMethods()) {
    const evaluation::ComparisonOptions options = ofMethods({method.id});
    std::string skipped;
    const double whole_s = compared_s(table, options, skipped);
    if (whole_s < 1.0) continue;
    std::uniform_real_distribution<double> when_s(0.0, std::min(whole_s, 10.0));
    double longest_s = 0.0;
    for (int i = 0; i < kStops; ++i) longest_s = std::max(longest_s, stopped_s(table, options, when_s(generator)));
    printTime(method.id, longest_s, skipped, 2.0);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const CalibrationTable room = testing::bentRoom();
  if (argc > 1 && std::string(argv[1]) == "stop") {
    timeStops(room);
    return 0;
  }
  timeMethods(room, 20.0, 120.0);
  timeMethods(testing::bentRoom({12, 12, 8}), 60.0, 360.0);
  return 0;
}
