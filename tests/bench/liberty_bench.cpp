#include <benchmark/benchmark.h>

#include <random>
#include <string>

#include "acquisition/protocols/liberty.h"

namespace {

using namespace fieldtrue;

constexpr std::size_t kFrames = 20000;
/// What a read of a busy line returns.
constexpr std::size_t kReadAtOnce = 4096;

const std::vector<int> kList = {8, 2, 7, 1};

std::string libertyStream() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-0.7, 0.7);
  std::string stream;
  for (std::size_t i = 0; i < kFrames; ++i) {
    acquisition::LibertyRecord record;
    static_cast<acquisition::PoseNumbers&>(record) = acquisition::numbersOfPose(
        {{coordinate(random), coordinate(random), coordinate(random)},
         rotationFromVector(Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random)))});
    record.time_ms = static_cast<std::uint32_t>(i * 1000 / 240);
    stream += encode(acquisition::LibertyFrame{"LY", 1, 'C', ' ', encodeLibertyPayload(record, kList, 0.01)});
  }
  return stream;
}

void libertyParser(benchmark::State& state) {
  const std::string stream = libertyStream();
  std::vector<acquisition::Reading> readings;
  readings.reserve(kFrames);
  for (auto _ : state) {
    auto parser = *acquisition::LibertyParser::make({"LY", {1}, kList, 0.01});
    readings.clear();
    for (std::size_t at = 0; at < stream.size(); at += kReadAtOnce) {
      parser.add(std::string_view(stream).substr(at, kReadAtOnce), readings);
    }
    if (readings.size() != kFrames) state.SkipWithError("records were lost");
    benchmark::DoNotOptimize(readings.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * stream.size()));
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kFrames));
}
BENCHMARK(libertyParser);

}  // namespace
