#include "acquisition/protocols/flock_commands.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace fieldtrue::acquisition {
namespace {

constexpr FlockAddressingKind kAddressings[] = {
    {FlockAddressing::kNormal, "normal", 0, 0xF0, 14, 14},
    {FlockAddressing::kExpanded, "expanded", 1, 0xE0, 30, 30},
    {FlockAddressing::kSuperExpanded, "super_expanded", 3, 0xA0, 95, 126},
};

constexpr FlockCommandKind kCommands[] = {
    {'B', 0, "point: one record, and no stream"},
    {'@', 0, "stream"},
    {'?', 0, "no stream (newer firmware)"},
    {'F', 0, "run"},
    {'G', 0, "sleep: the transmitter is off"},
    {'V', 0, "position"},
    {'W', 0, "angles"},
    {'X', 0, "matrix"},
    {'Y', 0, "position and angles"},
    {'Z', 0, "position and matrix"},
    {'\\', 0, "quaternion"},
    {']', 0, "position and quaternion"},
    {'Q', 0, "report every cycle"},
    {'R', 0, "report every 2nd cycle"},
    {'S', 0, "report every 8th cycle"},
    {'T', 0, "report every 32nd cycle"},
    {'L', 2, "hemisphere"},
    {'J', 12, "angle align by sines and cosines"},
    {'q', 6, "angle align by angles"},
    {'H', 12, "reference frame by sines and cosines"},
    {'r', 6, "reference frame by angles"},
    {'K', 6, "tip offset"},
    {'A', 1, "synchronise"},
    {'M', 1, "button mode"},
    {'N', 0, "button read"},
    {'0', 1, "next transmitter"},
    {'/', 0, "reset of the bus"},
    {kFlockExamine, 1, "examine a parameter"},
    {kFlockChange, 1, "change a parameter"},
    {'\x11', 0, "XON"},
    {'\x13', 0, "XOFF"},
};

namespace p = flock_parameter;
constexpr FlockParameter kParameters[] = {
    {p::kStatus, 2, 0, "status word"},
    {p::kRevision, 2, 0, "software revision"},
    {p::kCrystal, 2, 0, "crystal [MHz]"},
    {p::kScale, 2, 2, "position scale"},
    {p::kFilters, 2, 2, "filters that are off"},
    {p::kAlphaMin, 14, 14, "alpha-min of the DC filter"},
    {p::kRateCount, 2, 2, "measurement rate count"},
    {p::kRate, 2, 2, "measurement rate [1/256 Hz]"},
    {p::kDataReady, 1, 1, "data ready output"},
    {p::kDataReadyCharacter, 1, 1, "data ready character"},
    {p::kError, 1, 0, "last error"},
    {p::kErrorMask, 1, 1, "stop on errors"},
    {p::kFilterVm, 14, 14, "Vm of the DC filter"},
    {p::kAlphaMax, 14, 14, "alpha-max of the DC filter"},
    {p::kSuddenChange, 1, 1, "sudden change lock"},
    {p::kModel, 10, 0, "model"},
    {p::kExpandedError, 2, 0, "last error and where"},
    {p::kReferenceFrame, 1, 1, "reference frame turns positions too"},
    {p::kTransmitterMode, 1, 1, "transmitter mode"},
    {p::kAddressing, 1, 1, "addressing mode"},
    {p::kLineFrequency, 1, 1, "line frequency [Hz]"},
    {p::kAddress, 1, 0, "own address"},
    {p::kHemisphere, 2, 2, "hemisphere"},
    {p::kAngleAlign, 6, 6, "angle align"},
    {p::kReferenceFrameAngles, 6, 6, "reference frame"},
    {p::kSerialNumber, 2, 0, "serial number"},
    {p::kHostDelay, 1, 1, "host delay"},
    {p::kGroupMode, 1, 1, "group mode"},
    {p::kFlockStatus, 14, 0, "flock status"},
    {p::kAutoConfigure, 0, 1, "auto-configure"},
};

struct Side {
  const char* id;
  unsigned char axis, sign;
};
constexpr Side kSides[] = {{"+x", 0x00, 0x00}, {"-x", 0x00, 0x01}, {"+y", 0x06, 0x00},
                           {"-y", 0x06, 0x01}, {"+z", 0x0C, 0x00}, {"-z", 0x0C, 0x01}};

constexpr std::pair<int, const char*> kErrors[] = {
    {1, "the RAM of the unit failed its test"},
    {2, "the unit's memory could not be written"},
    {3, "the configuration in the unit's memory is damaged"},
    {4, "the transmitter's memory is damaged, or no transmitter is plugged in"},
    {5, "the receiver's memory is damaged, or no receiver is plugged in"},
    {6, "a command was not understood"},
    {7, "the unit on the line is not the master of the flock"},
    {8, "no bird is active"},
    {9, "a bird has not been initialised"},
    {10, "receive error on the bus between the birds"},
    {11, "the line overran: its rate is wrong, or commands came too fast"},
    {12, "receive error on the bus to the host"},
    {13, "a bird does not answer on the bus: check its power, its address switches and the bus cable"},
    {14, "an invalid command came over the bus"},
    {15, "run-time error of the bus"},
    {16, "the unit does not know the speed of its processor"},
    {17, "a bird sent no data"},
    {18, "the rate switches say no valid rate"},
    {19, "a bird did not acknowledge"},
    {20, "processor overflow: the maker must see the unit"},
    {21, "array bounds: the maker must see the unit"},
    {22, "unused operation code: the maker must see the unit"},
    {23, "escape operation code: the maker must see the unit"},
    {24, "reserved interrupt 9: the maker must see the unit"},
    {25, "reserved interrupt 10: the maker must see the unit"},
    {26, "reserved interrupt 11: the maker must see the unit"},
    {27, "numeric error of the processor"},
    {28, "synchronisation with the screen failed"},
    {29, "the transmitter is not active"},
    {30, "the extended range transmitter is not attached"},
    {31, "the processor ran out of time: the measurement rate is too high"},
    {32, "the receiver is saturated: it is too close to the transmitter"},
    {33, "a bird is not configured as the master expects"},
    {34, "the watchdog of the extended range controller"},
    {35, "the extended range controller is too hot"},
};

struct StatusBit {
  unsigned mask;
  bool FlockStatus::*member;
};
constexpr StatusBit kStatusBits[] = {
    {0x8000, &FlockStatus::master},   {0x4000, &FlockStatus::initialised}, {0x2000, &FlockStatus::error},
    {0x1000, &FlockStatus::running},  {0x0800, &FlockStatus::host_sync},   {0x0400, &FlockStatus::expanded},
    {0x0200, &FlockStatus::crt_sync}, {0x0100, &FlockStatus::no_sync},     {0x0080, &FlockStatus::factory_test},
    {0x0040, &FlockStatus::xoff},     {0x0020, &FlockStatus::sleeping},    {0x0001, &FlockStatus::streaming},
};
constexpr unsigned kModeShift = 1;
constexpr unsigned kModeMask = 0xF;

template <class Rows, class Holds>
auto rowWhere(const Rows& rows, Holds holds) -> decltype(std::begin(rows)) {
  const auto row = std::find_if(std::begin(rows), std::end(rows), holds);
  return row == std::end(rows) ? nullptr : row;
}

constexpr double kRateOverhead_ms = 0.3;
constexpr double kPhases = 4.0;

double countUnit_ms(int crystal_mhz) { return 8.0 / crystal_mhz / 1000.0; }

}  // namespace

