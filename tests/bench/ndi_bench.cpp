#include <benchmark/benchmark.h>

#include <random>
#include <string>

#include "acquisition/protocols/ndi.h"

namespace {

using namespace fieldtrue;

constexpr std::uint32_t kFrames = 5000;
constexpr int kTools = 4;
/// What a read of a busy line returns.
constexpr std::size_t kChunk = 4096;

std::string replies(bool binary) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-0.7, 0.7);
  std::string stream;
  for (std::uint32_t number = 1; number <= kFrames; ++number) {
    acquisition::NdiFrame frame;
    for (int i = 0; i < kTools; ++i) {
      const auto turn = rotationFromVector({coordinate(random), coordinate(random), coordinate(random)});
      acquisition::NdiTool tool;
      tool.handle = 10 + i;
      tool.state = acquisition::NdiState::kValid;
      tool.quaternion_wxyz = {turn.w(), turn.x(), turn.y(), turn.z()};
      tool.position_mm = 500.0 * Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random));
      tool.error_mm = 0.1;
      tool.port_status = 0x31;
      tool.frame = number;
      frame.tools.push_back(tool);
    }
    stream += binary ? acquisition::encodeNdiBx(frame) : acquisition::encodeNdiReply(acquisition::encodeNdiTx(frame));
  }
  return stream;
}

void ndiParser(benchmark::State& state, bool binary) {
  acquisition::NdiStreamSettings settings;
  settings.binary = binary;
  settings.sensors = {{10, 0}, {11, 1}, {12, 2}, {13, 3}};
  const std::string stream = replies(binary);
  std::vector<acquisition::Reading> readings;
  for (auto _ : state) {
    acquisition::NdiParser parser(settings);
    std::size_t read = 0;
    for (std::size_t at = 0; at < stream.size(); at += kChunk) {
      readings.clear();
      parser.add(std::string_view(stream).substr(at, kChunk), readings);
      read += readings.size();
    }
    if (read != std::size_t{kFrames} * kTools) state.SkipWithError("readings were lost");
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * stream.size()));
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kFrames * kTools));
}
BENCHMARK_CAPTURE(ndiParser, BX, true);
BENCHMARK_CAPTURE(ndiParser, TX, false);

}  // namespace
