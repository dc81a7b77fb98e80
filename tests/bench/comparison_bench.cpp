#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/evaluation/comparison.h"
#include "tests/bench/two_threads.h"

/// How long it takes to score every method with leave-one-out on 567 nodes, on two threads: seconds a method and in
/// all, the slow network apart. Exits with 1 when all of them take more than 20 s.
namespace {

using namespace fieldtrue;

constexpr double kMost_s = 20.0;

/// 9 x 9 x 7 nodes one foot apart in a room with a smooth distortion, noise and a jig.
CalibrationTable roomTable() {
  CalibrationTable table;
  table.metadata.jig_tolerance_m = 0.005;
  std::uint32_t state = 1;
  const auto noise = [&state] {
    double sum = 0.0;
    for (int i = 0; i < 12; ++i) sum += (state = state * 1664525U + 1013904223U) / 4294967296.0;
    return sum - 6.0;
  };
  for (int place = 0; place < 567; ++place) {
    Node node;
    node.node = place;
    node.index = {place % 9, place / 9 % 9, place / 81};
    const Eigen::Vector3d p_m =
        0.3048 * Eigen::Vector3d((*node.index)[0] - 4, (*node.index)[1] - 4, (*node.index)[2] + 1);
    const Eigen::Vector3d bent_m(0.03 * std::sin(1.5 * p_m.z() + p_m.x()), 0.05 * std::sin(1.1 * p_m.x() * p_m.y()),
                                 0.02 * p_m.squaredNorm() / 3.0);
    node.reference_from_sensor.position_m = p_m;
    node.tracker_from_sensor.position_m = p_m + bent_m + 0.005 * Eigen::Vector3d(noise(), noise(), noise());
    node.tracker_from_sensor.orientation =
        rotationFromVector(bent_m + 0.002 * Eigen::Vector3d(noise(), noise(), noise()));
    node.covariance_m2 = Eigen::Matrix3d(1e-6 * p_m.squaredNorm() * Eigen::Matrix3d::Identity());
    node.sd_rot_rad = 0.002;
    node.n_used = 60;
    node.n_effective = 20.0;
    table.nodes.push_back(node);
  }
  return table;
}

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
  const CalibrationTable table = roomTable();
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
