#include "acquisition/protocols/fastrak_items.h"

#include <algorithm>

namespace fieldtrue::acquisition {
namespace {

Eigen::Vector3d vector3(const double* v) { return {v[0], v[1], v[2]}; }

void copy3(const std::optional<Eigen::Vector3d>& from, double* to, double scale) {
  const Eigen::Vector3d v = from.value_or(Eigen::Vector3d::Zero()) / scale;
  std::copy(v.data(), v.data() + 3, to);
}

void storePosition(FastrakRecord& r, const double* v, double scale) { r.position_m = vector3(v) * scale; }
void loadPosition(const FastrakRecord& r, double* v, double scale) { copy3(r.position_m, v, scale); }
void storeRelative(FastrakRecord& r, const double* v, double scale) { r.relative_m = vector3(v) * scale; }
void loadRelative(const FastrakRecord& r, double* v, double scale) { copy3(r.relative_m, v, scale); }
void storeEuler(FastrakRecord& r, const double* v, double) { r.euler_deg = vector3(v); }
void loadEuler(const FastrakRecord& r, double* v, double) { copy3(r.euler_deg, v, 1.0); }
template <std::size_t kRow>
void storeCosines(FastrakRecord& r, const double* v, double) {
  r.direction_cosines[kRow] = vector3(v);
}
template <std::size_t kRow>
void loadCosines(const FastrakRecord& r, double* v, double) {
  copy3(r.direction_cosines[kRow], v, 1.0);
}
void storeQuaternion(FastrakRecord& r, const double* v, double) {
  r.quaternion_wxyz = Eigen::Vector4d(v[0], v[1], v[2], v[3]);
}
void loadQuaternion(const FastrakRecord& r, double* v, double) {
  const Eigen::Vector4d q = r.quaternion_wxyz.value_or(Eigen::Vector4d::Zero());
  std::copy(q.data(), q.data() + 4, v);
}
void storeStylus(FastrakRecord& r, const double* v, double) { r.stylus_pressed = v[0] != 0.0; }
void loadStylus(const FastrakRecord& r, double* v, double) { v[0] = r.stylus_pressed.value_or(false) ? 1.0 : 0.0; }

constexpr FastrakItem value(int id, const char* name, int values, int decimals, bool extended, double packed_scale,
                            decltype(FastrakItem::store) store, decltype(FastrakItem::load) load) {
  return {id, name, {}, values, decimals, extended, packed_scale, store, load};
}

constexpr FastrakItem literal(int id, const char* name, std::string_view bytes) {
  return {id, name, bytes, 0, 0, false, 0.0, nullptr, nullptr};
}

/// Two-byte items follow the InterSense IS-900 guide (Fastrak emulation): full scale 3 m, 180 deg and 1.
constexpr double kPackedPosition_m = 3.0;
constexpr double kPackedAngle_deg = 180.0;

constexpr FastrakItem kItems[] = {
    literal(0, "space", " "),
    literal(1, "carriage return, line feed", "\r\n"),
    value(2, "position", 3, 2, false, 0.0, storePosition, loadPosition),
    value(3, "relative movement", 3, 2, false, 0.0, storeRelative, loadRelative),
    value(4, "azimuth, elevation, roll", 3, 2, false, 0.0, storeEuler, loadEuler),
    value(5, "X direction cosines", 3, 4, false, 0.0, storeCosines<0>, loadCosines<0>),
    value(6, "Y direction cosines", 3, 4, false, 0.0, storeCosines<1>, loadCosines<1>),
    value(7, "Z direction cosines", 3, 4, false, 0.0, storeCosines<2>, loadCosines<2>),
    value(11, "quaternion", 4, 4, false, 0.0, storeQuaternion, loadQuaternion),
    value(16, "stylus switch", 1, 0, false, 0.0, storeStylus, loadStylus),
    value(18, "position, two bytes", 3, 0, false, kPackedPosition_m, storePosition, loadPosition),
    value(19, "azimuth, elevation, roll, two bytes", 3, 0, false, kPackedAngle_deg, storeEuler, loadEuler),
    value(20, "quaternion, two bytes", 4, 0, false, 1.0, storeQuaternion, loadQuaternion),
    literal(50, "space", " "),
    literal(51, "carriage return, line feed", "\r\n"),
    value(52, "position, extended", 3, 0, true, 0.0, storePosition, loadPosition),
    value(53, "relative movement, extended", 3, 0, true, 0.0, storeRelative, loadRelative),
    value(54, "azimuth, elevation, roll, extended", 3, 0, true, 0.0, storeEuler, loadEuler),
    value(55, "X direction cosines, extended", 3, 0, true, 0.0, storeCosines<0>, loadCosines<0>),
    value(56, "Y direction cosines, extended", 3, 0, true, 0.0, storeCosines<1>, loadCosines<1>),
    value(57, "Z direction cosines, extended", 3, 0, true, 0.0, storeCosines<2>, loadCosines<2>),
    value(61, "quaternion, extended", 4, 0, true, 0.0, storeQuaternion, loadQuaternion),
    value(66, "stylus switch", 1, 0, false, 0.0, storeStylus, loadStylus),
};

}  // namespace

double metresPer(FastrakUnit unit) { return unit == FastrakUnit::kInch ? 0.0254 : 0.01; }

std::span<const FastrakItem> fastrakItems() { return kItems; }

const FastrakItem* findFastrakItem(int id) {
  const auto found =
      std::find_if(std::begin(kItems), std::end(kItems), [id](const auto& item) { return item.id == id; });
  return found == std::end(kItems) ? nullptr : &*found;
}

std::optional<std::size_t> itemWidth(const FastrakItem& item, FastrakFormat format) {
  if (!item.literal.empty()) return item.literal.size();
  const auto n = static_cast<std::size_t>(item.values);
  if (item.store == storeStylus) return 2;
  if (item.packed_scale > 0.0) return format == FastrakFormat::kBinary ? std::optional(2 * n) : std::nullopt;
  if (format == FastrakFormat::kBinary) return 4 * n;
  return (item.extended ? 13 : 7) * n;
}

Result<FastrakLayout> fastrakLayout(std::span<const int> items, FastrakFormat format) {
  constexpr std::size_t kMaxItems = 32;
  constexpr std::size_t kMaxBytes = 254;
  if (items.size() > kMaxItems) {
    return fail(ErrorCode::kBadInput,
                "A Fastrak output list holds at most 32 items, got " + std::to_string(items.size()));
  }
  FastrakLayout layout;
  layout.format = format;
  for (const int id : items) {
    const FastrakItem* item = findFastrakItem(id);
    if (!item) return fail(ErrorCode::kBadInput, "Fastrak has no output item " + std::to_string(id));
    const auto width = itemWidth(*item, format);
    if (!width) {
      return fail(ErrorCode::kBadInput,
                  "Fastrak output item " + std::to_string(id) + " exists in the binary format only");
    }
    layout.fields.push_back({item, layout.bytes, *width});
    layout.bytes += *width;
  }
  if (layout.bytes > kMaxBytes) {
    return fail(ErrorCode::kBadInput,
                "A Fastrak record holds at most 254 bytes, this list needs " + std::to_string(layout.bytes));
  }
  return layout;
}

FastrakRecord recordOfPose(int station, char error, const Pose& tracker_from_sensor, bool stylus_pressed) {
  FastrakRecord record;
  static_cast<PoseNumbers&>(record) = numbersOfPose(tracker_from_sensor);
  record.station = station;
  record.error = error;
  record.relative_m = Eigen::Vector3d::Zero();
  record.stylus_pressed = stylus_pressed;
  return record;
}

Sample toSample(const FastrakRecord& record, double time_s) {
  Sample sample =
      sampleOfNumbers(record, record.station - 1, record.error == ' ' ? std::string() : std::string(1, record.error));
  sample.time_s = time_s;
  return sample;
}

}  // namespace fieldtrue::acquisition
