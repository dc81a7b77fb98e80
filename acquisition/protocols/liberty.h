#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/pose_numbers.h"
#include "acquisition/protocols/stream_parser.h"
#include "calib/core/error.h"

/// The protocol of the Polhemus Liberty and Patriot (manuals URM03PH156 rev. H and URM03PH170 rev. G) as pure
/// functions. In the binary format everything the tracker says is a frame: a tag, station, the command it answers, an
/// error letter and the length of what follows, all numbers little-endian.
namespace fieldtrue::acquisition {

/// One row of the trackers that speak it.
struct LibertyMake {
  const char* id;
  const char* make;
  const char* name;
  std::string_view tag;  ///< First two bytes of its frames.
  int most_stations;
  double rate_hz;  ///< Of every station, however many there are.
};
std::span<const LibertyMake> libertyMakes();
/// The row of that id, which must exist (FT_CHECK).
const LibertyMake& libertyMake(std::string_view id);

inline constexpr char kLibertyStations = 0x15;      ///< ^U: which stations are there and on.
inline constexpr char kLibertyWho = 0x16;           ///< ^V: who are you.
inline constexpr char kLibertyReinitialise = 0x19;  ///< ^Y
inline constexpr char kLibertyUnBoresight = 0x02;   ///< ^B

struct LibertyFrame {
  std::string tag;
  int station = 0;
  char command = 0;  ///< That it answers.
  char error = ' ';  ///< Blank = none.
  std::string payload;
};
inline constexpr std::size_t kLibertyHeaderBytes = 8;

std::string encode(const LibertyFrame& frame);
/// The first whole frame that answers a command, of whatever tag of the table; garbage before it is passed over.
std::optional<LibertyFrame> findLibertyFrame(std::string_view bytes, char command);
/// Whether any whole frame carries an error letter; frames of records do not count.
std::optional<LibertyFrame> findLibertyRefusal(std::string_view bytes);
/// The printable part of what a tracker says of itself, its lines joined by ", ".
std::string libertyIdentity(const LibertyFrame& who);
/// Bits of the stations that are plugged in, from the answer to ^U; none where the answer is too short.
std::optional<unsigned> libertyPlugged(const LibertyFrame& answer);

/// What one record carried.
struct LibertyRecord : PoseNumbers {
  int station = 1;
  char error = ' ';
  std::uint32_t time_ms = 0;  ///< The tracker's clock.
  std::uint32_t frame = 0;
  std::uint32_t stylus = 0;
  std::int32_t distortion = 0;
};

/// One row of the table of output items.
struct LibertyItem {
  int id = 0;
  std::string_view literal;  ///< Bytes that always stand there; empty for numbers.
  int values = 0;            ///< Numbers of four bytes.
  bool whole = false;        ///< 32-bit integers instead of floats.
  int decimals = 0;          ///< Of the ASCII form.
  void (*store)(LibertyRecord& record, const double* values, double metres_per_unit) = nullptr;
  void (*load)(const LibertyRecord& record, double* values, double metres_per_unit) = nullptr;
};
std::span<const LibertyItem> libertyItems();

/// Bytes of the payload of a record. @error kBadInput for an item that does not exist
Result<std::size_t> libertyPayloadBytes(std::span<const int> items);

/// @param metres_per_unit 0.01 or 0.0254
/// @return none when the payload is not what the list asks for
std::optional<LibertyRecord> decodeLibertyRecord(const LibertyFrame& frame, std::span<const int> items,
                                                 double metres_per_unit);
/// The payload of a binary record.
std::string encodeLibertyPayload(const LibertyRecord& record, std::span<const int> items, double metres_per_unit);
/// A record in the ASCII format: station in two columns, error letter, blank, then the items in fixed columns.
std::string encodeLibertyText(const LibertyRecord& record, std::span<const int> items, double metres_per_unit);

/// What a status says; error letters are the tracker's own.
std::string libertyStatusMeaning(const std::string& status);

/// Turns frames of records into readings timed by the tracker's clock (item 8). A frame counts when its tag, station,
/// command, length and the end mark of the list are right; end every list with item 1.
class LibertyParser : public StreamParser {
 public:
  struct Settings {
    std::string tag = "LY";
    std::vector<int> stations;
    std::vector<int> items;
    double metres_per_unit = 0.01;
  };
  /// @error kBadInput for a list that cannot be, or no station
  static Result<LibertyParser> make(Settings settings);
  void add(std::string_view bytes, std::vector<Reading>& out) override;
  std::uint64_t droppedBytes() const { return finder_.dropped_bytes(); }

 private:
  LibertyParser() = default;
  FrameMatch match(std::string_view rest, std::vector<Reading>& out) const;
  Settings settings_;
  std::size_t payload_ = 0;
  FrameFinder finder_;
};

/// A command as the tracker reads it: its letter, upper case, and its fields.
struct LibertyCommand {
  char letter = 0;
  std::vector<std::string> fields;
};

/// Commands by name; lengths are in the unit the tracker is set to.
namespace liberty {
std::string point();  ///< One record of each station; stops continuous output.
std::string continuous();
std::string binary(bool on);
std::string centimetres(bool on);
std::string who();
std::string stations();
std::string stationActive(int station, bool on);
std::string reinitialise();
std::string outputList(std::span<const int> items);  ///< Of all stations.
std::string hemisphere(int station, const Eigen::Vector3d& towards);
std::string resetAlignment();  ///< Of all stations.
std::string unBoresight();
std::string resetTime();
/// Sensitivity, low and high bound, factor; 0,1,0,0 = off. @param letter X position, Y attitude
std::string filter(char letter, const std::array<double, 4>& values);
}  // namespace liberty

/// Splits what the host sends into commands, whatever the chunks.
class LibertyCommandReader {
 public:
  void add(std::string_view bytes, std::vector<LibertyCommand>& out);

 private:
  std::string line_;
};

}  // namespace fieldtrue::acquisition
