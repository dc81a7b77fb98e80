#include <benchmark/benchmark.h>
#include <itkDisplacementFieldTransform.h>
#include <vtkGridTransform.h>
#include <vtkImageData.h>
#include <vtkNew.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/runtime/fieldtrue_runtime.hpp"
#include "tests/support/synthetic.h"

/// The runtime on 512 poses inside a calibrated room of 567 places: each method as it is and baked to 50 um, and VTK's
/// and ITK's displacement fields of the same node spacing. Those correct positions alone: bakedPositions is beside
/// them.
namespace {

using namespace fieldtrue;
using fieldtrue_runtime::Calibration;

constexpr std::size_t kPoses = 512;

CalibrationTable room(int orientations) {
  testing::SyntheticOptions options;
  options.counts = {9, 9, 7};
  options.pitch_m = {0.3, 0.3, 0.3};
  options.smooth_distortion_m = 0.05;
  options.orientation_error_rad = 0.05;
  options.orientations = orientations;
  testing::SyntheticNoise noise;
  noise.position_sd_m = 2e-4;
  return testing::syntheticTable(options, noise);
}

Calibration fitted(const std::string& position, const std::string& orientation) {
  static std::map<std::string, std::string> texts;
  std::string& text = texts[position + "+" + orientation];
  if (text.empty()) {
    const CalibrationTable table = room(position.find("pose") == std::string::npos ? 1 : 3);
    text = calibration::Corrector::fit(table.nodes, table.metadata,
                                       calibration::parseCorrectorChoice(position, orientation).value(),
                                       calibration::AlignMode::kRigid)
               .value()
               .toText();
  }
  return Calibration::fromMemory(text, position);
}

std::vector<fieldtrue_pose> poses() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(0.05, 0.95);
  std::vector<fieldtrue_pose> made(kPoses);
  for (fieldtrue_pose& pose : made)
    pose = {{0.3 + 2.4 * u(random), -0.4 + 2.4 * u(random), -0.3 + 1.8 * u(random)}, {0.8, 0.6, 0.0, 0.0}};
  return made;
}

