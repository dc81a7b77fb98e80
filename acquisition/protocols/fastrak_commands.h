#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/fastrak_items.h"

namespace fieldtrue::acquisition {

/// A command as data: its letter, the station where it has one, and its fields as text; an empty field keeps its value.
struct FastrakCommand {
  char letter = 0;
  std::optional<int> station;
  std::vector<std::string> fields;
  std::string text;  ///< What stands behind the letter, as it came.

  bool operator==(const FastrakCommand& other) const {
    return letter == other.letter && station == other.station && fields == other.fields;
  }
};

/// How a command letter is written.
enum class FastrakGrammar {
  kAtOnce,    ///< The letter alone; acts without a carriage return.
  kStation,   ///< Letter, station, `,` and fields, carriage return.
  kFields,    ///< Letter, fields, carriage return.
  kFreeText,  ///< Letter, text, carriage return.
};

/// One row of the command table.
struct FastrakCommandKind {
  char letter = 0;
  FastrakGrammar grammar = FastrakGrammar::kAtOnce;
  const char* meaning = "";
};
std::span<const FastrakCommandKind> fastrakCommandKinds();
const FastrakCommandKind* findFastrakCommand(char letter);

inline constexpr char kFastrakReinitialise = 0x19;  ///< ^Y
inline constexpr char kFastrakSave = 0x0B;          ///< ^K
inline constexpr char kFastrakXoff = 0x13;          ///< ^S
inline constexpr char kFastrakXon = 0x11;           ///< ^Q

/// The bytes of a command, with its carriage return where it has one.
std::string encode(const FastrakCommand& command);

/// Commands by name, so that a driver need not know the letters. Lengths are in the unit the tracker is set to.
namespace fastrak {
FastrakCommand point();  ///< One record of each active station.
FastrakCommand continuous(bool on);
FastrakCommand format(FastrakFormat format);
FastrakCommand units(FastrakUnit unit);
FastrakCommand status();
FastrakCommand compensation(bool on);  ///< Factory table for fixed metal.
FastrakCommand reinitialise();         ///< ^Y: about 10 s of silence.
FastrakCommand saveToMemory();         ///< ^K
FastrakCommand factoryDefaults();
FastrakCommand pauseOutput();   ///< XOFF
FastrakCommand resumeOutput();  ///< XON
FastrakCommand selfTest();      ///< `T`
FastrakCommand outputList(int station, std::span<const int> items);
FastrakCommand stationActive(int station, bool on);
FastrakCommand hemisphere(int station, const Eigen::Vector3d& towards);  ///< Zero = tracked continuously.
FastrakCommand boresight(int station);
FastrakCommand unBoresight(int station);
FastrakCommand boresightReference(int station, const Eigen::Vector3d& azimuth_elevation_roll_deg);
FastrakCommand alignment(int station, const Eigen::Vector3d& origin, const Eigen::Vector3d& on_x,
                         const Eigen::Vector3d& on_y);
FastrakCommand resetAlignment(int station);
FastrakCommand transmitterMounting(int station, const Eigen::Vector3d& azimuth_elevation_roll_deg);
FastrakCommand tipOffset(int station, const Eigen::Vector3d& tip);
FastrakCommand stylusButton(int station, bool point_mode);
FastrakCommand increment(int station, double distance);
FastrakCommand positionEnvelope(int station, const Eigen::Vector3d& max, const Eigen::Vector3d& min);
FastrakCommand angularEnvelope(int station, const Eigen::Vector3d& max_deg, const Eigen::Vector3d& min_deg);
/// What a filter does. F sensitivity, low and high bounds, and how fast it adapts; low = 1 is off.
struct Filter {
  double f = 0.0, low = 1.0, high = 0.0, factor = 0.0;
};
FastrakCommand attitudeFilter(const Filter& filter);
FastrakCommand positionFilter(const Filter& filter);
FastrakCommand attitudeFilterOff();
FastrakCommand positionFilterOff();
FastrakCommand attitudeFilterMacro(int level);  ///< 2 none, 3 low, 4 medium, 5 heavy.
FastrakCommand positionFilterMacro(int level);
FastrakCommand identification(std::string_view text);  ///< Cut at 32 characters.
/// @param baud 2400 to 115200, one of the seven of the manual
FastrakCommand lineRate(int baud, char parity = 'N', int bits = 8, bool hardware_handshake = false);
/// The command that reads a station's setting back: the letter and the station alone.
FastrakCommand readBack(char letter, int station);
}  // namespace fastrak

/// Splits what the host sends into commands, whatever the chunks; the device's side of the line.
class FastrakCommandReader {
 public:
  /// Appends the commands that are complete. A carriage return alone is no command; an unknown letter is one, so that
  /// it can be refused. A line of more than 256 bytes is cut there.
  void add(std::string_view bytes, std::vector<FastrakCommand>& out);
  void clear() { line_.clear(); }

 private:
  std::string line_;
};

}  // namespace fieldtrue::acquisition
