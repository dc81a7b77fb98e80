// Hardy's multiquadric against its peers on the same places, one thread: ALGLIB's multiquadric, VTK's thin-plate
// spline, SciPy's RBFInterpolator where it is installed, and a plain loop over an array of structures; and its
// evaluation against the square roots alone. Ratios are printed at the end; times depend on the machine, ratios
// hardly.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include "calib/correctors/baked/baked_lattice_maker.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/numerics/aligned_vector.h"
#include "calib/correctors/registry.h"
#include "calib/geometry/geometry.h"
#include "tests/bench/bent_grid.h"
#include "tests/bench/hmq_peers.h"
#include "tests/bench/square_roots.h"

namespace {

using namespace fieldtrue;
using namespace fieldtrue::bench;
using Model = std::unique_ptr<correctors::PositionModel>;

constexpr std::size_t kBatch = 100000;
constexpr double kLatticeBound_m = 50e-6;

const correctors::FitData& grid(std::int64_t n) {
  static std::map<std::int64_t, correctors::FitData> grids;
  const auto found = grids.find(n);
  return found != grids.end() ? found->second : grids.emplace(n, bentGrid(static_cast<int>(n))).first->second;
}

const std::vector<Eigen::Vector3d>& batchPoints() {
  static const std::vector<Eigen::Vector3d> points_m = pointsWithin(kBatch);
  return points_m;
}

Model fitOurs(const correctors::FitData& data) {
  const correctors::PositionMethod& method = *correctors::findPositionMethod("hmq").value();
  return method.fit(data, resolveSettings(method.id, method.settings, {}).value(), {}).value();
}

/// The multiquadric baked within 50 um.
Model fitLattice(const correctors::FitData& data) {
  const Region region = Region::around(data.p_tracked_m, 3, 0.02);
  auto lattice = correctors::bakeLattice(*fitOurs(data), region, data.p_tracked_m, kLatticeBound_m, {}).value();
  std::printf("%s\n", lattice->note().c_str());
  return lattice;
}

/// Fitted once a size: what is measured is evaluation.
template <class Fitted>
const Fitted& fittedOnce(std::int64_t n, Fitted (*fit)(const correctors::FitData&)) {
  static std::map<std::pair<std::int64_t, Fitted (*)(const correctors::FitData&)>, Fitted> models;
  const auto key = std::pair(n, fit);
  const auto found = models.find(key);
  return found != models.end() ? found->second : models.emplace(key, fit(grid(n))).first->second;
}

template <class Fitted>
void fitIt(benchmark::State& state, Fitted (*fit)(const correctors::FitData&)) {
  const correctors::FitData& data = grid(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(fit(data));
}

void onePoint(benchmark::State& state, Model (*fit)(const correctors::FitData&)) {
  const correctors::PositionModel& model = *fittedOnce(state.range(0), fit);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(model.displacement_m(batchPoints()[i++ % kBatch]));
}

void manyPoints(benchmark::State& state, Model (*fit)(const correctors::FitData&)) {
  const correctors::PositionModel& model = *fittedOnce(state.range(0), fit);
  std::vector<Eigen::Vector3d> corrected_m(kBatch);
  for (auto _ : state) {
    model.correct(batchPoints(), corrected_m);
    benchmark::DoNotOptimize(corrected_m.data());
  }
}

void rootsAlone(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0) * state.range(0) * state.range(0));
  correctors::AlignedVector<double> squares(count);
  for (std::size_t j = 0; j < count; ++j) squares[j] = 1e-3 * static_cast<double>(j + 1);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(sumOfRoots(squares.data(), count, batchPoints()[i++ % kBatch].x()));
}

/// ALGLIB's arrays, made once.
struct AlglibEvaluation {
  explicit AlglibEvaluation(std::int64_t n) : model(fittedOnce(n, fitAlglib)) {
    alglib::rbfcreatecalcbuffer(model, buffer);
    x.setlength(3);
    y.setlength(3);
  }
  void at(const Eigen::Vector3d& p_m) {
    for (int axis = 0; axis < 3; ++axis) x[axis] = p_m[axis];
    alglib::rbftscalcbuf(model, buffer, x, y);
    benchmark::DoNotOptimize(y[0]);
  }

  const alglib::rbfmodel& model;
  alglib::rbfcalcbuffer buffer;
  alglib::real_1d_array x;
  alglib::real_1d_array y;
};

void onePointAlglib(benchmark::State& state) {
  AlglibEvaluation evaluation(state.range(0));
  std::size_t i = 0;
  for (auto _ : state) evaluation.at(batchPoints()[i++ % kBatch]);
}

void manyPointsAlglib(benchmark::State& state) {
  AlglibEvaluation evaluation(state.range(0));
  for (auto _ : state)
    for (const Eigen::Vector3d& p_m : batchPoints()) evaluation.at(p_m);
}

