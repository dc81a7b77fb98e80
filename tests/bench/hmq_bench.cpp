// Hardy's multiquadric against its peers on the same places, one thread: ALGLIB's multiquadric, VTK's thin-plate spline
// and a plain loop over an array of structures. Ratios are printed at the end; times depend on the machine, ratios
// hardly.
#include <benchmark/benchmark.h>
#include <interpolation.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkThinPlateSplineTransform.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <random>

#include "calib/correctors/registry.h"

namespace {

using fieldtrue::FitData;
using fieldtrue::PositionModel;

constexpr std::size_t kBatch = 100000;
constexpr double kR_m = 0.1;  // The default R squared, 100 cm2.

/// A grid of n^3 places over 2 m, shaken and bent as a tracker would.
FitData bentGrid(int n) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> noise_m(0.0, 0.002);
  FitData data;
  for (int i = 0; i < n * n * n; ++i) {
    const Eigen::Vector3d p_true_m = 2.0 / n * Eigen::Vector3d(i % n, i / n % n, i / (n * n));
    const Eigen::Vector3d bend_m(std::sin(2.0 * p_true_m.y()), std::cos(1.5 * p_true_m.z()),
                                 p_true_m.x() * p_true_m.y());
    data.p_true_m.push_back(p_true_m);
    data.p_tracked_m.push_back(p_true_m + 0.05 * bend_m +
                               Eigen::Vector3d(noise_m(generator), noise_m(generator), noise_m(generator)));
    data.node.push_back(i);
  }
  return data;
}

const FitData& grid(std::int64_t n) {
  static std::map<std::int64_t, FitData> grids;
  const auto found = grids.find(n);
  return found != grids.end() ? found->second : grids.emplace(n, bentGrid(static_cast<int>(n))).first->second;
}

const std::vector<Eigen::Vector3d>& batchPoints() {
  static const std::vector<Eigen::Vector3d> points_m = [] {
    std::mt19937_64 generator(2);
    std::uniform_real_distribution<double> uniform(0.0, 1.8);
    std::vector<Eigen::Vector3d> made(kBatch);
    for (Eigen::Vector3d& p_m : made) p_m = Eigen::Vector3d(uniform(generator), uniform(generator), uniform(generator));
    return made;
  }();
  return points_m;
}

std::unique_ptr<PositionModel> fitFieldtrue(const FitData& data) {
  const fieldtrue::PositionMethod& method = *fieldtrue::findPositionMethod("hmq").value();
  const fieldtrue::Settings settings = fieldtrue::resolveSettings(method.id, method.settings, {}).value();
  return method.fit(data, settings, {}).value();
}

alglib::rbfmodel fitAlglib(const FitData& data) {
  const auto count = static_cast<alglib::ae_int_t>(data.size());
  alglib::real_2d_array xy;
  xy.setlength(count, 6);
  for (alglib::ae_int_t i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      xy[i][axis] = data.p_tracked_m[static_cast<std::size_t>(i)][axis];
      xy[i][3 + axis] = data.p_true_m[static_cast<std::size_t>(i)][axis];
    }
  }
  alglib::rbfmodel model;
  alglib::rbfcreate(3, 3, model);
  alglib::rbfsetpoints(model, xy);
  alglib::rbfsetalgomultiquadricmanual(model, kR_m, 0.0);
  alglib::rbfreport report;
  alglib::rbfbuildmodel(model, report);
  if (report.terminationtype <= 0) std::fprintf(stderr, "ALGLIB did not solve the problem\n");
  return model;
}

vtkSmartPointer<vtkThinPlateSplineTransform> fitVtk(const FitData& data) {
  vtkNew<vtkPoints> source;
  vtkNew<vtkPoints> target;
  source->SetDataTypeToDouble();
  target->SetDataTypeToDouble();
  for (std::size_t i = 0; i < data.size(); ++i) {
    source->InsertNextPoint(data.p_tracked_m[i].data());
    target->InsertNextPoint(data.p_true_m[i].data());
  }
  auto transform = vtkSmartPointer<vtkThinPlateSplineTransform>::New();
  transform->SetBasisToR();
  transform->SetSourceLandmarks(source);
  transform->SetTargetLandmarks(target);
  transform->Update();
  return transform;
}

