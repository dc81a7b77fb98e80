#include "acquisition/protocols/openigtlink_messages.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <limits>

#include "acquisition/protocols/sample_status.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::size_t kTypeBytes = 12, kDeviceBytes = 20, kNameBytes = 20;
constexpr std::size_t kMatrixBytes = 48, kPositionBytes = 12, kQuaternionBytes = 16;
constexpr std::size_t kKindBytes = 2;  ///< What an element of tracking data is, and a reserved byte.
constexpr double kMillimetresPerMetre = 1000.0;
constexpr double kStampsPerSecond = 4294967296.0;  // 2^32

template <class Number>
Number bigEndian(std::string_view bytes, std::size_t at) {
  Number value = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    value = static_cast<Number>(value << 8 | static_cast<unsigned char>(bytes[at + i]));
  }
  return value;
}

template <class Number>
void appendBigEndian(std::string& out, Number value) {
  for (std::size_t i = sizeof(Number); i-- > 0;) out += static_cast<char>(value >> (8 * i) & 0xFF);
}

double floatAt(std::string_view bytes, std::size_t at) {
  return static_cast<double>(std::bit_cast<float>(bigEndian<std::uint32_t>(bytes, at)));
}

void appendFloat(std::string& out, double value) {
  appendBigEndian(out, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

Eigen::Vector3d vectorAt(std::string_view bytes, std::size_t at) {
  return {floatAt(bytes, at), floatAt(bytes, at + 4), floatAt(bytes, at + 8)};
}

void appendVector(std::string& out, const Eigen::Vector3d& v) {
  for (int i = 0; i < 3; ++i) appendFloat(out, v[i]);
}

/// Text in a field of fixed width, up to the first zero; none where anything but zeros follows, or is not printable.
std::optional<std::string> textField(std::string_view field) {
  const std::size_t length = std::min(field.find('\0'), field.size());
  const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (!std::all_of(field.begin(), field.begin() + static_cast<std::ptrdiff_t>(length), printable)) return std::nullopt;
  if (field.find_first_not_of('\0', length) != std::string_view::npos) return std::nullopt;
  return std::string(field.substr(0, length));
}

/// The same of text that is only shown: what cannot be read is left out.
std::string shownText(std::string_view field) {
  std::string text(field.substr(0, std::min(field.find('\0'), field.size())));
  std::erase_if(text, [](char c) { return c < ' ' || c > '~'; });
  return text;
}

void appendTextField(std::string& out, std::string_view text, std::size_t width) {
  out += text.substr(0, width);
  out.append(width - std::min(width, text.size()), '\0');
}

constexpr std::array<std::uint64_t, 256> crc64Table() {
  constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693;
  std::array<std::uint64_t, 256> table{};
  for (std::uint64_t byte = 0; byte < table.size(); ++byte) {
    std::uint64_t rest = byte << 56;
    for (int bit = 0; bit < 8; ++bit) rest = rest << 1 ^ (rest >> 63 ? kPolynomial : 0);
    table[byte] = rest;
  }
  return table;
}

IgtlReading readingWithout(std::string name, const char* why) { return {std::move(name), {}, why}; }

/// @param position_mm, axes as sent: the columns are the sensor's axes in the tracker's frame
IgtlReading readingOfMatrix(std::string name, const Eigen::Vector3d& position_mm, const Eigen::Matrix3d& axes) {
  // Loose enough for servers that print four decimals.
  constexpr double kUnitWithin = 2e-3;
  if (!axes.allFinite() || !position_mm.allFinite()) return readingWithout(std::move(name), kStatusDamaged);
  if (axes.isZero(0.0)) return readingWithout(std::move(name), kStatusMissing);
  const Eigen::Matrix3d products = axes.transpose() * axes;
  const Eigen::Vector3d lengths = products.diagonal().cwiseSqrt();
  if (axes.determinant() < 0.0) return readingWithout(std::move(name), kStatusMirrored);
  if ((lengths.array() - 1.0).abs().maxCoeff() > kUnitWithin) return readingWithout(std::move(name), kStatusScaled);
  if (std::max({std::abs(products(0, 1)), std::abs(products(0, 2)), std::abs(products(1, 2))}) > kUnitWithin) {
    return readingWithout(std::move(name), kStatusSheared);
  }
  return {std::move(name), {position_mm / kMillimetresPerMetre, Eigen::Quaterniond(axes).normalized()}, {}};
}

IgtlReading readingOfQuaternion(std::string name, const Eigen::Vector3d& position_mm, const Eigen::Vector4d& xyzw) {
  constexpr double kUnitWithin = 0.01;
  if (!xyzw.allFinite() || !position_mm.allFinite()) return readingWithout(std::move(name), kStatusDamaged);
  if (xyzw.isZero(0.0)) return readingWithout(std::move(name), kStatusMissing);
  if (std::abs(xyzw.norm() - 1.0) > kUnitWithin) return readingWithout(std::move(name), kStatusScaled);
  return {std::move(name), {position_mm / kMillimetresPerMetre, Eigen::Quaterniond(xyzw).normalized()}, {}};
}

IgtlReading matrixAt(std::string name, std::string_view bytes, std::size_t at) {
  Eigen::Matrix3d axes;
  for (int column = 0; column < 3; ++column) {
    axes.col(column) = vectorAt(bytes, at + kPositionBytes * static_cast<std::size_t>(column));
  }
  return readingOfMatrix(std::move(name), vectorAt(bytes, at + 3 * kPositionBytes), axes);
}

IgtlReading quaternionAt(std::string name, std::string_view bytes, std::size_t at) {
  Eigen::Vector4d xyzw;
  xyzw << vectorAt(bytes, at + kPositionBytes), floatAt(bytes, at + 2 * kPositionBytes);
  return readingOfQuaternion(std::move(name), vectorAt(bytes, at), xyzw);
}

using Readings = std::optional<std::vector<IgtlReading>>;

Readings readTransform(const IgtlHeader& header, std::string_view content) {
  if (content.size() != kMatrixBytes) return std::nullopt;
  return {{matrixAt(header.device, content, 0)}};
}

Readings readPosition(const IgtlHeader& header, std::string_view content) {
  if (content.size() == kPositionBytes + kQuaternionBytes) return {{quaternionAt(header.device, content, 0)}};
  if (content.size() == kPositionBytes) return {{readingWithout(header.device, kStatusNoOrientation)}};
  if (content.size() != 2 * kPositionBytes) return std::nullopt;
  // Three elements of a unit quaternion; the fourth follows, not negative.
  const Eigen::Vector3d xyz = vectorAt(content, kPositionBytes);
  Eigen::Vector4d xyzw;
  xyzw << xyz, std::sqrt(std::max(0.0, 1.0 - xyz.squaredNorm()));
  return {{readingOfQuaternion(header.device, vectorAt(content, 0), xyzw)}};
}

Readings readElements(std::string_view content, std::size_t pose_bytes,
                      IgtlReading (*poseAt)(std::string name, std::string_view bytes, std::size_t at)) {
  constexpr int kPositionOnly = 3;  // A 3D instrument: its orientation means nothing.
  const std::size_t element = kNameBytes + kKindBytes + pose_bytes;
  if (content.size() % element != 0) return std::nullopt;
  std::vector<IgtlReading> readings;
  for (std::size_t at = 0; at < content.size(); at += element) {
    std::string name = shownText(content.substr(at, kNameBytes));
    readings.push_back(content[at + kNameBytes] == kPositionOnly
                           ? readingWithout(std::move(name), kStatusNoOrientation)
                           : poseAt(std::move(name), content, at + kNameBytes + kKindBytes));
  }
  return readings;
}

Readings readTrackingData(const IgtlHeader&, std::string_view content) {
  return readElements(content, kMatrixBytes, matrixAt);
}

Readings readQuaternionData(const IgtlHeader&, std::string_view content) {
  return readElements(content, kPositionBytes + kQuaternionBytes, quaternionAt);
}

struct PoseTypeRow {
  const char* name;
  std::array<std::uint64_t, 3> lengths;  ///< Of the content; 0 = no further one.
  bool repeats;                          ///< Or a multiple of the first.
  Readings (*read)(const IgtlHeader& header, std::string_view content);
};
/// In the order of IgtlPoseType.
constexpr std::array<PoseTypeRow, kIgtlPoseTypes> kPoseTypes = {{{"TDATA", {70}, true, readTrackingData},
                                                                 {"QTDATA", {50}, true, readQuaternionData},
                                                                 {"TRANSFORM", {48}, false, readTransform},
                                                                 {"POSITION", {28, 24, 12}, false, readPosition}}};

/// What PLUS says of a tool whose pose is there.
bool isToolThere(std::string_view transform_status) {
  return transform_status.empty() || transform_status == "OK" ||
         (transform_status.starts_with("SWITCH") && transform_status.ends_with("_ON"));
}

std::string lowerCase(std::string_view text) {
  std::string lower;
  for (const char c : text) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

/// The value of a key of the metadata: all keys' sizes stand first, then keys and values in turn.
std::optional<std::string_view> metadataValue(std::string_view sizes, std::string_view texts, std::string_view wanted) {
  constexpr std::size_t kEntryBytes = 8;  // Key size, encoding, value size.
  if (sizes.size() < 2 || sizes.size() < 2 + kEntryBytes * bigEndian<std::uint16_t>(sizes, 0)) return std::nullopt;
  const std::size_t entries = bigEndian<std::uint16_t>(sizes, 0);
  std::size_t at = 0;
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t key_bytes = bigEndian<std::uint16_t>(sizes, 2 + kEntryBytes * i);
    const std::size_t value_bytes = bigEndian<std::uint32_t>(sizes, 6 + kEntryBytes * i);
    if (key_bytes + value_bytes > texts.size() - at) return std::nullopt;
    if (texts.substr(at, key_bytes) == wanted) return texts.substr(at + key_bytes, value_bytes);
    at += key_bytes + value_bytes;
  }
  return std::nullopt;
}

}  // namespace

std::optional<IgtlHeader> decodeIgtlHeader(std::string_view bytes) {
  constexpr int kNewestVersion = 3;
  if (bytes.size() < kIgtlHeaderBytes) return std::nullopt;
  IgtlHeader header;
  header.version = bigEndian<std::uint16_t>(bytes, 0);
  const auto type = textField(bytes.substr(2, kTypeBytes));
  const auto device = textField(bytes.substr(2 + kTypeBytes, kDeviceBytes));
  constexpr std::size_t kNumbers = 2 + kTypeBytes + kDeviceBytes;
  header.stamp = bigEndian<std::uint64_t>(bytes, kNumbers);
  header.body_bytes = bigEndian<std::uint64_t>(bytes, kNumbers + 8);
  header.crc = bigEndian<std::uint64_t>(bytes, kNumbers + 16);
  const bool plausible = header.version >= 1 && header.version <= kNewestVersion && type && !type->empty() && device &&
                         header.body_bytes <= std::numeric_limits<std::uint32_t>::max();
  if (!plausible) return std::nullopt;
  header.type = *type;
  header.device = *device;
  return header;
}

std::uint64_t igtlCrc(std::string_view bytes) {
  static constexpr std::array<std::uint64_t, 256> kTable = crc64Table();
  std::uint64_t crc = 0;
  for (const char c : bytes) crc = crc << 8 ^ kTable[(crc >> 56 ^ static_cast<unsigned char>(c)) & 0xFF];
  return crc;
}

double secondsOfIgtlStamp(std::uint64_t stamp) {
  // Seconds and fraction apart: together they have more digits than a double.
  return static_cast<double>(stamp >> 32) + static_cast<double>(stamp & 0xFFFFFFFF) / kStampsPerSecond;
}

std::uint64_t igtlStampOf(double seconds) {
  const double whole = std::floor(seconds);
  const auto fraction = static_cast<std::uint64_t>(std::llround((seconds - whole) * kStampsPerSecond));
  return (static_cast<std::uint64_t>(whole) << 32) + fraction;
}

std::optional<IgtlBody> splitIgtlBody(const IgtlHeader& header, std::string_view body) {
  constexpr std::size_t kExtendedBytes = 12;  // Its own size, those of the metadata, and a message number.
  if (header.version < 2) return IgtlBody{body, {}};
  if (body.size() < kExtendedBytes) return std::nullopt;
  const std::size_t extended_bytes = bigEndian<std::uint16_t>(body, 0);
  const std::size_t sizes_bytes = bigEndian<std::uint16_t>(body, 2);
  const std::size_t texts_bytes = bigEndian<std::uint32_t>(body, 4);
  const std::size_t around = extended_bytes + sizes_bytes + texts_bytes;
  if (extended_bytes < kExtendedBytes || around > body.size()) return std::nullopt;
  IgtlBody parts;
  parts.content = body.substr(extended_bytes, body.size() - around);
  const std::string_view metadata = body.substr(body.size() - sizes_bytes - texts_bytes);
  parts.transform_status =
      metadataValue(metadata.substr(0, sizes_bytes), metadata.substr(sizes_bytes), "TransformStatus").value_or("");
  return parts;
}

const char* nameOf(IgtlPoseType type) { return kPoseTypes[static_cast<std::size_t>(type)].name; }

std::optional<IgtlPoseType> igtlPoseType(std::string_view message_type) {
  for (std::size_t i = 0; i < kPoseTypes.size(); ++i) {
    if (message_type == kPoseTypes[i].name) return static_cast<IgtlPoseType>(i);
  }
  return std::nullopt;
}

bool igtlLengthFits(const IgtlHeader& header) {
  constexpr std::uint64_t kLongestBody = std::uint64_t{1} << 20;  // Thousands of sensors.
  const auto type = igtlPoseType(header.type);
  if (header.body_bytes > kLongestBody || !type || header.version > 1) return header.body_bytes <= kLongestBody;
  const PoseTypeRow& row = kPoseTypes[static_cast<std::size_t>(*type)];
  if (row.repeats) return header.body_bytes % row.lengths[0] == 0;
  return std::find(row.lengths.begin(), row.lengths.end(), header.body_bytes) != row.lengths.end() &&
         header.body_bytes > 0;
}

std::optional<std::vector<IgtlReading>> readingsOf(const IgtlHeader& header, std::string_view body) {
  const auto type = igtlPoseType(header.type);
  const auto parts = type ? splitIgtlBody(header, body) : std::nullopt;
  if (!parts) return std::nullopt;
  auto readings = kPoseTypes[static_cast<std::size_t>(*type)].read(header, parts->content);
  if (!readings || isToolThere(parts->transform_status)) return readings;
  for (IgtlReading& reading : *readings) {
    reading = {std::move(reading.name), {}, lowerCase(shownText(parts->transform_status))};
  }
  return readings;
}

std::string igtlStatusMeaning(const std::string& status) {
  if (status == kStatusMissing) return "the server sends no pose of it now";
  if (status == kStatusMirrored) return "its matrix mirrors, and no rigid motion does";
  if (status == kStatusScaled) return "its matrix or quaternion changes lengths, and no rigid motion does";
  if (status == kStatusSheared) return "the axes of its matrix are not perpendicular";
  if (status == kStatusNoOrientation) return "the server sends its position without an orientation";
  const std::string common = commonStatusMeaning(status);
  return common == status && !status.empty() ? "the server says " + status : common;
}

std::optional<IgtlServerStatus> serverStatusOf(const IgtlHeader& header, std::string_view body) {
  constexpr std::size_t kNameAt = 10, kMessageAt = kNameAt + kNameBytes;
  if (header.type != "STATUS") return std::nullopt;
  const auto parts = splitIgtlBody(header, body);
  if (!parts || parts->content.size() < kMessageAt) return std::nullopt;
  return IgtlServerStatus{bigEndian<std::uint16_t>(parts->content, 0),
                          shownText(parts->content.substr(kNameAt, kNameBytes)),
                          shownText(parts->content.substr(kMessageAt))};
}

std::string encodeIgtl(std::string_view type, std::string_view device, std::uint64_t stamp, std::string_view body) {
  std::string out;
  appendBigEndian(out, std::uint16_t{1});
  appendTextField(out, type, kTypeBytes);
  appendTextField(out, device, kDeviceBytes);
  appendBigEndian(out, stamp);
  appendBigEndian(out, static_cast<std::uint64_t>(body.size()));
  appendBigEndian(out, igtlCrc(body));
  out += body;
  return out;
}

std::string encodeTransformBody(const Pose& tracker_from_sensor) {
  const Eigen::Matrix3d axes = tracker_from_sensor.orientation.toRotationMatrix();
  std::string out;
  for (int column = 0; column < 3; ++column) appendVector(out, axes.col(column));
  appendVector(out, tracker_from_sensor.position_m * kMillimetresPerMetre);
  return out;
}

std::string encodePositionBody(const Pose& tracker_from_sensor) {
  std::string out;
  appendVector(out, tracker_from_sensor.position_m * kMillimetresPerMetre);
  for (int i = 0; i < 4; ++i) appendFloat(out, tracker_from_sensor.orientation.coeffs()[i]);
  return out;
}

namespace {

std::string encodeElements(const std::vector<IgtlReading>& readings, std::string (*encodePose)(const Pose&)) {
  constexpr char kSixDegrees = 2;
  std::string out;
  for (const IgtlReading& reading : readings) {
    appendTextField(out, reading.name, kNameBytes);
    out += {kSixDegrees, '\0'};
    out += encodePose(reading.tracker_from_sensor);
  }
  return out;
}

}  // namespace

std::string encodeTrackingBody(const std::vector<IgtlReading>& readings) {
  return encodeElements(readings, encodeTransformBody);
}

std::string encodeQuaternionTrackingBody(const std::vector<IgtlReading>& readings) {
  return encodeElements(readings, encodePositionBody);
}

std::string encodeServerStatusBody(const IgtlServerStatus& status) {
  std::string out;
  appendBigEndian(out, static_cast<std::uint16_t>(status.code));
  appendBigEndian(out, std::uint64_t{0});
  appendTextField(out, status.name, kNameBytes);
  return out + status.message + '\0';
}

std::string encodeStartTrackingBody() {
  constexpr std::size_t kFrameNameBytes = 32;
  std::string out;
  appendBigEndian(out, std::uint32_t{0});
  appendTextField(out, {}, kFrameNameBytes);
  return out;
}

}  // namespace fieldtrue::acquisition
