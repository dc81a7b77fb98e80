#include "acquisition/protocols/flock.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fieldtrue::acquisition {
namespace {

constexpr unsigned char kPhasing = 0x80;
constexpr double kHalfTurn_deg = 180.0;

constexpr FlockMode kModes[] = {
    {"position", 'V', 1, true, FlockOrientation::kNone, 3},
    {"angles", 'W', 2, false, FlockOrientation::kAngles, 3},
    {"matrix", 'X', 3, false, FlockOrientation::kMatrix, 9},
    {"position_angles", 'Y', 4, true, FlockOrientation::kAngles, 6},
    {"position_matrix", 'Z', 5, true, FlockOrientation::kMatrix, 12},
    {"quaternion", '\\', 7, false, FlockOrientation::kQuaternion, 4},
    {"position_quaternion", ']', 8, true, FlockOrientation::kQuaternion, 7},
};

const FlockMode* modeWhere(auto&& holds) {
  const auto row = std::find_if(std::begin(kModes), std::end(kModes), holds);
  return row == std::end(kModes) ? nullptr : row;
}

/// The pose in the frame that is mirrored in one axis, S p and S R S with S the mirror, in every form that is there. Of
/// a rotation's axis, a pseudo-vector, the part along the mirrored axis stays and the others turn over.
void mirror(PoseNumbers& numbers, char axis) {
  if (axis == 0) return;
  const Eigen::Index turned = axis - 'x';
  if (numbers.position_m) (*numbers.position_m)[turned] *= -1.0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (numbers.quaternion_wxyz && i != turned) (*numbers.quaternion_wxyz)[i + 1] *= -1.0;
    // Angles stand in the order z, y, x.
    if (numbers.euler_deg && i != turned) (*numbers.euler_deg)[2 - i] *= -1.0;
    auto& row = numbers.direction_cosines[static_cast<std::size_t>(i)];
    if (!row) continue;
    if (i == turned) *row = -*row;
    (*row)[turned] *= -1.0;
  }
}

std::vector<double> partsOf(const Pose& reported, const FlockLayout& layout) {
  PoseNumbers numbers = numbersOfPose(reported);
  mirror(numbers, layout.conventions.mirrored);
  std::vector<double> parts;
  parts.reserve(layout.mode->words);
  if (layout.mode->position) {
    for (const double x_m : *numbers.position_m) parts.push_back(x_m / layout.range_m);
  }
  switch (layout.mode->orientation) {
    case FlockOrientation::kNone:
      break;
    case FlockOrientation::kAngles:
      for (const double angle_deg : *numbers.euler_deg) parts.push_back(angle_deg / kHalfTurn_deg);
      break;
    case FlockOrientation::kMatrix:
      for (std::size_t i = 0; i < 9; ++i) {
        const std::size_t row = layout.conventions.matrix_by_columns ? i % 3 : i / 3;
        const std::size_t column = layout.conventions.matrix_by_columns ? i / 3 : i % 3;
        parts.push_back((*numbers.direction_cosines[row])[static_cast<Eigen::Index>(column)]);
      }
      break;
    case FlockOrientation::kQuaternion:
      const double sign = layout.conventions.inverted_quaternion ? -1.0 : 1.0;
      const Eigen::Vector4d& q = *numbers.quaternion_wxyz;
      parts.insert(parts.end(), {q[0], sign * q[1], sign * q[2], sign * q[3]});
      break;
  }
  return parts;
}

using Parts = std::span<const double>;

void readOrientation(Parts parts, const FlockLayout& layout, PoseNumbers& pose) {
  switch (layout.mode->orientation) {
    case FlockOrientation::kNone:
      return;
    case FlockOrientation::kAngles:
      pose.euler_deg = kHalfTurn_deg * Eigen::Vector3d(parts[0], parts[1], parts[2]);
      return;
    case FlockOrientation::kMatrix:
      for (std::size_t row = 0; row < 3; ++row) {
        const bool by_columns = layout.conventions.matrix_by_columns;
        const std::size_t first = by_columns ? row : 3 * row;
        const std::size_t step = by_columns ? 3 : 1;
        pose.direction_cosines[row] = Eigen::Vector3d(parts[first], parts[first + step], parts[first + 2 * step]);
      }
      return;
    case FlockOrientation::kQuaternion:
      const double sign = layout.conventions.inverted_quaternion ? -1.0 : 1.0;
      pose.quaternion_wxyz = Eigen::Vector4d(parts[0], sign * parts[1], sign * parts[2], sign * parts[3]);
      return;
  }
}

unsigned char byteAt(std::string_view bytes, std::size_t i) { return static_cast<unsigned char>(bytes[i]); }

bool isPhased(std::string_view bytes, std::size_t length) {
  for (std::size_t i = 0; i < std::min(bytes.size(), length); ++i) {
    if (((byteAt(bytes, i) & kPhasing) != 0) != (i == 0)) return false;
  }
  return true;
}

}  // namespace

