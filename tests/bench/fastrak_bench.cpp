#include <benchmark/benchmark.h>

#include <cstring>
#include <random>
#include <string>

#include "acquisition/protocols/fastrak.h"

namespace {

using namespace fieldtrue;

constexpr std::size_t kRecords = 20000;
/// What a read of a busy line returns.
constexpr std::size_t kChunk = 4096;

const std::vector<int> kItems = {2, 11, 16, 1};

std::string binaryStream() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> coordinate(-0.7, 0.7);
  const auto layout = *acquisition::fastrakLayout(kItems, acquisition::FastrakFormat::kBinary);
  std::string stream;
  for (std::size_t i = 0; i < kRecords; ++i) {
    const Eigen::Vector3d turn_rad(coordinate(random), coordinate(random), coordinate(random));
    const Pose pose{{coordinate(random), coordinate(random), coordinate(random)}, rotationFromVector(turn_rad)};
    stream += acquisition::encodeRecord(acquisition::recordOfPose(1, ' ', pose), layout,
                                        acquisition::FastrakUnit::kCentimetre);
  }
  return stream;
}

void fastrakParser(benchmark::State& state) {
  const std::string stream = binaryStream();
  acquisition::FastrakStreamSettings settings;
  settings.items[0] = kItems;
  std::vector<acquisition::FastrakRecord> records;
  records.reserve(kRecords);
  for (auto _ : state) {
    auto parser = *acquisition::FastrakParser::make(settings);
    records.clear();
    for (std::size_t at = 0; at < stream.size(); at += kChunk) {
      parser.add(std::string_view(stream).substr(at, kChunk), records);
    }
    if (records.size() != kRecords) state.SkipWithError("records were lost");
    benchmark::DoNotOptimize(records.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * stream.size()));
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kRecords));
}
BENCHMARK(fastrakParser);

void fastrakParserToSamples(benchmark::State& state) {
  const std::string stream = binaryStream();
  acquisition::FastrakStreamSettings settings;
  settings.items[0] = kItems;
  std::vector<acquisition::FastrakRecord> records;
  for (auto _ : state) {
    auto parser = *acquisition::FastrakParser::make(settings);
    double sum_m = 0.0;
    for (std::size_t at = 0; at < stream.size(); at += kChunk) {
      records.clear();
      parser.add(std::string_view(stream).substr(at, kChunk), records);
      for (const auto& record : records) sum_m += acquisition::toSample(record, 0.0).tracker_from_sensor.position_m.x();
    }
    benchmark::DoNotOptimize(sum_m);
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * stream.size()));
}
BENCHMARK(fastrakParserToSamples);

struct PlainRecord {
  char header[3];
  float values[7];
  char stylus;
};

/// The peer: knows the length, trusts the framing, looks at the fixed bytes and copies.
void plainCopyAndCheck(benchmark::State& state) {
  const std::string stream = binaryStream();
  constexpr std::size_t kLength = 35;
  std::vector<PlainRecord> records;
  records.reserve(kRecords);
  for (auto _ : state) {
    records.clear();
    for (std::size_t at = 0; at + kLength <= stream.size(); at += kLength) {
      const char* bytes = stream.data() + at;
      if (bytes[0] != '0' || bytes[1] != '1' || std::memcmp(bytes + 33, "\r\n", 2) != 0) continue;
      PlainRecord& record = records.emplace_back();
      std::memcpy(record.header, bytes, 3);
      std::memcpy(record.values, bytes + 3, 28);
      record.stylus = bytes[32];
    }
    if (records.size() != kRecords) state.SkipWithError("records were lost");
    benchmark::DoNotOptimize(records.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * stream.size()));
}
BENCHMARK(plainCopyAndCheck);

}  // namespace
