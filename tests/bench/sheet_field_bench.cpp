#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <cmath>

#include "calib/effects/sheet_field.h"

/// The field of a plate's dipoles at the places of a recording, beside the same sums as Eigen's array expressions: a
/// loop that the compiler does not vectorise falls behind them.
namespace {

using namespace fieldtrue;

constexpr Eigen::Index kSources = 300;

struct Sheet {
  explicit Sheet(Eigen::Index n_places)
      : x_m(Eigen::ArrayXd::LinSpaced(n_places, -1.0, 1.0)),
        y_m(Eigen::ArrayXd::LinSpaced(n_places, 0.7, -0.9)),
        z_m(Eigen::ArrayXd::LinSpaced(n_places, 0.3, 1.2)),
        per_m3(Eigen::ArrayXXd::Zero(n_places, 9)) {}

  Eigen::ArrayXd x_m, y_m, z_m;
  Eigen::ArrayXXd per_m3;
};

effects::SheetSource sourceAt(Eigen::Index source) {
  static constexpr double kStrength[3] = {0.3, -0.2, 0.9};
  const double angle_rad = 0.1 * static_cast<double>(source);
  return {0.4 * std::cos(angle_rad), 0.4 * std::sin(angle_rad), kStrength};
}

void sheetDipoles(benchmark::State& state) {
  Sheet sheet(state.range(0));
  const effects::SheetField field{sheet.x_m.data(), sheet.y_m.data(), sheet.z_m.data(),
                                  static_cast<std::size_t>(state.range(0)), sheet.per_m3.data()};
  for ([[maybe_unused]] auto _ : state) {
    for (Eigen::Index source = 0; source < kSources; ++source) effects::addDipole(sourceAt(source), field);
    benchmark::DoNotOptimize(sheet.per_m3.data());
  }
  state.counters["sum_per_m3"] = sheet.per_m3.sum() / static_cast<double>(state.iterations());
}
BENCHMARK(sheetDipoles)->Arg(100)->Arg(567)->Unit(benchmark::kMicrosecond);

void sheetDipolesByEigen(benchmark::State& state) {
  Sheet sheet(state.range(0));
  Eigen::ArrayXd dx_m, dy_m, r2_m2, per_r5;
  for ([[maybe_unused]] auto _ : state) {
    for (Eigen::Index source = 0; source < kSources; ++source) {
      const effects::SheetSource at = sourceAt(source);
      dx_m = sheet.x_m - at.x_m;
      dy_m = sheet.y_m - at.y_m;
      r2_m2 = dx_m.square() + dy_m.square() + sheet.z_m.square();
      per_r5 = 1.0 / (r2_m2.square() * r2_m2.sqrt());
      for (Eigen::Index coil = 0; coil < 3; ++coil) {
        sheet.per_m3.col(coil) += per_r5 * (3.0 * sheet.z_m * dx_m) * at.strength[coil];
        sheet.per_m3.col(3 + coil) += per_r5 * (3.0 * sheet.z_m * dy_m) * at.strength[coil];
        sheet.per_m3.col(6 + coil) += per_r5 * (3.0 * sheet.z_m.square() - r2_m2) * at.strength[coil];
      }
    }
    benchmark::DoNotOptimize(sheet.per_m3.data());
  }
  state.counters["sum_per_m3"] = sheet.per_m3.sum() / static_cast<double>(state.iterations());
}
BENCHMARK(sheetDipolesByEigen)->Arg(100)->Arg(567)->Unit(benchmark::kMicrosecond);

}  // namespace
