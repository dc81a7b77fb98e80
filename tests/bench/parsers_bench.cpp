// Bytes of every tracker to readings, in pieces as a busy line gives them. The peer of all is the fastest line there
// is: an NDI at 1,228,739 baud brings 123 kB/s, and `of 123 kB/s` says how many of them one thread reads. A Fastrak's
// records are also copied by a loop that trusts them, in fastrak_bench.
#include <benchmark/benchmark.h>

#include <random>
#include <string>

#include "acquisition/protocols/flock.h"
#include "acquisition/protocols/isotrak.h"
#include "acquisition/protocols/liberty.h"
#include "acquisition/protocols/ndi.h"
#include "acquisition/protocols/openigtlink_parser.h"

namespace {

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

constexpr std::size_t kPoses = 20000;
/// What a read of a busy line returns.
constexpr std::size_t kReadAtOnce = 4096;
constexpr double kFastestLine_bytes_per_s = 123e3;

std::vector<Pose> somePoses() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-0.7, 0.7);
  const auto vector = [&] {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    return Eigen::Vector3d(x, y, z);
  };
  std::vector<Pose> poses(kPoses);
  for (Pose& pose : poses) pose = {vector(), rotationFromVector(vector())};
  return poses;
}

/// Feeds the stream to a new parser each time; every pose must come out.
template <class Out, class MakeParser>
void read(benchmark::State& state, const std::string& stream, std::size_t n_expected, MakeParser make) {
  std::vector<Out> out;
  for (auto _ : state) {
    auto parser = make();
    std::size_t n_read = 0;
    for (std::size_t at = 0; at < stream.size(); at += kReadAtOnce) {
      out.clear();
      parser.add(std::string_view(stream).substr(at, kReadAtOnce), out);
      n_read += out.size();
    }
    if (n_read != n_expected) state.SkipWithError("readings were lost");
    benchmark::DoNotOptimize(out.data());
  }
  const auto n_bytes = static_cast<double>(state.iterations()) * static_cast<double>(stream.size());
  state.SetBytesProcessed(static_cast<std::int64_t>(n_bytes));
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * n_expected));
  state.counters["of 123 kB/s"] = benchmark::Counter(n_bytes / kFastestLine_bytes_per_s, benchmark::Counter::kIsRate);
}

void isotrak(benchmark::State& state) {
  const std::vector<int> items = {2, 11};
  std::string stream;
  for (const Pose& pose : somePoses()) stream += encodeIsotrakRecord(recordOfPose(1, ' ', pose), items);
  read<Reading>(state, stream, kPoses, [&] {
    IsotrakParser::Settings settings;
    settings.stations = {1};
    settings.items = items;
    return *IsotrakParser::make(settings);
  });
}
BENCHMARK(isotrak);

void liberty(benchmark::State& state) {
  const std::vector<int> list = {8, 2, 7, 1};
  std::string stream;
  std::uint32_t frame = 0;
  for (const Pose& pose : somePoses()) {
    LibertyRecord record;
    static_cast<PoseNumbers&>(record) = numbersOfPose(pose);
    record.time_ms = frame++ * 1000 / 240;
    stream += encode(LibertyFrame{"LY", 1, 'C', ' ', encodeLibertyPayload(record, list, 0.01)});
  }
  read<Reading>(state, stream, kPoses, [&] { return *LibertyParser::make({"LY", {1}, list, 0.01}); });
}
BENCHMARK(liberty);

void flock(benchmark::State& state, const char* mode) {
  FlockStreamSettings settings;
  settings.layout.mode = findFlockMode(std::string_view(mode));
  settings.layout.group = true;
  settings.sensors = {{1, 0}, {2, 1}, {3, 2}, {4, 3}};
  std::string stream;
  int bird = 0;
  for (const Pose& pose : somePoses()) stream += encodeFlockRecord(bird++ % 4 + 1, pose, settings.layout);
  read<Reading>(state, stream, kPoses, [&] { return FlockParser(settings); });
}
BENCHMARK_CAPTURE(flock, position_quaternion, "position_quaternion");
BENCHMARK_CAPTURE(flock, position_angles, "position_angles");
BENCHMARK_CAPTURE(flock, position_matrix, "position_matrix");

void ndi(benchmark::State& state, bool binary) {
  NdiStreamSettings settings;
  settings.binary = binary;
  settings.sensors = {{10, 0}, {11, 1}, {12, 2}, {13, 3}};
  const std::vector<Pose> poses = somePoses();
  std::string stream;
  for (std::size_t i = 0; i < poses.size(); i += settings.sensors.size()) {
    NdiFrame frame;
    for (std::size_t k = 0; k < settings.sensors.size(); ++k) {
      const Pose& pose = poses[i + k];
      NdiTool tool;
      tool.handle = 10 + static_cast<int>(k);
      tool.state = NdiState::kValid;
      tool.quaternion_wxyz = {pose.orientation.w(), pose.orientation.x(), pose.orientation.y(), pose.orientation.z()};
      tool.position_mm = 500.0 * pose.position_m;
      tool.error_mm = 0.1;
      tool.port_status = 0x31;
      tool.frame = static_cast<std::uint32_t>(i + 1);
      frame.tools.push_back(tool);
    }
    stream += binary ? encodeNdiBx(frame) : encodeNdiReply(encodeNdiTx(frame));
  }
  read<Reading>(state, stream, kPoses, [&] { return NdiParser(settings); });
}
BENCHMARK_CAPTURE(ndi, BX, true);
BENCHMARK_CAPTURE(ndi, TX, false);

void openigtlink(benchmark::State& state) {
  std::string stream;
  for (const Pose& pose : somePoses()) stream += encodeIgtl("TRANSFORM", "Probe", 1, encodeTransformBody(pose));
  read<IgtlMessage>(state, stream, kPoses, [] { return IgtlParser(); });
}
BENCHMARK(openigtlink);

}  // namespace
