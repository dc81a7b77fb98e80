#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// What a tracker reported of one sensor. The sample's time is not filled in yet: the device gives it.
struct Reading {
  Sample sample;
  std::optional<double> unit_s;  ///< The tracker's own clock or counter at the reading [s]; counts up, may start anew.
};

/// Turns a tracker's bytes, cut anywhere, into readings. One row of the device registry makes each kind.
class StreamParser {
 public:
  virtual ~StreamParser() = default;
  /// Appends the readings completed by these bytes. Bytes that are no records are passed over.
  virtual void add(std::string_view bytes, std::vector<Reading>& out) = 0;
  /// Answers completed so far, with or without a reading in them; what a tracker that must be asked is asked again by.
  virtual std::uint64_t answers() const { return 0; }
};

/// What stands at the beginning of the bytes not yet used.
struct FrameMatch {
  enum class Kind { kFrame, kMore, kNone };
  Kind kind = Kind::kNone;
  std::size_t length = 0;  ///< Of the frame.

  static FrameMatch frame(std::size_t length) { return {Kind::kFrame, length}; }
  static FrameMatch more() { return {Kind::kMore, 0}; }
  static FrameMatch none() { return {Kind::kNone, 0}; }
};

/// Finds frames in a stream that is cut anywhere: what is no frame is dropped one byte at a time.
class FrameFinder {
 public:
  /// @param match FrameMatch(std::string_view rest): looks at the beginning, and takes the frame in when it is one
  template <class Match>
  void add(std::string_view bytes, Match match) {
    if (!buffer_.empty()) {
      buffer_.append(bytes);
      bytes = buffer_;
    }
    std::size_t used = 0;
    while (used < bytes.size()) {
      const FrameMatch found = match(bytes.substr(used));
      if (found.kind == FrameMatch::Kind::kMore) break;
      const bool is_frame = found.kind == FrameMatch::Kind::kFrame;
      dropped_bytes_ += is_frame ? 0 : 1;
      frames_ += is_frame ? 1 : 0;
      used += is_frame ? found.length : 1;
    }
    buffer_ = std::string(bytes.substr(used));
  }

  std::uint64_t frames() const { return frames_; }
  std::uint64_t dropped_bytes() const { return dropped_bytes_; }

 private:
  std::string buffer_;
  std::uint64_t frames_ = 0;
  std::uint64_t dropped_bytes_ = 0;
};

}  // namespace fieldtrue::acquisition
