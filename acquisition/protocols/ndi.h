#pragma once

/// The combined API of NDI's Aurora, Polaris and Vega as pure functions: commands and replies with their CRC, port
/// handles, and the two forms of a reply with poses, TX (text) and BX (binary), to readings and back.
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/protocols/stream_parser.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {

inline constexpr double kNdiAuroraRate_hz = 40.0;
inline constexpr double kNdiPolarisRate_hz = 60.0;
inline constexpr int kNdiPowerUpBaud = 9600;

/// CRC-16 with the reflected polynomial A001, beginning with 0. @param crc of what came before
std::uint16_t ndiCrc(std::string_view bytes, std::uint16_t crc = 0);
/// Four upper-case hex digits, or as many as asked for.
std::string ndiHex(unsigned value, int digits);
/// None where a character is no hex digit.
std::optional<unsigned> ndiNumber(std::string_view hex);

/// `NAME:arguments`, CRC, carriage return.
std::string ndiCommand(std::string_view name, std::string_view arguments = {});

/// The digit by which COMM names a rate; none for a rate it has not.
std::optional<char> ndiRateDigit(int baud);
/// The inverse. @return 0 for no digit of a rate
int ndiRateOfDigit(char digit);
/// Rates of the table, fastest last.
std::vector<int> ndiRates();

/// A reply in text: its CRC was right.
struct NdiReply {
  std::string text;
  std::optional<int> error;  ///< Code of `ERRORhh`.
  bool isOkay() const { return text == "OKAY" || text.starts_with("WARNING"); }
};
/// The text with its CRC and a carriage return.
std::string encodeNdiReply(std::string_view text);
std::string ndiErrorText(int code);  ///< `ERRORhh`
/// The first whole reply with a right CRC among the lines.
std::optional<NdiReply> findNdiReply(std::string_view bytes);
/// Meaning in words of an error code.
std::string ndiErrorMeaning(int code);

/// A port handle as PHSR lists it, with its status.
struct NdiHandle {
  int handle = 0;
  unsigned status = 0;  ///< Twelve bits.
};
/// None where the text is not `NN` and NN times handle and status.
std::optional<std::vector<NdiHandle>> decodeNdiHandles(std::string_view text);
std::string encodeNdiHandles(std::span<const NdiHandle> handles);

/// What PHINF:hh0001 tells of a tool.
struct NdiToolInformation {
  std::string type, manufacturer, revision, serial;
  unsigned status = 0;
};
std::optional<NdiToolInformation> decodeNdiToolInformation(std::string_view text);
std::string encodeNdiToolInformation(const NdiToolInformation& information);

/// Bits of a port status.
namespace ndi_port {
inline constexpr unsigned kOccupied = 0x01, kSwitch1 = 0x02, kSwitch2 = 0x04, kSwitch3 = 0x08, kInitialised = 0x10,
                          kEnabled = 0x20, kOutOfVolume = 0x40, kPartlyOutOfVolume = 0x80;
}  // namespace ndi_port

enum class NdiState { kValid, kMissing, kDisabled, kUnoccupied };

/// What a TX or BX reply says of one handle.
struct NdiTool {
  int handle = 0;
  NdiState state = NdiState::kMissing;
  Eigen::Vector4d quaternion_wxyz = Eigen::Vector4d::Zero();  ///< As sent, not normalised.
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double error_mm = 0.0;  ///< RMS of the fit; an Aurora's indicator value.
  unsigned port_status = 0;
  std::uint32_t frame = 0;
};
struct NdiFrame {
  std::vector<NdiTool> tools;
  unsigned system_status = 0;
};

/// The text of a reply to TX:0001, without CRC. Numbers too large for their columns make a tool MISSING.
std::string encodeNdiTx(const NdiFrame& frame);
/// None where the text is not one.
std::optional<NdiFrame> decodeNdiTx(std::string_view text);
/// The bytes of a reply to BX:0001, whole.
std::string encodeNdiBx(const NdiFrame& frame);
/// Bytes of the reply whose header stands here; none where no header with a right CRC does.
/// @param bytes at least kNdiBxHeader
std::optional<std::size_t> ndiBxLength(std::string_view bytes);
inline constexpr std::size_t kNdiBxHeader = 6;
/// @param bytes exactly as long as the header says. @return none where the CRC or the content is wrong
std::optional<NdiFrame> decodeNdiBx(std::string_view bytes);

/// Words for the bits of a system status; empty = nothing to say.
std::string ndiSystemMeaning(unsigned status);

/// Status texts of readings.
inline constexpr const char* kStatusOutOfVolume = "out_of_volume";
inline constexpr const char* kStatusPartlyOutOfVolume = "partly_out_of_volume";
inline constexpr const char* kStatusErrorValue = "error_value";
/// Meaning in words of a sample's status.
std::string ndiSampleMeaning(const std::string& status);

/// Which readings count.
struct NdiGate {
  double most_error_mm = 0.0;  ///< Of the error value; 0 = any.
  bool inside_volume = true;   ///< Readings out of the measuring volume, or partly, are marked.
};

/// The reading of a tool: the pose where there is one, and the first reason not to use it.
Reading ndiReading(const NdiTool& tool, int sensor, double frame_hz, const NdiGate& gate);

/// What a parser must know of the stream.
struct NdiStreamSettings {
  bool binary = true;          ///< Replies to BX, else to TX.
  std::map<int, int> sensors;  ///< Sensor of each handle; other handles are passed over.
  double frame_hz = kNdiPolarisRate_hz;
  NdiGate gate;
};

/// Turns replies to TX or BX, cut anywhere, into readings. A reply whose frame was seen before brings none;
/// a tool that is unplugged has no frame, and brings one reading as it goes.
class NdiParser : public StreamParser {
 public:
  explicit NdiParser(NdiStreamSettings settings) : settings_(std::move(settings)) {}

  void add(std::string_view bytes, std::vector<Reading>& out) override;
  /// Replies, damaged ones and errors too: after each the host may ask again.
  std::uint64_t answers() const override { return finder_.frames() + damaged_; }

  std::uint64_t damaged() const { return damaged_; }
  std::uint64_t dropped_bytes() const { return finder_.dropped_bytes(); }

 private:
  FrameMatch matchBinary(std::string_view rest, std::vector<Reading>& out);
  FrameMatch matchText(std::string_view rest, std::vector<Reading>& out);
  bool take(const std::optional<NdiFrame>& frame, std::vector<Reading>& out);

  NdiStreamSettings settings_;
  FrameFinder finder_;
  std::map<int, std::uint32_t> last_frame_;  ///< By handle.
  std::set<int> unplugged_;                  ///< Handles of the tools that were told to be gone.
  std::uint64_t damaged_ = 0;
};

/// The commands that write a tool definition file into a handle, 64 bytes each.
/// @param rom content of the file
std::vector<std::string> ndiWriteRom(int handle, std::string_view rom);
inline constexpr std::size_t kNdiMostRomBytes = 1024;

}  // namespace fieldtrue::acquisition