void perPose(benchmark::State& state) {
  state.counters["ns_per_pose"] = benchmark::Counter(1e-9 * static_cast<double>(state.iterations()) * double(kPoses),
                                                     benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void runMany(benchmark::State& state, const Calibration& calibration) {
  const auto tracked = poses();
  std::vector<fieldtrue_pose> corrected(tracked.size());
  for (auto _ : state) {
    fieldtrue_correct_many(calibration.get(), FIELDTRUE_FIRST_SENSOR, tracked.data(), corrected.data(), tracked.size());
    benchmark::DoNotOptimize(corrected.data());
  }
  perPose(state);
}

void runOne(benchmark::State& state, const Calibration& calibration) {
  const auto tracked = poses();
  fieldtrue_pose corrected;
  for (auto _ : state)
    for (const fieldtrue_pose& pose : tracked) {
      fieldtrue_correct(calibration.get(), FIELDTRUE_FIRST_SENSOR, &pose, &corrected);
      benchmark::DoNotOptimize(corrected);
    }
  perPose(state);
}

void exactMany(benchmark::State& state, const std::string& position, const std::string& orientation) {
  runMany(state, fitted(position, orientation));
}
void bakedMany(benchmark::State& state, const std::string& position, const std::string& orientation) {
  runMany(state, fitted(position, orientation).baked(50.0, 0.02));
}
void bakedOne(benchmark::State& state, const std::string& position, const std::string& orientation) {
  runOne(state, fitted(position, orientation).baked(50.0, 0.02));
}

void bakedPositions(benchmark::State& state) {
  const Calibration calibration = fitted("gaussian_process", "none").baked(50.0, 0.02);
  std::vector<double> tracked_m;
  for (const fieldtrue_pose& pose : poses()) tracked_m.insert(tracked_m.end(), pose.position_m, pose.position_m + 3);
  std::vector<double> corrected_m(tracked_m.size());
  for (auto _ : state) {
    fieldtrue_correct_positions(calibration.get(), tracked_m.data(), corrected_m.data(), kPoses);
    benchmark::DoNotOptimize(corrected_m.data());
  }
  perPose(state);
}

/// Nodes of a lattice over the room, as far apart as those that 50 um needs.
constexpr int kNodes[3] = {28, 28, 22};
constexpr double kPitch_m = 0.1;
const double kOrigin_m[3] = {0.15, -0.55, -0.45};

Eigen::Vector3d bend(const Eigen::Vector3d& p) {
  return {0.05 * std::sin(p.y()), 0.05 * std::cos(p.x()), 0.05 * std::sin(p.z() + p.x())};
}

void vtkGrid(benchmark::State& state, int mode) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(kNodes[0], kNodes[1], kNodes[2]);
  image->SetOrigin(kOrigin_m[0], kOrigin_m[1], kOrigin_m[2]);
  image->SetSpacing(kPitch_m, kPitch_m, kPitch_m);
  image->AllocateScalars(VTK_FLOAT, 3);
  for (int k = 0; k < kNodes[2]; ++k)
    for (int j = 0; j < kNodes[1]; ++j)
      for (int i = 0; i < kNodes[0]; ++i) {
        const Eigen::Vector3d d = bend(Eigen::Vector3d(i, j, k) * kPitch_m);
        for (int axis = 0; axis < 3; ++axis) image->SetScalarComponentFromDouble(i, j, k, axis, d[axis]);
      }
  vtkNew<vtkGridTransform> transform;
  transform->SetDisplacementGridData(image);
  transform->SetInterpolationMode(mode);
  transform->Update();
  const auto tracked = poses();
  double out[3];
  for (auto _ : state)
    for (const fieldtrue_pose& pose : tracked) {
      transform->InternalTransformPoint(pose.position_m, out);
      benchmark::DoNotOptimize(out);
    }
  perPose(state);
}

void itkField(benchmark::State& state) {
  using Transform = itk::DisplacementFieldTransform<double, 3>;
  const auto field = Transform::DisplacementFieldType::New();
  Transform::DisplacementFieldType::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<unsigned>(kNodes[axis]);
  field->SetRegions(size);
  field->SetOrigin(kOrigin_m);
  field->SetSpacing(itk::Vector<double, 3>(kPitch_m));
  field->Allocate();
  for (unsigned k = 0; k < size[2]; ++k)
    for (unsigned j = 0; j < size[1]; ++j)
      for (unsigned i = 0; i < size[0]; ++i) {
        const Eigen::Vector3d d = bend(Eigen::Vector3d(i, j, k) * kPitch_m);
        itk::Vector<double, 3> value;
        for (unsigned axis = 0; axis < 3; ++axis) value[axis] = d[static_cast<int>(axis)];
        field->SetPixel({{long(i), long(j), long(k)}}, value);
      }
  const auto transform = Transform::New();
  transform->SetDisplacementField(field);
  const auto tracked = poses();
  for (auto _ : state)
    for (const fieldtrue_pose& pose : tracked) {
      const auto out = transform->TransformPoint(Transform::InputPointType(pose.position_m));
      benchmark::DoNotOptimize(out);
    }
  perPose(state);
}

}  // namespace

BENCHMARK_CAPTURE(vtkGrid, linear, VTK_GRID_LINEAR);
BENCHMARK_CAPTURE(vtkGrid, cubic, VTK_GRID_CUBIC);
BENCHMARK(itkField);
BENCHMARK(bakedPositions);
BENCHMARK_CAPTURE(bakedMany, gaussian_process, "gaussian_process", "none");
BENCHMARK_CAPTURE(bakedMany, rbf, "rbf", "none");
BENCHMARK_CAPTURE(bakedMany, polynomial, "polynomial:degree=3", "none");
BENCHMARK_CAPTURE(bakedMany, turning_too, "gaussian_process", "polynomial_quaternion");
BENCHMARK_CAPTURE(bakedOne, gaussian_process, "gaussian_process", "none");
BENCHMARK_CAPTURE(bakedOne, turning_too, "gaussian_process", "polynomial_quaternion");
BENCHMARK_CAPTURE(exactMany, polynomial, "polynomial:degree=3", "none");
BENCHMARK_CAPTURE(exactMany, gaussian_process, "gaussian_process", "none");
BENCHMARK_CAPTURE(exactMany, neural_network, "neural_network", "none");
BENCHMARK_CAPTURE(exactMany, poses, "gaussian_process:inputs=pose", "none");
BENCHMARK_CAPTURE(bakedMany, poses, "gaussian_process:inputs=pose", "none");
