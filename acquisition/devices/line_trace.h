#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/devices/stream_settings.h"
#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// Bytes that went over a line together.
struct TraceChunk {
  double t_s = 0.0;  ///< By the device's clock.
  bool sent = false;
  std::size_t offset = 0;  ///< Of its bytes among all.
  std::size_t length = 0;
};

/// A stream among the bytes: from one chunk to another, what the tracker sent is read by its parser.
struct TraceStream {
  std::size_t first_chunk = 0;
  std::size_t end_chunk = 0;  ///< One beyond its last.
  StreamSettings settings;
  double rate_hz = 0.0;    ///< Of each sensor.
  std::string summary;     ///< "Fastrak 2.41, station 1 at 120 Hz".
  TableMetadata metadata;  ///< What the device said of itself.
};

/// What went over a tracker's line, both ways.
struct Trace {
  std::string tracker;  ///< Id of its kind.
  std::string device;   ///< As a person wrote it.
  std::string software;
  std::string recorded;             ///< Date and time, UTC.
  double clock_speed = 1.0;         ///< The tracker's seconds per second; other than 1 only for an emulated tracker.
  std::uint64_t bytes_dropped = 0;  ///< Older than what is kept.
  std::string bytes;
  std::vector<TraceChunk> chunks;    ///< In the order of their times.
  std::vector<TraceStream> streams;  ///< In their order; empty where the tracker never got to stream.
};

/// The last bytes of a line, kept in memory.
class LineTrace {
 public:
  static constexpr std::size_t kMostBytes = 16u << 20;
  /// @param most_bytes of memory, what is noted beside each chunk included
  explicit LineTrace(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  void add(double t_s, bool sent, std::string_view bytes);
  /// The chunks that follow are a stream's. @param stream its chunks are not looked at
  void beginStream(TraceStream stream);
  /// The chunks that follow are no stream's.
  void endStream();
  /// All of it that is kept; a stream whose beginning is not begins with the first chunk.
  Trace content() const;

 private:
  struct Chunk {
    double t_s;
    bool sent;
    std::string bytes;
  };
  std::size_t most_bytes_;
  std::size_t kept_ = 0;
  std::size_t chunks_dropped_ = 0;
  std::uint64_t bytes_dropped_ = 0;
  std::deque<Chunk> chunks_;
  std::vector<TraceStream> streams_;  ///< Their chunks count from the beginning of the line.
  bool streaming_ = false;            ///< The last stream's end is still to come.
};

}  // namespace fieldtrue::acquisition