std::span<const FlockAddressingKind> flockAddressings() { return kAddressings; }

const FlockAddressingKind& flockAddressing(FlockAddressing addressing) {
  return *rowWhere(kAddressings, [addressing](const auto& row) { return row.addressing == addressing; });
}

std::span<const FlockCommandKind> flockCommandKinds() { return kCommands; }

const FlockCommandKind* findFlockCommand(char letter) {
  return rowWhere(kCommands, [letter](const auto& row) { return row.letter == letter; });
}

std::span<const FlockParameter> flockParameters() { return kParameters; }

const FlockParameter* findFlockParameter(int number) {
  return rowWhere(kParameters, [number](const auto& row) { return row.number == number; });
}

namespace flock {

std::string point() { return "B"; }
std::string stream() { return "@"; }
std::string run() { return "F"; }
std::string sleep() { return "G"; }
std::string mode(const FlockMode& mode) { return {mode.command}; }
std::string reportEveryCycle() { return "Q"; }

std::string hemisphere(const std::string& side) {
  const auto bytes = flockHemisphere(side);
  FT_CHECK(bytes.has_value());
  return {'L', static_cast<char>((*bytes)[0]), static_cast<char>((*bytes)[1])};
}

std::string examine(int parameter) { return {kFlockExamine, static_cast<char>(parameter)}; }

std::string change(int parameter, std::string_view data) {
  return std::string{kFlockChange, static_cast<char>(parameter)} + std::string(data);
}

std::string groupMode(bool on) { return change(p::kGroupMode, std::string(1, on ? '\1' : '\0')); }
std::string autoConfigure(int units) { return change(p::kAutoConfigure, std::string(1, static_cast<char>(units))); }

std::string filters(bool ac_narrow, bool ac_wide, bool dc) {
  return change(p::kFilters, flockNumberBytes((ac_narrow ? 0 : 4) | (ac_wide ? 0 : 2) | (dc ? 0 : 1)));
}

std::string scale(bool inches_72) { return change(p::kScale, flockNumberBytes(inches_72 ? 1 : 0)); }
std::string clearAngleAlign() { return "q" + std::string(6, '\0'); }
std::string clearReferenceFrame() { return "r" + std::string(6, '\0'); }

std::string toBird(int address, std::string_view command, FlockAddressing addressing) {
  if (address == 0) return std::string(command);
  return static_cast<char>(flockAddressing(addressing).prefix + address) + std::string(command);
}

}  // namespace flock

