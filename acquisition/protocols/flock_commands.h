#pragma once

/// What a Flock of Birds is told, and what it says of itself: commands, parameters to examine and change, status words
/// and error codes. Numbers of two bytes go low byte first.
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/flock.h"

namespace fieldtrue::acquisition {

/// How birds behind the master are addressed; each has a command prefix and a number of addresses.
enum class FlockAddressing { kNormal, kExpanded, kSuperExpanded };
/// One row of the table of addressing modes.
struct FlockAddressingKind {
  FlockAddressing addressing;
  const char* id;
  int code;              ///< Value of parameter 19.
  unsigned char prefix;  ///< To which the address is added.
  int birds;             ///< Addresses 1 to this.
  int status_bytes;      ///< Of the answer to the flock status.
};
std::span<const FlockAddressingKind> flockAddressings();
const FlockAddressingKind& flockAddressing(FlockAddressing addressing);

/// One row of the table of commands.
struct FlockCommandKind {
  char letter = 0;
  int data_bytes = 0;  ///< Behind the letter.
  const char* meaning = "";
};
std::span<const FlockCommandKind> flockCommandKinds();
const FlockCommandKind* findFlockCommand(char letter);

inline constexpr char kFlockExamine = 'O';
inline constexpr char kFlockChange = 'P';

/// Parameters by number.
namespace flock_parameter {
inline constexpr int kStatus = 0, kRevision = 1, kCrystal = 2, kScale = 3, kFilters = 4, kAlphaMin = 5, kRateCount = 6,
                     kRate = 7, kDataReady = 8, kDataReadyCharacter = 9, kError = 10, kErrorMask = 11, kFilterVm = 12,
                     kAlphaMax = 13, kSuddenChange = 14, kModel = 15, kExpandedError = 16, kReferenceFrame = 17,
                     kTransmitterMode = 18, kAddressing = 19, kLineFrequency = 20, kAddress = 21, kHemisphere = 22,
                     kAngleAlign = 23, kReferenceFrameAngles = 24, kSerialNumber = 25, kHostDelay = 32, kGroupMode = 35,
                     kFlockStatus = 36, kAutoConfigure = 50;
}  // namespace flock_parameter

/// One row of the table of parameters.
struct FlockParameter {
  int number = 0;
  int examined_bytes = 0;  ///< Of the answer to `O`; 0 = cannot be examined. The flock status has as many as addresses.
  int changed_bytes = 0;   ///< Behind `P` and the number; 0 = cannot be changed.
  const char* meaning = "";
};
std::span<const FlockParameter> flockParameters();
const FlockParameter* findFlockParameter(int number);

/// Commands by name.
namespace flock {
std::string point();   ///< One record; ends a stream.
std::string stream();  ///< Records without being asked.
std::string run();
std::string sleep();
std::string mode(const FlockMode& mode);
std::string reportEveryCycle();
/// @param side "+x", "-x", "+y", "-y", "+z" or "-z"
std::string hemisphere(const std::string& side);
std::string examine(int parameter);
std::string change(int parameter, std::string_view data);
std::string groupMode(bool on);
std::string autoConfigure(int units);  ///< Leave 300 ms free before and after.
/// @param ac_narrow, ac_wide, dc which filters are on; a set bit of the parameter turns one off
std::string filters(bool ac_narrow, bool ac_wide, bool dc);
std::string scale(bool inches_72);
std::string clearAngleAlign();      ///< Sensor angles as built in.
std::string clearReferenceFrame();  ///< Transmitter frame as built in.
/// The command behind the prefix that hands it to a bird. @param address 0 = the bird on the line itself, no prefix
std::string toBird(int address, std::string_view command, FlockAddressing addressing = FlockAddressing::kNormal);
}  // namespace flock

/// The two bytes of the hemisphere command. Axis and sign as in the table of the manual: front is +x, right +y, lower
/// +z. @return none for another text
std::optional<std::array<unsigned char, 2>> flockHemisphere(std::string_view side);
/// The unit vector towards the side the two bytes name; none where they name none.
std::optional<Eigen::Vector3d> flockHemisphereAxis(unsigned char axis, unsigned char sign);

/// A command as it came. @see FlockCommandReader
struct FlockCommand {
  int address = 0;  ///< 0 = without a prefix.
  char letter = 0;
  std::optional<int> parameter;  ///< Of `O` and `P`.
  std::string data;
};

/// Splits what the host sends into commands, whatever the chunks and however many are glued together; the bird's side
/// of the line.
class FlockCommandReader {
 public:
  explicit FlockCommandReader(FlockAddressing addressing = FlockAddressing::kNormal) : addressing_(addressing) {}
  /// Appends the commands that are complete. An unknown letter or parameter is a command, so that it can be refused.
  void add(std::string_view bytes, std::vector<FlockCommand>& out);
  void clear() { pending_.clear(); }

 private:
  std::size_t read(std::string_view bytes, FlockCommand& command) const;
  FlockAddressing addressing_;
  std::string pending_;
};

/// The status word (parameter 0).
struct FlockStatus {
  bool master = false, initialised = false, error = false, running = false, host_sync = false, expanded = false;
  bool crt_sync = false, no_sync = false, factory_test = false, xoff = false, sleeping = false;
  bool streaming = false;  ///< Sources differ on the sense of this bit: nothing is concluded from it.
  int mode = 0;            ///< Code of the record mode.

  bool operator==(const FlockStatus&) const = default;
};
std::string encodeFlockStatus(const FlockStatus& status);
/// @param bytes two
FlockStatus decodeFlockStatus(std::string_view bytes);
/// What is wrong or unusual in it, in words; empty = nothing.
std::string flockStatusMeaning(const FlockStatus& status);

/// One byte of the flock status: what stands at an address.
struct FlockUnit {
  bool accessible = false, running = false, receiver = false;
  bool extended_range_controller = false;
  unsigned transmitters = 0;  ///< Bit 0 the standard one or ERT 0, bits 1 to 3 ERT 1 to 3.

  bool operator==(const FlockUnit&) const = default;
};
unsigned char encodeFlockUnit(const FlockUnit& unit);
FlockUnit decodeFlockUnit(unsigned char byte);
/// The units of an answer to `O 36`, address 1 first.
std::vector<FlockUnit> decodeFlockUnits(std::string_view bytes);

/// Meaning in words of an error code (parameters 10 and 16); empty for 0.
std::string flockErrorMeaning(int code);
/// Meaning in words of a sample's status.
std::string flockSampleMeaning(const std::string& status);

/// Measurements a second. @param count parameter 6; @param crystal_mhz parameter 2
/// @source the formula of VRPN's driver: 1000 / (4 * count * (8 / MHz) / 1000 + 0.3)
double flockRate_hz(int count, int crystal_mhz);
/// The inverse. @param rate_hz below 3000
int flockRateCount(double rate_hz, int crystal_mhz);

/// A number of two bytes. @param bytes at least two
int flockNumber(std::string_view bytes);
std::string flockNumberBytes(int number);

}  // namespace fieldtrue::acquisition
