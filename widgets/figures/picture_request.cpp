#include "widgets/figures/picture_request.h"

#include <QDataStream>
#include <QIODevice>
#include <type_traits>

namespace fieldtrue::widgets {
namespace {

/// Writes or reads what a `describe` names, so that each value is described once for both ways.
class Archive {
 public:
  explicit Archive(QByteArray* to) : stream_(to, QIODevice::WriteOnly), writes_(true) {}
  explicit Archive(const QByteArray& from) : stream_(from) {}

  bool good() const { return stream_.status() == QDataStream::Ok; }
  bool atEnd() const { return stream_.atEnd(); }
  bool writes() const { return writes_; }
  void refuse() { stream_.setStatus(QDataStream::ReadCorruptData); }

  template <class... Values>
  void operator()(Values&... values) {
    (pass(values), ...);
  }

 private:
  template <class Value>
  void pass(Value& value) {
    if constexpr (std::is_enum_v<Value>) {
      auto number = static_cast<qint32>(value);
      plain(number);
      value = static_cast<Value>(number);
    } else if constexpr (std::is_arithmetic_v<Value> || std::is_same_v<Value, QString> ||
                         std::is_same_v<Value, QByteArray>) {
      plain(value);
    } else {
      describe(*this, value);
    }
  }

  template <class Value>
  void plain(Value& value) {
    if (writes_)
      stream_ << value;
    else
      stream_ >> value;
  }

  QDataStream stream_;
  bool writes_ = false;
};

template <int kRows, int kColumns>
void describe(Archive& a, Eigen::Matrix<double, kRows, kColumns>& matrix) {
  for (double& value : matrix.reshaped()) a(value);
}

void describe(Archive& a, std::string& text) {
  QByteArray bytes = QByteArray::fromStdString(text);
  a(bytes);
  text = bytes.toStdString();
}

template <class Value, std::size_t kSize>
void describe(Archive& a, std::array<Value, kSize>& values) {
  for (Value& value : values) a(value);
}

template <class Value>
void describe(Archive& a, std::optional<Value>& value) {
  bool is_there = value.has_value();
  a(is_there);
  if (!is_there) return value.reset();
  if (!value) value.emplace();
  a(*value);
}

template <class Value>
void describe(Archive& a, std::vector<Value>& values) {
  auto size = static_cast<quint32>(values.size());
  a(size);
  // One after the other: a damaged size must not reserve what is not there.
  if (!a.writes()) values.clear();
  for (quint32 i = 0; i < size && a.good(); ++i) {
    if (!a.writes()) values.emplace_back();
    a(values[i]);
  }
}

void describe(Archive& a, Pose& pose) { a(pose.position_m, pose.orientation.coeffs()); }

void describe(Archive& a, BelievedBody& body) {
  a(body.shape, body.name, body.center_m, body.normal, body.side, body.radius_m, body.length_m, body.width_m,
    body.region_m, body.nearest_m, body.farthest_m);
}

void describe(Archive& a, FieldArrow& arrow) {
  a(arrow.from_m, arrow.error_m, arrow.node, arrow.angle_deg, arrow.validation, arrow.flagged, arrow.uncertainty_mm,
    arrow.better_mm, arrow.rotation_axis, arrow.name);
}

void describe(Archive& a, ErrorField& field) {
  a(field.title, field.arrows, field.reference_from_tracker, field.bodies);
}

void describe(Archive& a, FieldPicture& picture) { a(picture.field, picture.scale_max_mm, picture.magnification); }

void describe(Archive& a, HistogramPicture& picture) { a(picture.names, picture.values_mm, picture.axis_title); }

void describe(Archive& a, PlannedPlace& place) {
  a(place.node, place.visit, place.index, place.reference_from_sensor, place.role);
}

void describe(Archive& a, RoomPicture& picture) { a(picture.places, picture.states, picture.reference_from_tracker); }

template <class... Kinds>
void describe(Archive& a, std::variant<Kinds...>& content) {
  auto kind = static_cast<quint32>(content.index());
  a(kind);
  if (kind >= sizeof...(Kinds)) return a.refuse();
  quint32 next = 0;
  const auto pass = [&]<class Kind>(std::type_identity<Kind>) {
    if (next++ != kind) return;
    if (!a.writes()) content = Kind{};
    a(std::get<Kind>(content));
  };
  (pass(std::type_identity<Kinds>{}), ...);
}

void describe(Archive& a, PictureRequest& request) {
  a(request.content, request.width_px, request.height_px, request.dark);
}

void describe(Archive& a, Result<QByteArray>& drawn) {
  bool is_drawn = drawn.has_value();
  QByteArray content = drawn ? *drawn : QByteArray::fromStdString(drawn.error().message);
  a(is_drawn, content);
  if (is_drawn)
    drawn = content;
  else
    drawn = fail(ErrorCode::kUnsupported, content.toStdString());
}

const QByteArray kVersion = QByteArrayLiteral("fieldtrue pictures " FIELDTRUE_VERSION);

template <class Value>
QByteArray written(std::span<const Value> values) {
  QByteArray bytes, version = kVersion;
  Archive archive(&bytes);
  std::vector<Value> copy(values.begin(), values.end());
  archive(version, copy);
  return bytes;
}

template <class Value>
Result<std::vector<Value>> read(const QByteArray& bytes) {
  Archive archive(bytes);
  QByteArray version;
  std::vector<Value> values;
  archive(version);
  if (version != kVersion) {
    return fail(ErrorCode::kBadInput, std::string("fieldtrue-pictures and this program are not of one version (") +
                                          FIELDTRUE_VERSION + " is needed)");
  }
  archive(values);
  if (!archive.good() || !archive.atEnd()) return fail(ErrorCode::kBadInput, "what fieldtrue-pictures was told is cut");
  return values;
}

}  // namespace

QByteArray toBytes(std::span<const PictureRequest> requests) { return written(requests); }
QByteArray toBytes(std::span<const Result<QByteArray>> drawn) { return written(drawn); }

Result<std::vector<PictureRequest>> requestsFromBytes(const QByteArray& bytes) { return read<PictureRequest>(bytes); }

Result<std::vector<Result<QByteArray>>> picturesFromBytes(const QByteArray& bytes) {
  return read<Result<QByteArray>>(bytes);
}

}  // namespace fieldtrue::widgets