std::optional<std::array<unsigned char, 2>> flockHemisphere(std::string_view side) {
  const auto* row = rowWhere(kSides, [side](const Side& s) { return s.id == side; });
  return row ? std::optional(std::array{row->axis, row->sign}) : std::nullopt;
}

std::optional<Eigen::Vector3d> flockHemisphereAxis(unsigned char axis, unsigned char sign) {
  if (axis % 6 != 0 || axis > 0x0C || sign > 1) return std::nullopt;
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  towards[axis / 6] = sign ? -1.0 : 1.0;
  return towards;
}

std::size_t FlockCommandReader::read(std::string_view bytes, FlockCommand& command) const {
  std::size_t at = 0;
  const FlockAddressingKind& addressing = flockAddressing(addressing_);
  const int address = static_cast<unsigned char>(bytes[0]) - addressing.prefix;
  if (address >= 1 && address <= addressing.birds) {
    command.address = address;
    at = 1;
  }
  if (bytes.size() <= at) return 0;
  command.letter = bytes[at++];
  const FlockCommandKind* kind = findFlockCommand(command.letter);
  if (!kind) return at;
  std::size_t data = static_cast<std::size_t>(kind->data_bytes);
  if (command.letter == kFlockExamine || command.letter == kFlockChange) {
    if (bytes.size() <= at) return 0;
    command.parameter = static_cast<unsigned char>(bytes[at++]);
    const FlockParameter* parameter = findFlockParameter(*command.parameter);
    data = command.letter == kFlockChange && parameter ? static_cast<std::size_t>(parameter->changed_bytes) : 0;
  }
  if (bytes.size() < at + data) return 0;
  command.data = bytes.substr(at, data);
  return at + data;
}

