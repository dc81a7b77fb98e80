#include <benchmark/benchmark.h>
#include <ceres/ceres.h>
#include <sys/resource.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "calib/gap/diagnosis.h"
#include "calib/gap/first_look.h"
#include "calib/identify/field_comparison.h"
#include "calib/identify/joint_fit.h"
#include "calib/identify/ranking.h"
#include "calib/identify/rows.h"
#include "calib/simulation/simulator.h"
#include "tests/bench/two_threads.h"
#include "tests/support/bent_room.h"

/// What a diagnosis costs by the number of places and by room, and what changed since an earlier recording, on two
/// threads; and the density of two recordings under one field, beside the same density with its covariance written out
/// whole, as any library of Gaussian processes with correlated outputs takes it.
namespace {

using namespace fieldtrue;

/// The volume of the six rooms in n x n x m places, in random order.
std::vector<PlannedPlace> planOf(int n, int m, unsigned seed) {
  std::vector<PlannedPlace> plan;
  for (int k = 0; k < n * n * m; ++k) {
    PlannedPlace place;
    place.node = k;
    place.index = {k % n, k / n % n, k / (n * n)};
    const Eigen::Vector3d step((*place.index)[0], (*place.index)[1], (*place.index)[2]);
    place.reference_from_sensor.position_m =
        step.cwiseProduct(Eigen::Vector3d(2.4384 / (n - 1), 2.4384 / (n - 1), 1.8288 / (m - 1)));
    plan.push_back(place);
  }
  std::mt19937 draw(seed);
  std::shuffle(plan.begin(), plan.end(), draw);
  return plan;
}

CalibrationTable recorded(const char* room, int n, int m, std::uint64_t seed) {
  const auto scene = simulation::readScene(std::string(FIELDTRUE_RESOURCES) + "/rooms/" + room + ".scene.json");
  simulation::SimulationOptions options;
  options.seed = seed;
  options.samples_per_node = 20;
  return simulation::simulate(scene.value(), planOf(n, m, 1), options).value().table;
}

/// Largest memory the process has held so far [MiB].
double peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

void diagnoseTable(benchmark::State& state, const CalibrationTable& table) {
  for ([[maybe_unused]] auto _ : state) {
    auto report = gap::diagnose(table, nullptr, nullptr, {}, twoThreads());
    benchmark::DoNotOptimize(report);
  }
  state.SetLabel(std::to_string(table.nodes.size()) + " places");
  state.counters["peak_MiB"] = peak_mib();
}

void diagnoseRoom(benchmark::State& state, const char* room) {
  const auto n = static_cast<int>(state.range(0));
  diagnoseTable(state, recorded(room, n, static_cast<int>(state.range(1)), 1));
}
BENCHMARK_CAPTURE(diagnoseRoom, clean, "clean")->Args({5, 4})->Args({9, 7})->Unit(benchmark::kSecond)->UseRealTime();
BENCHMARK_CAPTURE(diagnoseRoom, steel_floor, "steel_floor")
    ->Args({5, 4})
    ->Args({9, 7})
    ->Unit(benchmark::kSecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(diagnoseRoom, steel_bar, "steel_bar")->Args({9, 7})->Unit(benchmark::kSecond)->UseRealTime();
BENCHMARK_CAPTURE(diagnoseRoom, mixed, "mixed")->Args({5, 4})->Args({9, 7})->Unit(benchmark::kSecond)->UseRealTime();

/// A room bent as no physics would bend it.
void diagnoseNameless(benchmark::State& state) {
  const auto n = static_cast<int>(state.range(0));
  diagnoseTable(state, testing::bentRoom({n, n, static_cast<int>(state.range(1))}));
}
BENCHMARK(diagnoseNameless)->Args({5, 4})->Args({9, 7})->Unit(benchmark::kSecond)->UseRealTime();

/// What some of the places say while all are looked at.
void firstLook(benchmark::State& state, const char* room) {
  diagnoseTable(state, gap::firstLook(recorded(room, 9, 7, 1)).value());
}
BENCHMARK_CAPTURE(firstLook, steel_bar, "steel_bar")->Unit(benchmark::kSecond)->UseRealTime();
BENCHMARK_CAPTURE(firstLook, mixed, "mixed")->Unit(benchmark::kSecond)->UseRealTime();

// 4,913 places.
BENCHMARK_CAPTURE(diagnoseRoom, steel_floor_5000, "steel_floor")
    ->Args({17, 17})
    ->Unit(benchmark::kSecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(diagnoseRoom, steel_bar_5000, "steel_bar")->Args({17, 17})->Unit(benchmark::kSecond)->UseRealTime();
BENCHMARK_CAPTURE(diagnoseRoom, mixed_5000, "mixed")->Args({17, 17})->Unit(benchmark::kSecond)->UseRealTime();

/// A steel floor found in a recording, its parameters then 3 % off: what the joint refinement starts from.
struct FloorOff {
  CalibrationTable table = recorded("steel_floor", 5, 4, 1);
  identify::GapRows rows = identify::makeGapRows(table.nodes, table.metadata).value();
  identify::GapSearch search{rows, {}};
  identify::GapModel start;

  FloorOff() {
    start = identify::rankEffects(search, search.none().model, {}).front().model;
    for (identify::GapTerm& term : start.terms) {
      term.linear *= 0.97;
      term.searched *= 0.97;
    }
  }
};

const FloorOff& floorOff() {
  static const FloorOff once;
  return once;
}

void jointFit(benchmark::State& state) {
  const FloorOff& off = floorOff();
  identify::RefinedModel refined;
  for ([[maybe_unused]] auto _ : state)
    refined = identify::refineJointly(off.search.physics(), off.start, off.search.whitening(), {});
  state.counters["cost"] = refined.cost;
}
BENCHMARK(jointFit)->Unit(benchmark::kMillisecond);

/// The same rows and derivatives, in steps from the start, for any solver of least squares; no law with tails, no
/// bounds and no tolerance of the alignment, which the joint fit has besides.
class StepsFromStart final : public ceres::CostFunction {
 public:
  explicit StepsFromStart(const FloorOff& off) : off_(off), block_(off.rows.rows.size(), 0) {
    const identify::Linearized at = linearizedAt(off.start);
    center_m_ = identify::alignmentCenter_m(at.settings());
    n_alignment_ = at.nAlignment();
    set_num_residuals(static_cast<int>(at.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(at.nuisance().cols()));
  }

  identify::GapModel moved(const double* steps) const {
    identify::GapModel model = off_.start;
    const Eigen::Map<const Eigen::VectorXd> step(steps, parameter_block_sizes()[0]);
    identify::applyAlignmentStep(step.head(n_alignment_), center_m_, off_.rows, model.alignment);
    Eigen::Index at = n_alignment_;
    for (identify::GapTerm& term : model.terms) {
      for (Eigen::VectorXd* part : {&term.linear, &term.searched}) {
        *part += step.segment(at, part->size());
        at += part->size();
      }
    }
    return model;
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const identify::GapModel model = moved(parameters[0]);
    if (jacobians == nullptr) {
      Eigen::Index at = 0;
      for (const identify::Vector6d& r :
           identify::whitenedResiduals(off_.search.physics(), model, off_.search.whitening())) {
        Eigen::Map<identify::Vector6d>(residuals + at) = r;
        at += 6;
      }
      return true;
    }
    const identify::Linearized now = linearizedAt(model);
    Eigen::Map<Eigen::VectorXd>(residuals, now.size()) = now.residual();
    if (jacobians[0] != nullptr)
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[0], now.size(), now.nuisance().cols()) = -now.nuisance();
    return true;
  }

 private:
  identify::Linearized linearizedAt(const identify::GapModel& model) const {
    return {off_.search.physics(), model, off_.search.whitening(), block_};
  }

  const FloorOff& off_;
  std::vector<int> block_;
  Eigen::Vector3d center_m_;
  Eigen::Index n_alignment_ = 0;
};

void jointFitByCeres(benchmark::State& state) {
  const FloorOff& off = floorOff();
  double cost = 0.0;
  for ([[maybe_unused]] auto _ : state) {
    auto* function = new StepsFromStart(off);  // The problem's, from here on.
    std::vector<double> steps(static_cast<std::size_t>(function->parameter_block_sizes()[0]), 0.0);
    ceres::Problem problem;
    problem.AddResidualBlock(function, nullptr, steps.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = 30;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    cost = 2.0 * summary.final_cost;
  }
  state.counters["sum_of_squares"] = cost;
}
BENCHMARK(jointFitByCeres)->Unit(benchmark::kMillisecond);

void changeSinceEarlier(benchmark::State& state) {
  const auto n = static_cast<int>(state.range(0));
  const auto m = static_cast<int>(state.range(1));
  gap::DiagnosisOptions options;
  options.against = std::make_shared<CalibrationTable>(recorded("steel_floor", n, m, 1));
  const CalibrationTable table = recorded("steel_floor", n, m, 2);
  for ([[maybe_unused]] auto _ : state) {
    auto report = gap::diagnose(table, nullptr, nullptr, options, twoThreads());
    benchmark::DoNotOptimize(report);
  }
}
BENCHMARK(changeSinceEarlier)->Args({5, 4})->Args({9, 7})->Unit(benchmark::kSecond)->UseRealTime();

/// Two recordings of n readings each, three shifts a recording free.
identify::FieldReadings twoRecordings(Eigen::Index n) {
  std::mt19937 draw(1);
  std::uniform_real_distribution<double> place(-0.6, 0.6);
  identify::FieldReadings readings;
  readings.values = 0.01 * Eigen::MatrixX3d::Random(2 * n, 3);
  readings.variances = Eigen::VectorXd::Constant(2 * n, 1e-6);
  readings.rig_variances = Eigen::VectorXd::Zero(2 * n);
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    readings.points.push_back({{place(draw), place(draw), place(draw)}, Eigen::Quaterniond::Identity(), 0.0});
    readings.places.push_back(static_cast<int>(i));
    readings.is_later.push_back(i < n ? 0 : 1);
  }
  readings.sees_change = readings.is_later;
  for (int column = 0; column < 6; ++column) {
    Eigen::MatrixX3d shift = Eigen::MatrixX3d::Zero(2 * n, 3);
    shift.col(column % 3).segment(column < 3 ? 0 : n, n).setOnes();
    readings.free.push_back(shift);
  }
  return readings;
}

const identify::SharedLaw kLaw{{.length_m = 0.7, .by_place = 0.02}, 0.0, {1.0, 1.0}};

void densityOfTwo(benchmark::State& state) {
  const identify::FieldReadings readings = twoRecordings(state.range(0));
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(identify::SharedField(readings, kLaw).logEvidence());
}
BENCHMARK(densityOfTwo)->Arg(50)->Arg(200)->Unit(benchmark::kMillisecond);

void densityWrittenOut(benchmark::State& state) {
  const identify::FieldReadings readings = twoRecordings(state.range(0));
  const auto n = static_cast<Eigen::Index>(readings.size());
  for ([[maybe_unused]] auto _ : state) {
    Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    Eigen::VectorXd y(3 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      y.segment<3>(3 * i) = readings.values.row(i).transpose();
      for (Eigen::Index j = 0; j <= i; ++j) {
        const auto a = static_cast<std::size_t>(i);
        const auto b = static_cast<std::size_t>(j);
        double c = identify::covariance(kLaw.field, readings.points[a], readings.points[b]);
        if (i == j) c += 1e-6;
        if (readings.is_later[a] == readings.is_later[b]) c += 0.01;
        C.block<3, 3>(3 * i, 3 * j) = c * Eigen::Matrix3d::Identity();
      }
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(C);
    const double log_determinant = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
    benchmark::DoNotOptimize(-0.5 * (y.dot(factor.solve(y)) + log_determinant +
                                     static_cast<double>(3 * n) * std::log(2.0 * std::numbers::pi)));
  }
}
BENCHMARK(densityWrittenOut)->Arg(50)->Arg(200)->Unit(benchmark::kMillisecond);

}  // namespace
