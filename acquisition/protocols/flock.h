#pragma once

/// What an Ascension Flock of Birds sends, as pure functions: record modes, 14-bit words with their phasing bit,
/// records to readings and back. Commands, parameters and status words stand in flock_commands.h.
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/pose_numbers.h"
#include "acquisition/protocols/stream_parser.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

inline constexpr int kFlockMostBirds = 14;  ///< Addresses 1 to 14 of normal addressing.

/// Full scales of the position words [m]: 36 in as delivered, 72 in, and 144 in of the extended range transmitter.
inline constexpr double kFlockRange36_m = 36.0 * 0.0254;
inline constexpr double kFlockRange72_m = 72.0 * 0.0254;
inline constexpr double kFlockRange144_m = 144.0 * 0.0254;

/// Step of a position, an angle or a cosine word, as a part of its full scale: 14 bits with sign.
inline constexpr double kFlockStep = 1.0 / 8192.0;

enum class FlockOrientation { kNone, kAngles, kMatrix, kQuaternion };

/// One row of the table of record modes.
struct FlockMode {
  const char* id = "";
  char command = 0;
  int code = 0;  ///< As the status word names it.
  bool position = false;
  FlockOrientation orientation = FlockOrientation::kNone;
  std::size_t words = 0;
};
std::span<const FlockMode> flockModes();
/// Null where no mode is called so.
const FlockMode* findFlockMode(std::string_view id);
const FlockMode* findFlockMode(char command);

/// What sources and installations disagree on; the defaults are those of the maker's manual.
struct FlockConventions {
  bool matrix_by_columns = false;    ///< Cosines come column by column of tracker_from_sensor, not row by row.
  bool inverted_quaternion = false;  ///< Quaternions are sensor_from_tracker.
  char mirrored = 0;                 ///< 'x', 'y' or 'z': the tracker's frame is left-handed, this axis is turned over.
};

/// What a bird reports: a pose in one of its forms, as the record says it.
struct FlockRecord {
  int address = 1;  ///< Of the bird on the bus; 1 where records do not say.
  PoseNumbers pose;
};

/// How the records of a stream are made.
struct FlockLayout {
  const FlockMode* mode = nullptr;
  bool group = false;  ///< Each record is followed by the address of its bird.
  double range_m = kFlockRange36_m;
  FlockConventions conventions;

  std::size_t bytes() const { return 2 * mode->words + (group ? 1 : 0); }
};

/// A word as two bytes without the phasing bit: bits 8 to 2, then bits 15 to 9.
/// @param part of the full scale; beyond it the word stays at its end
std::string encodeFlockWord(double part);
/// The inverse. @return part of the full scale, in [-1, 1)
double decodeFlockWord(unsigned char low, unsigned char high);

/// Writes a record. @param tracker_from_sensor as the bird reports it
std::string encodeFlockRecord(int address, const Pose& tracker_from_sensor, const FlockLayout& layout);

/// Reads a record.
/// @param bytes exactly layout.bytes() long
/// @return none when the phasing bit is not in the first byte alone, or the address is none of a bird
std::optional<FlockRecord> decodeFlockRecord(std::string_view bytes, const FlockLayout& layout);

/// The record as a reading without a time: good, or `damaged`.
Sample toSample(const FlockRecord& record, int sensor);

/// A bird that says the same for so many records in a row is marked `stuck` from then on: no hand and no filter is as
/// still as that.
inline constexpr int kFlockStuckRecords = 100;
inline constexpr const char* kStatusStuck = "stuck";

/// What a parser must know of the stream.
struct FlockStreamSettings {
  FlockLayout layout;
  /// Sensor of each bird that reports, by address; below 0 = passed over. Other birds' records are noise.
  std::map<int, int> sensors = {{1, 0}};
  int records_to_lock = 2;   ///< Good records in a row before any is believed. 1 for polled records.
  bool drop_repeats = true;  ///< Passes over records that say to the bit what the bird's last one said.
};

/// Turns the bytes of a Flock, cut anywhere, into readings.
class FlockParser : public StreamParser {
 public:
  explicit FlockParser(FlockStreamSettings settings);

  void add(std::string_view bytes, std::vector<Reading>& out) override;
  std::uint64_t answers() const override { return finder_.frames(); }

  std::uint64_t dropped_bytes() const { return finder_.dropped_bytes(); }
  std::uint64_t repeats() const { return repeats_; }

 private:
  FrameMatch match(std::string_view rest) const;
  FrameMatch take(std::string_view rest, std::vector<Reading>& out);
  void read(std::string_view record, std::vector<Reading>& out);

  FlockStreamSettings settings_;
  FrameFinder finder_;
  bool locked_ = false;
  struct Said {
    std::string record;
    int repeats = 0;
  };
  std::map<int, Said> last_;  ///< By address.
  std::uint64_t repeats_ = 0;
};

}  // namespace fieldtrue::acquisition