/// The textbook loop: one structure a centre.
struct PlainMultiquadric {
  struct Term {
    Eigen::Vector3d center_m;
    Eigen::Vector3d alpha;
  };
  std::vector<Term> terms;

  Eigen::Vector3d value(const Eigen::Vector3d& p_m) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Term& term : terms) sum += term.alpha * std::sqrt((p_m - term.center_m).squaredNorm() + kR_m * kR_m);
    return sum;
  }
};

PlainMultiquadric plainTerms(const FitData& data) {
  PlainMultiquadric plain;
  for (std::size_t i = 0; i < data.size(); ++i) plain.terms.push_back({data.p_tracked_m[i], data.p_true_m[i]});
  return plain;
}

/// Fitted once a size: what is measured is evaluation.
template <class Model>
const Model& fittedOnce(std::int64_t n, Model (*fit)(const FitData&)) {
  static std::map<std::int64_t, Model> models;
  const auto found = models.find(n);
  return found != models.end() ? found->second : models.emplace(n, fit(grid(n))).first->second;
}

void fitOurs(benchmark::State& state) {
  const FitData& data = grid(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(fitFieldtrue(data));
}

void fitTheAlglib(benchmark::State& state) {
  const FitData& data = grid(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(fitAlglib(data));
}

void fitTheVtk(benchmark::State& state) {
  const FitData& data = grid(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(fitVtk(data));
}

void evaluateOurs(benchmark::State& state) {
  const PositionModel& model = *fittedOnce(state.range(0), fitFieldtrue);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(model.displacement_m(batchPoints()[i++ % kBatch]));
}

void evaluateAlglib(benchmark::State& state) {
  const alglib::rbfmodel& model = fittedOnce(state.range(0), fitAlglib);
  alglib::rbfcalcbuffer buffer;
  alglib::rbfcreatecalcbuffer(model, buffer);
  alglib::real_1d_array x;
  alglib::real_1d_array y;
  x.setlength(3);
  y.setlength(3);
  std::size_t i = 0;
  for (auto _ : state) {
    const Eigen::Vector3d& p_m = batchPoints()[i++ % kBatch];
    for (int axis = 0; axis < 3; ++axis) x[axis] = p_m[axis];
    alglib::rbftscalcbuf(model, buffer, x, y);
    benchmark::DoNotOptimize(y[0]);
  }
}

void evaluateVtk(benchmark::State& state) {
  const vtkSmartPointer<vtkThinPlateSplineTransform>& model = fittedOnce(state.range(0), fitVtk);
  std::size_t i = 0;
  for (auto _ : state) {
    double out_m[3];
    model->InternalTransformPoint(batchPoints()[i++ % kBatch].data(), out_m);
    benchmark::DoNotOptimize(out_m[0]);
  }
}

void evaluatePlain(benchmark::State& state) {
  const PlainMultiquadric& model = fittedOnce(state.range(0), plainTerms);
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(model.value(batchPoints()[i++ % kBatch]));
}

void batchOurs(benchmark::State& state) {
  const PositionModel& model = *fittedOnce(state.range(0), fitFieldtrue);
  std::vector<Eigen::Vector3d> corrected_m(kBatch);
  for (auto _ : state) {
    model.correct(batchPoints(), corrected_m);
    benchmark::DoNotOptimize(corrected_m.data());
  }
}

void batchAlglib(benchmark::State& state) {
  const alglib::rbfmodel& model = fittedOnce(state.range(0), fitAlglib);
  alglib::rbfcalcbuffer buffer;
  alglib::rbfcreatecalcbuffer(model, buffer);
  alglib::real_1d_array x;
  alglib::real_1d_array y;
  x.setlength(3);
  y.setlength(3);
  for (auto _ : state) {
    for (const Eigen::Vector3d& p_m : batchPoints()) {
      for (int axis = 0; axis < 3; ++axis) x[axis] = p_m[axis];
      alglib::rbftscalcbuf(model, buffer, x, y);
      benchmark::DoNotOptimize(y[0]);
    }
  }
}

void batchVtk(benchmark::State& state) {
  const vtkSmartPointer<vtkThinPlateSplineTransform>& model = fittedOnce(state.range(0), fitVtk);
  for (auto _ : state) {
    for (const Eigen::Vector3d& p_m : batchPoints()) {
      double out_m[3];
      model->InternalTransformPoint(p_m.data(), out_m);
      benchmark::DoNotOptimize(out_m[0]);
    }
  }
}

void batchPlain(benchmark::State& state) {
  const PlainMultiquadric& model = fittedOnce(state.range(0), plainTerms);
  for (auto _ : state)
    for (const Eigen::Vector3d& p_m : batchPoints()) benchmark::DoNotOptimize(model.value(p_m));
}

// The argument is places along an axis: 8 -> 512, 13 -> 2197. VTK's fit takes minutes beyond 512.
BENCHMARK(fitOurs)->Name("fit/fieldtrue")->Arg(8)->Arg(13)->Unit(benchmark::kMillisecond);
BENCHMARK(fitTheAlglib)->Name("fit/alglib")->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(fitTheAlglib)->Name("fit/alglib")->Arg(13)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(fitTheVtk)->Name("fit/vtk")->Arg(8)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK(evaluateOurs)->Name("one point/fieldtrue")->Arg(8)->Arg(13);
BENCHMARK(evaluateAlglib)->Name("one point/alglib")->Arg(8)->Arg(13);
BENCHMARK(evaluateVtk)->Name("one point/vtk")->Arg(8);
BENCHMARK(evaluatePlain)->Name("one point/plain loop")->Arg(8)->Arg(13);
BENCHMARK(batchOurs)->Name("100,000 points/fieldtrue")->Arg(8)->Arg(13)->Unit(benchmark::kMillisecond);
BENCHMARK(batchAlglib)->Name("100,000 points/alglib")->Arg(8)->Arg(13)->Unit(benchmark::kMillisecond);
BENCHMARK(batchVtk)->Name("100,000 points/vtk")->Arg(8)->Unit(benchmark::kMillisecond);
BENCHMARK(batchPlain)->Name("100,000 points/plain loop")->Arg(8)->Arg(13)->Unit(benchmark::kMillisecond);

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
      const Key key{name.substr(0, first), std::stoi(name.substr(second + 1, third - second - 1))};
      const double time_s = run.cpu_accumulated_time / static_cast<double>(run.iterations);
      double& shortest_s = times_s_[key].try_emplace(name.substr(first + 1, second - first - 1), time_s).first->second;
      shortest_s = std::min(shortest_s, time_s);
    }
    ConsoleReporter::ReportRuns(runs);
  }

  void printRatios() const {
    std::printf("\nHow many times as long the peers take (CPU time, one thread)\n");
    for (const auto& [key, times_s] : times_s_) {
      const auto ours = times_s.find("fieldtrue");
      if (ours == times_s.end()) continue;
      const int n_places = key.second * key.second * key.second;
      std::printf("%-16s n=%-5d fieldtrue %.3g us", key.first.c_str(), n_places, 1e6 * ours->second);
      for (const auto& [who, time_s] : times_s)
        if (who != "fieldtrue") std::printf("   %s %.1fx", who.c_str(), time_s / ours->second);
      std::printf("\n");
    }
  }

 private:
  using Key = std::pair<std::string, int>;
  std::map<Key, std::map<std::string, double>> times_s_;
};

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  RememberingReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.printRatios();
  return 0;
}
