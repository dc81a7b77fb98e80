// How the cost of a fit and of an evaluation grows with the number of places, for every position method of the registry
// with its default settings, on one thread. Writes one HTML page with plots and a table, and prints the table's
// figures.
//
// growth_bench [PAGE.html]      default: growth.html in the current folder
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <optional>
#include <thread>

#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "tests/bench/bent_grid.h"
#include "tests/bench/growth_report.h"

namespace {

using namespace fieldtrue;
using namespace fieldtrue::bench;
using Clock = std::chrono::steady_clock;

constexpr double kMostFit_s = 30.0;
constexpr double kMostInAll_s = 270.0;
/// Grids of 100 to 5,000 places.
constexpr std::array<std::array<int, 3>, 7> kGrids = {
    {{5, 5, 4}, {6, 6, 6}, {8, 8, 8}, {10, 10, 10}, {13, 13, 13}, {16, 15, 14}, {20, 25, 10}}};

/// CPU time of this program [s]: what others do on the machine does not count.
double cpuTime_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Asks a fit to stop after a while.
class Deadline {
 public:
  explicit Deadline(double seconds)
      : timer_([this, seconds](const std::stop_token& done) {
          const auto start = Clock::now();
          while (!done.stop_requested() && secondsSince(start) < seconds)
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
          if (!done.stop_requested()) source_.request_stop();
        }) {}
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::jthread timer_;
};

double evaluation_ns(const correctors::PositionModel& model) {
  std::vector<Eigen::Vector3d> points_m = pointsWithin(1000);
  std::vector<Eigen::Vector3d> covered_m;
  for (const Eigen::Vector3d& p_m : points_m)
    if (model.covers(p_m)) covered_m.push_back(p_m);
  if (covered_m.empty()) return 0.0;
  std::vector<Eigen::Vector3d> corrected_m(covered_m.size());
  double shortest_s = HUGE_VAL;
  double spent_s = 0.0;
  for (int repetition = 0; repetition < 20 && (repetition < 2 || spent_s < 0.1); ++repetition) {
    const double start_s = cpuTime_s();
    model.correct(covered_m, corrected_m);
    const double time_s = cpuTime_s() - start_s;
    shortest_s = std::min(shortest_s, time_s);
    spent_s += time_s;
  }
  return 1e9 * shortest_s / static_cast<double>(covered_m.size());
}

/// What the next fit will take by the growth of the last two; by the square of n where only one is known.
double expectedFit_s(const GrowthCurve& curve, int n) {
  if (curve.points.empty()) return 0.0;
  const GrowthCurve::Point& last = curve.points.back();
  double power = 2.0;
  if (curve.points.size() > 1) {
    const GrowthCurve::Point& before = curve.points[curve.points.size() - 2];
    power = std::clamp(std::log(last.fit_s / before.fit_s) / std::log(double(last.n) / before.n), 0.5, 3.5);
  }
  return last.fit_s * std::pow(double(n) / last.n, power);
}

/// Measures one size of one method.
/// @return why it was not measured; none when it was
std::optional<std::string> measure(const correctors::PositionMethod& method, const correctors::FitData& data,
                                   double most_s, GrowthCurve& curve) {
  const Settings settings = resolveSettings(method.id, method.settings, {}).value();
  const int n = static_cast<int>(data.size());
  double shortest_s = HUGE_VAL;
  Result<std::unique_ptr<correctors::PositionModel>> model;
  const auto begin = Clock::now();
  for (int repetition = 0; repetition < 5 && (repetition == 0 || secondsSince(begin) < 0.2); ++repetition) {
    Deadline deadline(most_s);
    RunControl control;
    control.stop = deadline.token();
    const double start_s = cpuTime_s();
    model = method.fit(data, settings, control);
    if (!model && model.error().code == ErrorCode::kCancelled)
      return "n = " + std::to_string(n) + " and more: the fit was stopped after " + std::to_string(int(most_s)) + " s";
    if (!model) return "n = " + std::to_string(n) + ": " + model.error().message;
    shortest_s = std::min(shortest_s, cpuTime_s() - start_s);
  }
  curve.points.push_back({n, shortest_s, evaluation_ns(**model)});
  std::printf("n=%-5d %-20s fit %10.4g s   evaluation %10.4g us\n", n, method.id.c_str(), shortest_s,
              1e-3 * curve.points.back().evaluation_ns);
  std::fflush(stdout);
  return std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "growth.html";
  const std::span<const correctors::PositionMethod> methods = correctors::positionMethods();
  std::vector<GrowthCurve> curves(methods.size());
  const auto start = Clock::now();
  for (const auto& counts : kGrids) {
    const correctors::FitData data = straightGrid(counts);
    const int n = static_cast<int>(data.size());
    for (std::size_t i = 0; i < methods.size(); ++i) {
      curves[i].method = methods[i].id;
      if (!curves[i].remark.empty()) continue;
      const double left_s = kMostInAll_s - secondsSince(start);
      const double expected_s = expectedFit_s(curves[i], n);
      std::optional<std::string> reason;
      if (expected_s > kMostFit_s)
        reason = "n = " + std::to_string(n) + " and more: a fit would take more than 30 s";
      else if (expected_s > left_s || left_s < 1.0)
        reason = "n = " + std::to_string(n) + " and more: left out to keep the whole run below five minutes";
      else
        reason = measure(methods[i], data, std::min(kMostFit_s, left_s), curves[i]);
      if (reason) curves[i].remark = *reason;
      if (reason) std::printf("n=%-5d %-20s %s\n", n, methods[i].id.c_str(), reason->c_str());
    }
  }
  std::ofstream out(path);
  out << growthPage(
      curves,
      "Position methods with their default settings on a grid of two metres, one thread, CPU time, shortest of "
      "up to five fits. Sizes that a fit would need more than 30 s for are left out.");
  if (!out.flush()) {
    std::fprintf(stderr, "%s cannot be written\n", path.c_str());
    return 1;
  }
  std::printf("Written to %s after %.0f s\n", path.c_str(), secondsSince(start));
  return 0;
}
