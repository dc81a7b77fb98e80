#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/pose.h"

/// Messages of OpenIGTLink as pure functions: bytes to poses and back. Numbers are big-endian, lengths millimetres.
/// @source openigtlink.org, protocol documents of version 3.0, which hold versions 1 and 2 too
namespace fieldtrue::acquisition {

inline constexpr std::size_t kIgtlHeaderBytes = 58;

/// What stands before the body of every message.
struct IgtlHeader {
  /// Of the header: 1 in protocol versions 1 and 2; from 2 on the body begins with an extended header and may end with
  /// metadata (protocol version 3).
  int version = 1;
  std::string type;         ///< "TRANSFORM", at most 12 characters.
  std::string device;       ///< At most 20.
  std::uint64_t stamp = 0;  ///< Since 1970, UTC, in 2^-32 s; 0 = none.
  std::uint64_t body_bytes = 0;
  std::uint64_t crc = 0;  ///< Of the body; 0 = not stated.
};

/// None where the bytes cannot be a header: version, printable names filled with zeros, a body below 4 GiB.
/// @param bytes the first kIgtlHeaderBytes are looked at
std::optional<IgtlHeader> decodeIgtlHeader(std::string_view bytes);

/// CRC-64 of ECMA-182: polynomial 0x42F0E1EBA9EA3693, from 0, highest bit first, nothing inverted.
std::uint64_t igtlCrc(std::string_view bytes);

/// A stamp in seconds since 1970, and back to the nearest.
double secondsOfIgtlStamp(std::uint64_t stamp);
std::uint64_t igtlStampOf(double seconds);

/// The body without what protocol version 3 put around it, and what the metadata says.
struct IgtlBody {
  std::string_view content;
  std::string_view
      transform_status;  ///< Value of the key TransformStatus, which PLUS sends; empty where there is none.
};
/// None where the sizes in the extended header do not fit the body.
std::optional<IgtlBody> splitIgtlBody(const IgtlHeader& header, std::string_view body);

/// Statuses of readings that are no poses, beside `missing` and `damaged`.
inline constexpr const char* kStatusMirrored = "mirrored";
inline constexpr const char* kStatusScaled = "scaled";
inline constexpr const char* kStatusSheared = "sheared";
inline constexpr const char* kStatusNoOrientation = "no_orientation";

/// What a message says of one sensor.
struct IgtlReading {
  std::string name;  ///< The element's in tracking data, else the message's device name.
  Pose tracker_from_sensor;
  std::string status;  ///< Of a sample: empty = a pose. Otherwise the pose is the identity.
};

/// The four types that carry poses; by preference, where a server sends one sensor in several: tracking data also tells
/// which sensors are not seen.
enum class IgtlPoseType { kTrackingData, kQuaternionData, kTransform, kPosition };
inline constexpr int kIgtlPoseTypes = 4;
/// "TDATA", "QTDATA", "TRANSFORM", "POSITION".
const char* nameOf(IgtlPoseType type);
std::optional<IgtlPoseType> igtlPoseType(std::string_view message_type);

/// Whether a message of that type can have a body of that length; what may stand around the content is not known before
/// the body is.
bool igtlLengthFits(const IgtlHeader& header);

/// Reads the poses of a message. A matrix that is no rotation is no pose: `mirrored`, `scaled` or `sheared`; one of
/// zeros is `missing`; a position without orientation is `no_orientation`.
/// @return none when the body has not the length its type asks for, or carries no poses
std::optional<std::vector<IgtlReading>> readingsOf(const IgtlHeader& header, std::string_view body);
/// Meaning in words of a status of such a reading.
std::string igtlStatusMeaning(const std::string& status);

/// A STATUS message: what the server says of itself.
struct IgtlServerStatus {
  int code = 1;  ///< 1 = fine.
  std::string name;
  std::string message;
};
std::optional<IgtlServerStatus> serverStatusOf(const IgtlHeader& header, std::string_view body);

/// A message of header version 1 with its CRC.
std::string encodeIgtl(std::string_view type, std::string_view device, std::uint64_t stamp, std::string_view body);
/// Bodies of the four types; POSITION and QTDATA with a quaternion x, y, z, w.
std::string encodeTransformBody(const Pose& tracker_from_sensor);
std::string encodePositionBody(const Pose& tracker_from_sensor);
std::string encodeTrackingBody(const std::vector<IgtlReading>& readings);
std::string encodeQuaternionTrackingBody(const std::vector<IgtlReading>& readings);
std::string encodeServerStatusBody(const IgtlServerStatus& status);
/// Asks a server to send tracking data (body of STT_TDATA and STT_QTDATA) as fast as it can, in its own frame.
std::string encodeStartTrackingBody();

}  // namespace fieldtrue::acquisition
