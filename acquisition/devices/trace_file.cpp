#include "acquisition/devices/trace_file.h"

#include <charconv>
#include <cmath>
#include <map>

#include "calib/archives/zip_archive.h"
#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"
#include "calib/tables/table_json.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::string_view kChunksHead = "t_s,direction,offset,length";
constexpr std::uint64_t kMostTraceBytes = std::uint64_t{1} << 30U;
constexpr std::string_view kTraceSchema = "fieldtrue.trace/";
constexpr int kNewestTrace = 1;

nlohmann::json toJson(const TraceStream& stream) {
  return {{"first_chunk", stream.first_chunk}, {"end_chunk", stream.end_chunk},
          {"settings", stream.settings},       {"rate_hz", stream.rate_hz},
          {"summary", stream.summary},         {"metadata", fieldtrue::toJson(stream.metadata)}};
}

nlohmann::json settingsOf(const Trace& trace) {
  nlohmann::json streams = nlohmann::json::array();
  for (const TraceStream& stream : trace.streams) streams.push_back(toJson(stream));
  return {{"schema", std::string(kTraceSchema) + std::to_string(kNewestTrace)},
          {"software", trace.software},
          {"recorded", trace.recorded},
          {"tracker", trace.tracker},
          {"device", trace.device},
          {"clock_speed", trace.clock_speed},
          {"bytes_dropped", trace.bytes_dropped},
          {"streams", streams}};
}

std::string chunksOf(const Trace& trace) {
  std::string text = std::string(kChunksHead) + "\n";
  for (const TraceChunk& chunk : trace.chunks) {
    text += formatNumber(chunk.t_s) + (chunk.sent ? ",out," : ",in,") + std::to_string(chunk.offset) + "," +
            std::to_string(chunk.length) + "\n";
  }
  return text;
}

TraceStream streamFrom(const JsonReader& json, std::size_t chunks) {
  constexpr Bounds kRates_hz{1e-3, 1e5};
  TraceStream stream;
  const auto chunkAt = [&json, chunks](const char* key, std::size_t least) {
    return static_cast<std::size_t>(
        json[key].integer(static_cast<std::int64_t>(least), static_cast<std::int64_t>(chunks)));
  };
  stream.first_chunk = chunkAt("first_chunk", 0);
  stream.end_chunk = json.has("end_chunk") ? chunkAt("end_chunk", stream.first_chunk) : chunks;
  stream.settings = json["settings"].namedTexts();
  stream.rate_hz = json["rate_hz"].number(kRates_hz, "Hz");
  json.text("summary", stream.summary);
  if (const auto metadata = json.find("metadata")) stream.metadata = metadataFrom(*metadata);
  return stream;
}

void readSettings(const JsonReader& json, Trace& trace) {
  constexpr Bounds kSpeeds{1e-3, 1e4};
  // What has none is some other program's.
  if (!json.schema(kTraceSchema, kNewestTrace, "a trace")) json["schema"].text();
  trace.tracker = json["tracker"].text();
  json.text("device", trace.device);
  json.text("software", trace.software);
  json.text("recorded", trace.recorded);
  json.number("clock_speed", trace.clock_speed, kSpeeds, "");
  if (const auto dropped = json.find("bytes_dropped")) {
    trace.bytes_dropped = static_cast<std::uint64_t>(dropped->integer(0, std::int64_t{1} << 53U));
  }
  trace.streams = json["streams"].list([&trace](const JsonReader& s) { return streamFrom(s, trace.chunks.size()); });
}

template <class Number>
bool takeField(std::string_view& line, Number& number, bool is_last) {
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
  if (error != std::errc()) return false;
  line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  if (is_last) return line.empty();
  if (!line.starts_with(',')) return false;
  line.remove_prefix(1);
  return true;
}

std::optional<TraceChunk> chunkFrom(std::string_view line) {
  TraceChunk chunk;
  if (!takeField(line, chunk.t_s, false) || !std::isfinite(chunk.t_s)) return std::nullopt;
  chunk.sent = line.starts_with("out,");
  if (!chunk.sent && !line.starts_with("in,")) return std::nullopt;
  line.remove_prefix(chunk.sent ? 4 : 3);
  if (!takeField(line, chunk.offset, false) || !takeField(line, chunk.length, true)) return std::nullopt;
  return chunk;
}

/// @error kBadInput: what is wrong, without the file's name
Result<std::vector<TraceChunk>> chunksFrom(std::string_view text, std::size_t bytes) {
  if (text.empty()) return fail(ErrorCode::kBadInput, "chunks.csv is empty");
  std::vector<TraceChunk> chunks;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string where = "line " + std::to_string(number) + " of chunks.csv ";
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return fail(ErrorCode::kBadInput, where + "is cut off");
    std::string_view line = text.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    text.remove_prefix(end + 1);
    if (number == 1) {
      if (line != kChunksHead) return fail(ErrorCode::kBadInput, where + "must be " + std::string(kChunksHead));
      continue;
    }
    const auto chunk = chunkFrom(line);
    if (!chunk) return fail(ErrorCode::kBadInput, where + "must be a time, in or out, an offset and a length");
    if (chunk->offset > bytes || chunk->length > bytes - chunk->offset) {
      return fail(ErrorCode::kBadInput, where + "points beyond the " + std::to_string(bytes) + " bytes of bytes.bin");
    }
    if (!chunks.empty() && chunk->t_s < chunks.back().t_s)
      return fail(ErrorCode::kBadInput, where + "steps back in time");
    chunks.push_back(*chunk);
  }
  return chunks;
}

}  // namespace

Result<void> writeTrace(const std::filesystem::path& path, const Trace& trace) {
  // What a tracker says of itself may hold any byte.
  const std::string settings = settingsOf(trace).dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  return writeZip(
      path, {{"settings.json", settings + "\n", false}, {"chunks.csv", chunksOf(trace)}, {"bytes.bin", trace.bytes}});
}

Result<Trace> readTrace(const std::filesystem::path& path) {
  const auto is_no_trace = [&path](const std::string& why) {
    return fail(ErrorCode::kBadInput, path.string() + " is no trace that can be played: " + why);
  };
  auto read = readZip(path, kMostTraceBytes);
  if (!read) {
    const bool is_damaged = read.error().code == ErrorCode::kBadInput;
    return fail(read.error().code,
                read.error().message + (is_damaged ? "; a whole trace, as acquire --trace writes it, is needed" : ""));
  }
  std::map<std::string, std::string>& members = *read;
  for (const char* name : {"settings.json", "chunks.csv", "bytes.bin"}) {
    if (!members.contains(name)) {
      return is_no_trace(std::string(name) + " is missing in it; settings.json, chunks.csv and bytes.bin are needed");
    }
  }
  Trace trace;
  trace.bytes = std::move(members["bytes.bin"]);
  auto chunks = chunksFrom(members["chunks.csv"], trace.bytes.size());
  if (!chunks) return is_no_trace(chunks.error().message);
  trace.chunks = *std::move(chunks);
  const std::string name = path.string() + ", settings.json";
  FT_TRY(const nlohmann::json document, parseJson(members["settings.json"], name));
  return readJson<Trace>(document, name, [&trace](const JsonReader& json) {
    readSettings(json, trace);
    return std::move(trace);
  });
}

}  // namespace fieldtrue::acquisition