void FlockCommandReader::add(std::string_view bytes, std::vector<FlockCommand>& out) {
  pending_.append(bytes);
  std::size_t used = 0;
  while (used < pending_.size()) {
    FlockCommand command;
    const std::size_t length = read(std::string_view(pending_).substr(used), command);
    if (length == 0) break;
    used += length;
    out.push_back(std::move(command));
  }
  pending_.erase(0, used);
}

std::string encodeFlockStatus(const FlockStatus& status) {
  unsigned word = (static_cast<unsigned>(status.mode) & kModeMask) << kModeShift;
  for (const StatusBit& bit : kStatusBits) word |= status.*bit.member ? bit.mask : 0u;
  return flockNumberBytes(static_cast<int>(word));
}

FlockStatus decodeFlockStatus(std::string_view bytes) {
  const auto word = static_cast<unsigned>(flockNumber(bytes));
  FlockStatus status;
  status.mode = static_cast<int>(word >> kModeShift & kModeMask);
  for (const StatusBit& bit : kStatusBits) status.*bit.member = (word & bit.mask) != 0;
  return status;
}

std::string flockStatusMeaning(const FlockStatus& status) {
  std::string text;
  const auto say = [&text](bool holds, const char* words) {
    if (holds) text += (text.empty() ? "" : ", ") + std::string(words);
  };
  say(!status.initialised, "not initialised");
  say(!status.running, "not running");
  say(status.error, "an error has occurred");
  say(status.sleeping, "asleep: its transmitter is off");
  say(status.factory_test, "in factory test");
  say(status.xoff, "held by XOFF");
  say(status.crt_sync, "synchronised with a screen");
  say(status.host_sync, "synchronised with the host");
  return text;
}

unsigned char encodeFlockUnit(const FlockUnit& unit) {
  return static_cast<unsigned char>((unit.accessible ? 0x80 : 0) | (unit.running ? 0x40 : 0) |
                                    (unit.receiver ? 0x20 : 0) | (unit.extended_range_controller ? 0x10 : 0) |
                                    static_cast<int>(unit.transmitters & 0xFu));
}

FlockUnit decodeFlockUnit(unsigned char byte) {
  return {(byte & 0x80) != 0, (byte & 0x40) != 0, (byte & 0x20) != 0, (byte & 0x10) != 0, byte & 0xFu};
}

std::vector<FlockUnit> decodeFlockUnits(std::string_view bytes) {
  std::vector<FlockUnit> units;
  for (const char byte : bytes) units.push_back(decodeFlockUnit(static_cast<unsigned char>(byte)));
  return units;
}

std::string flockErrorMeaning(int code) {
  if (code == 0) return {};
  const auto* row = rowWhere(kErrors, [code](const auto& error) { return error.first == code; });
  return row ? row->second : "error " + std::to_string(code) + ", which the manual does not list";
}

std::string flockSampleMeaning(const std::string& status) {
  if (status == kStatusStuck) {
    return "the same reading again and again, to the bit: the receiver is saturated or unplugged, or a heavy filter "
           "holds it (repeats=keep takes such readings)";
  }
  return commonStatusMeaning(status);
}

double flockRate_hz(int count, int crystal_mhz) {
  FT_CHECK(crystal_mhz > 0);
  return 1000.0 / (kPhases * count * countUnit_ms(crystal_mhz) + kRateOverhead_ms);
}

int flockRateCount(double rate_hz, int crystal_mhz) {
  FT_CHECK(crystal_mhz > 0 && rate_hz > 0.0);
  return static_cast<int>(std::lround((1000.0 / rate_hz - kRateOverhead_ms) / kPhases / countUnit_ms(crystal_mhz)));
}

int flockNumber(std::string_view bytes) {
  FT_CHECK(bytes.size() >= 2);
  return static_cast<unsigned char>(bytes[0]) | static_cast<unsigned char>(bytes[1]) << 8;
}

std::string flockNumberBytes(int number) {
  return {static_cast<char>(number & 0xFF), static_cast<char>(number >> 8 & 0xFF)};
}

}  // namespace fieldtrue::acquisition
