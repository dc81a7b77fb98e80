#include <benchmark/benchmark.h>

#include <random>
#include <string>

#include "acquisition/protocols/flock.h"

namespace {

using namespace fieldtrue;

constexpr std::size_t kRecords = 20000;
/// What a read of a busy line returns.
constexpr std::size_t kChunk = 4096;

acquisition::FlockLayout layoutOf(const char* mode) {
  acquisition::FlockLayout layout;
  layout.mode = acquisition::findFlockMode(std::string_view(mode));
  layout.group = true;
  return layout;
}

std::string groupStream(const acquisition::FlockLayout& layout) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-0.7, 0.7);
  std::string stream;
  for (std::size_t i = 0; i < kRecords; ++i) {
    const Eigen::Vector3d turn_rad(coordinate(random), coordinate(random), coordinate(random));
    const Pose pose{{coordinate(random), coordinate(random), coordinate(random)}, rotationFromVector(turn_rad)};
    stream += acquisition::encodeFlockRecord(static_cast<int>(i % 4) + 1, pose, layout);
  }
  return stream;
}

void flockParser(benchmark::State& state, const char* mode) {
  acquisition::FlockStreamSettings settings;
  settings.layout = layoutOf(mode);
  settings.sensors = {{1, 0}, {2, 1}, {3, 2}, {4, 3}};
  const std::string stream = groupStream(settings.layout);
  std::vector<acquisition::Reading> readings;
  for (auto _ : state) {
    acquisition::FlockParser parser(settings);
    std::size_t read = 0;
    for (std::size_t at = 0; at < stream.size(); at += kChunk) {
      readings.clear();
      parser.add(std::string_view(stream).substr(at, kChunk), readings);
      read += readings.size();
    }
    if (read != kRecords) state.SkipWithError("records were lost");
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * stream.size()));
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kRecords));
}
BENCHMARK_CAPTURE(flockParser, position_quaternion, "position_quaternion");
BENCHMARK_CAPTURE(flockParser, position_angles, "position_angles");
BENCHMARK_CAPTURE(flockParser, position_matrix, "position_matrix");

}  // namespace