void onePointVtk(benchmark::State& state) {
  const vtkSmartPointer<vtkThinPlateSplineTransform>& model = fittedOnce(state.range(0), fitVtk);
  std::size_t i = 0;
  double out_m[3];
  for (auto _ : state) {
    model->InternalTransformPoint(batchPoints()[i++ % kBatch].data(), out_m);
    benchmark::DoNotOptimize(out_m[0]);
  }
}

void onePointPlain(benchmark::State& state) {
  const PlainMultiquadric& model = fittedOnce(state.range(0), plainTerms);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(model.value(batchPoints()[i++ % kBatch]));
}

// The argument is places along an axis: 8 -> 512, 13 -> 2197. VTK's fit takes minutes beyond 512.
BENCHMARK_CAPTURE(fitIt, ours, fitOurs)->Name("fit/fieldtrue")->Arg(8)->Arg(13)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fitIt, alglib, fitAlglib)->Name("fit/alglib")->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fitIt, alglib, fitAlglib)->Name("fit/alglib")->Arg(13)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(fitIt, vtk, fitVtk)->Name("fit/vtk")->Arg(8)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(rootsAlone)->Name("one point/square roots alone")->Arg(8)->Arg(13);
BENCHMARK_CAPTURE(onePoint, ours, fitOurs)->Name("one point/fieldtrue")->Arg(8)->Arg(13);
BENCHMARK_CAPTURE(onePoint, lattice, fitLattice)->Name("one point/lattice")->Arg(8);
BENCHMARK(onePointAlglib)->Name("one point/alglib")->Arg(8)->Arg(13);
BENCHMARK(onePointVtk)->Name("one point/vtk")->Arg(8);
BENCHMARK(onePointPlain)->Name("one point/plain loop")->Arg(8)->Arg(13);
BENCHMARK_CAPTURE(manyPoints, ours, fitOurs)
    ->Name("100,000 points/fieldtrue")
    ->Arg(8)
    ->Arg(13)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(manyPoints, lattice, fitLattice)
    ->Name("100,000 points/lattice")
    ->Arg(8)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(manyPointsAlglib)->Name("100,000 points/alglib")->Arg(8)->Unit(benchmark::kMillisecond);

/// Prints as the console does and remembers the time of one iteration of each benchmark [s]; of repetitions the
/// shortest.
class RememberingReporter : public benchmark::ConsoleReporter {
 public:
  RememberingReporter() : ConsoleReporter(OO_Tabular) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      // "fit/alglib/13" or "fit/alglib/13/iterations:1": task, who, size.
      const std::string name = run.benchmark_name();
      const std::size_t first = name.find('/');
      const std::size_t second = name.find('/', first + 1);
      const std::size_t third = std::min(name.find('/', second + 1), name.size());
      add(name.substr(0, first), name.substr(first + 1, second - first - 1),
          std::stoi(name.substr(second + 1, third - second - 1)),
          run.cpu_accumulated_time / static_cast<double>(run.iterations));
    }
    ConsoleReporter::ReportRuns(runs);
  }

  void add(const std::string& task, const std::string& who, int n, double time_s) {
    double& shortest_s = times_s_[{task, n}].try_emplace(who, time_s).first->second;
    shortest_s = std::min(shortest_s, time_s);
  }

  bool hasOurFit(int n) const { return times_s_.contains({"fit", n}) && times_s_.at({"fit", n}).contains("fieldtrue"); }

  void printRatios() const {
    std::printf("\nTime of the others over ours (CPU time, one thread, shortest of the repetitions)\n");
    for (const auto& [key, times_s] : times_s_) {
      const auto ours = times_s.find("fieldtrue");
      if (ours == times_s.end()) continue;
      std::printf("%-16s n=%-5d fieldtrue %.4g us\n", key.first.c_str(), key.second * key.second * key.second,
                  1e6 * ours->second);
      for (const auto& [who, time_s] : times_s)
        if (who != "fieldtrue")
          std::printf("    %-20s %10.4g us  %8.2fx\n", who.c_str(), 1e6 * time_s, time_s / ours->second);
    }
  }

 private:
  std::map<std::pair<std::string, int>, std::map<std::string, double>> times_s_;
};

void addScipy(RememberingReporter& reporter) {
  for (const int n : {8, 13}) {
    if (!reporter.hasOurFit(n)) continue;
    const auto scipy = runScipy(grid(n), batchPoints());
    if (!scipy) return;
    for (const auto& [task, time_s] : scipy->times_s) reporter.add(task, "scipy " + scipy->version, n, time_s);
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  RememberingReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  addScipy(reporter);
  reporter.printRatios();
  return 0;
}