std::span<const FlockMode> flockModes() { return kModes; }

const FlockMode* findFlockMode(std::string_view id) {
  return modeWhere([id](const FlockMode& mode) { return mode.id == id; });
}

const FlockMode* findFlockMode(char command) {
  return modeWhere([command](const FlockMode& mode) { return mode.command == command; });
}

std::string encodeFlockWord(double part) {
  const long steps = std::clamp(std::lround(part / kFlockStep), -8192L, 8191L);
  const auto word = static_cast<unsigned>(steps) & 0x3FFFu;
  return {static_cast<char>(word & 0x7Fu), static_cast<char>(word >> 7)};
}

double decodeFlockWord(unsigned char low, unsigned char high) {
  const int word = (high & 0x7F) << 7 | (low & 0x7F);
  return (word >= 0x2000 ? word - 0x4000 : word) * kFlockStep;
}

std::string encodeFlockRecord(int address, const Pose& tracker_from_sensor, const FlockLayout& layout) {
  std::string record;
  for (const double part : partsOf(tracker_from_sensor, layout)) record += encodeFlockWord(part);
  record.front() = static_cast<char>(byteAt(record, 0) | kPhasing);
  if (layout.group) record += static_cast<char>(address);
  return record;
}

std::optional<FlockRecord> decodeFlockRecord(std::string_view bytes, const FlockLayout& layout) {
  constexpr std::size_t kMostWords = 12;
  if (bytes.size() != layout.bytes() || !isPhased(bytes, bytes.size())) return std::nullopt;
  std::array<double, kMostWords> words{};
  for (std::size_t i = 0; i < layout.mode->words; ++i) {
    words[i] = decodeFlockWord(byteAt(bytes, 2 * i), byteAt(bytes, 2 * i + 1));
  }
  FlockRecord record;
  if (layout.group) record.address = byteAt(bytes, bytes.size() - 1);
  if (record.address < 1) return std::nullopt;
  Parts parts(words);
  if (layout.mode->position) {
    record.pose.position_m = layout.range_m * Eigen::Vector3d(parts[0], parts[1], parts[2]);
    parts = parts.subspan(3);
  }
  readOrientation(parts, layout, record.pose);
  mirror(record.pose, layout.conventions.mirrored);
  return record;
}

Sample toSample(const FlockRecord& record, int sensor) { return sampleOfNumbers(record.pose, sensor, {}); }

FlockParser::FlockParser(FlockStreamSettings settings) : settings_(std::move(settings)) {
  FT_CHECK(settings_.layout.mode != nullptr && settings_.records_to_lock >= 1 && !settings_.sensors.empty());
}

void FlockParser::add(std::string_view bytes, std::vector<Reading>& out) {
  finder_.add(bytes, [&](std::string_view rest) { return take(rest, out); });
}

FrameMatch FlockParser::match(std::string_view rest) const {
  const std::size_t length = settings_.layout.bytes();
  if (!isPhased(rest, length)) return FrameMatch::none();
  if (rest.size() < length) return FrameMatch::more();
  if (settings_.layout.group && !settings_.sensors.contains(byteAt(rest, length - 1))) return FrameMatch::none();
  return FrameMatch::frame(length);
}

FrameMatch FlockParser::take(std::string_view rest, std::vector<Reading>& out) {
  const FrameMatch first = match(rest);
  if (first.kind != FrameMatch::Kind::kFrame) {
    locked_ = locked_ && first.kind == FrameMatch::Kind::kMore;
    return first;
  }
  for (int i = 1; !locked_ && i < settings_.records_to_lock; ++i) {
    const std::size_t at = static_cast<std::size_t>(i) * first.length;
    const FrameMatch next = rest.size() <= at ? FrameMatch::more() : match(rest.substr(at));
    if (next.kind != FrameMatch::Kind::kFrame) return next;
  }
  locked_ = true;
  read(rest.substr(0, first.length), out);
  return first;
}

void FlockParser::read(std::string_view record, std::vector<Reading>& out) {
  const FlockRecord decoded = *decodeFlockRecord(record, settings_.layout);
  const int address = settings_.layout.group ? decoded.address : settings_.sensors.begin()->first;
  const int sensor = settings_.sensors.at(address);
  if (sensor < 0) return;
  Said& last = last_[address];
  const bool repeated = settings_.drop_repeats && last.record == record;
  last.record = record;
  last.repeats = repeated ? last.repeats + 1 : 0;
  repeats_ += repeated ? 1 : 0;
  // Once stuck it is said again and again, so that a reader sees that the line is alive.
  const bool stuck = last.repeats >= kFlockStuckRecords;
  if (repeated && !stuck) return;
  out.push_back({toSample(decoded, sensor), std::nullopt});
  if (stuck) out.back().sample.status = kStatusStuck;
}

}  // namespace fieldtrue::acquisition
