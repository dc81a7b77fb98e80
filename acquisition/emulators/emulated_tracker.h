#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace fieldtrue::acquisition {

/// Something an emulated tracker sends in one write.
struct EmulatedOutput {
  std::string bytes;
  bool record = false;  ///< A data record; otherwise an answer to a command.
};

/// The device side of a tracker's protocol: bytes and the time in, bytes out; no clock and no line of its own.
class EmulatedTracker {
 public:
  virtual ~EmulatedTracker() = default;
  /// Takes what the host sent. @param time_s the tracker's clock, never less than before
  virtual void receive(std::string_view bytes, double time_s, std::vector<EmulatedOutput>& out) = 0;
  /// Sends what is due by now, in order, at most that many cycles; what is left over is sent by the next call.
  /// @return true when more is due already
  virtual bool tick(double time_s, std::vector<EmulatedOutput>& out, int most_cycles = 256) = 0;
  /// A host has connected, where the line tells so.
  virtual void hostCame(double /*time_s*/) {}
  /// Whether records are sent without being asked for.
  virtual bool streaming() const = 0;
};

}  // namespace fieldtrue::acquisition
