#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/protocols/openigtlink_parser.h"
#include "acquisition/protocols/stream_parser.h"

namespace fieldtrue::acquisition {

/// A sensor as a server sends it: an element of tracking data, or a device with messages of its own.
struct IgtlSource {
  std::string name;
  IgtlPoseType type = IgtlPoseType::kTrackingData;
  std::string message_device;  ///< Device name of the message that holds it.
};

/// What a server was heard to send in a while.
class IgtlSurvey {
 public:
  /// @param arrival_s when the bytes were read
  void add(std::string_view bytes, double arrival_s);
  bool hasPoses() const { return !heard_.empty(); }

  struct Choice {
    std::vector<IgtlSource> sources;   ///< In the order of their names, or of those wanted.
    std::vector<std::string> refused;  ///< Those that sent no rigid pose, with why.
    double rate_hz = 0.0;              ///< Of the fastest; 10 where too few came to tell.
    bool stamped = false;              ///< The server's stamps are a clock.
  };
  /// The sensors to record. One that is sent in several types of message is read from the first of IgtlPoseType.
  /// @param wanted their names in order, those not heard included; empty = all that sent a rigid pose
  Choice choose(const std::vector<std::string>& wanted) const;
  /// What came, for a message: "TRANSFORM of Probe, IMAGE (3)"; what the server said is wrong. Empty = nothing.
  std::string summary() const;

 private:
  struct Heard {
    IgtlSource source;
    int n = 0, n_poses = 0;
    std::string status;  ///< The last that was not blank.
    double first_s = 0.0, last_s = 0.0;
    std::uint64_t stamp = 0;
    Pose pose;
    bool is_clock = true;   ///< Every stamp so far was there and newer than the one before, or repeated its pose.
    bool advances = false;  ///< One was newer.
  };
  void take(const IgtlHeader& header, const IgtlReading& reading, double arrival_s);

  IgtlParser parser_;
  std::vector<Heard> heard_;
  std::optional<IgtlServerStatus> trouble_;
};

/// Messages of a server as readings. Sensor n is source n; in tracking data a source that is left out is missing, and a
/// message with the stamp and the pose of the one before is no new reading.
class IgtlReadings : public StreamParser {
 public:
  /// @param sources shared, so that numbers stay when the device is started again
  /// @param takes_newcomers whether a name whose poses are heard later becomes the next sensor
  IgtlReadings(std::shared_ptr<std::vector<IgtlSource>> sources, bool stamped, bool takes_newcomers);
  void add(std::string_view bytes, std::vector<Reading>& out) override;

 private:
  struct Last {
    std::uint64_t stamp = 0;
    Pose pose;
  };
  void read(const IgtlMessage& message, std::vector<Reading>& out);
  std::optional<std::size_t> sourceOf(const IgtlSource& heard, bool is_pose);

  IgtlParser parser_;
  std::vector<IgtlMessage> messages_;
  std::shared_ptr<std::vector<IgtlSource>> sources_;
  bool stamped_, takes_newcomers_;
  std::map<std::size_t, Last> last_;
};

}  // namespace fieldtrue::acquisition
