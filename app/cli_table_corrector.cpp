#include "app/cli_table_corrector.h"

#include <algorithm>
#include <charconv>
#include <ostream>
#include <utility>

#include "calib/core/file_io.h"
#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/tables/table_metadata.h"

namespace fieldtrue::cli {
namespace {

constexpr std::size_t kBatch = 4096;
constexpr std::array<const char*, 11> kAppended = {
    "x_corrected_m", "y_corrected_m", "z_corrected_m", "qw_corrected", "qx_corrected",
    "qy_corrected",  "qz_corrected",  "uncertainty_m", "covered",      "nearest_orientation_deg",
    "setup_matches"};

/// The number of a sensor as a table writes it; none where it is something else.
std::optional<int> sensorNumber(std::string_view text) {
  // Tables that passed through other programs write 1 as 1.0.
  if (const std::size_t point = text.find('.');
      point != std::string_view::npos && text.find_first_not_of('0', point + 1) == std::string_view::npos)
    text = text.substr(0, point);
  int sensor = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), sensor);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return sensor;
}

std::vector<Eigen::Vector3d> trackedPositions(const calibration::Corrector& corrector) {
  std::vector<Eigen::Vector3d> positions_m;
  for (const Node& node : corrector.table().nodes) positions_m.push_back(node.tracker_from_sensor.position_m);
  return positions_m;
}

bool isMissing(const CsvReader& reader, std::size_t column) {
  const std::optional<double> value = parseFinite(reader.field(column));
  return value && isMissingMark(*value);
}

}  // namespace

TableCorrector::TableCorrector(const calibration::Corrector& corrector, Setup stated, std::istream& in,
                               std::string name)
    : corrector_(corrector),
      orientations_seen_(corrector.orientationsSeen()),
      in_(in),
      name_(std::move(name)),
      units_(corrector.region(), trackedPositions(corrector)),
      setup_(corrector.setup(), std::move(stated)) {}

Result<void> TableCorrector::run(std::ostream& out) {
  // Between rows the order of rows and remarks is kept by emptying the batch first.
  const auto passOver = [this, &out](std::string_view line) {
    flush(out);
    out << line << '\n';
  };
  auto opened = CsvReader::open(in_, name_, ',', CsvHeader::kLooseRow, passOver);
  if (!opened) return tl::unexpected(opened.error());
  reader_.emplace(*std::move(opened));
  FT_TRY_VOID(takeHeader(out));
  while (true) {
    FT_TRY(const bool more, reader_->next());
    if (!more) break;
    FT_TRY_VOID(takeRow());
    if (rows_.size() == kBatch) flush(out);
  }
  flush(out);
  return {};
}

std::vector<std::string> TableCorrector::notes() const {
  if (!reader_) return {};
  std::vector<std::string> notes = notesOnMetadata(*reader_);
  for (const auto& note : {reader_->noteOnLateMetadata(), reader_->noteOnLastLine()})
    if (note) notes.push_back(*note);
  return notes;
}

Result<void> TableCorrector::takeHeader(std::ostream& out) {
  static constexpr std::array<std::string_view, 3> kPosition = {"x_m", "y_m", "z_m"};
  static constexpr std::array<std::string_view, 4> kOrientation = {"qw", "qx", "qy", "qz"};
  for (const char* appended : kAppended) {
    if (!reader_->find(appended)) continue;
    reader_->failInLine("column " + std::string(appended) + " is there already; remove it first");
    return tl::unexpected(*reader_->error());
  }
  Columns columns;
  FT_TRY(columns.position, reader_->require(kPosition));
  FT_TRY(columns.orientation, reader_->group(kOrientation));
  columns.status = reader_->find("status");
  columns.sensor = reader_->find("sensor");
  columns_ = std::move(columns);
  for (const CsvReader::MetadataLine& line : reader_->metadata()) setup_.readHead(line.key, line.value);
  out << reader_->text();
  for (const char* appended : kAppended) out << ',' << appended;
  out << '\n';
  return {};
}

std::optional<TableCorrector::Reading> TableCorrector::reading() {
  Reading reading;
  bool is_missing = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t column = columns_->position[axis];
    reading.pose.position_m[static_cast<Eigen::Index>(axis)] = reader_->number(column);
    is_missing = is_missing || isMissing(*reader_, column);
  }
  const auto& q = columns_->orientation;
  if (q && std::any_of(q->begin(), q->end(), [&](std::size_t column) { return isMissing(*reader_, column); })) {
    is_missing = true;
  } else if (const auto orientation = reader_->quaternion(q)) {
    reading.pose.orientation = orientation->normalized();
    reading.is_turned = true;
  }
  return is_missing || reader_->error() ? std::nullopt : std::optional(reading);
}

Result<void> TableCorrector::takeRow() {
  const bool marked = columns_->status && !reader_->isBlank(*columns_->status);
  const std::optional<Reading> read = reading();
  // A reading the tracker itself marked may hold anything; it is kept, and corrected only when it is a pose.
  if (marked) reader_->forgetError();
  if (reader_->error()) return tl::unexpected(*reader_->error());
  const std::string_view sensor = columns_->sensor ? reader_->field(*columns_->sensor) : std::string_view();
  PendingRow row{reader_->text(), std::nullopt, setup_.ofRow(sensor)};
  if (read) {
    row.pose = poses_.size();
    if (!marked) units_.add(read->pose.position_m);
    poses_.push_back(read->pose);
    turned_.push_back(read->is_turned);
    if (!turned_.back()) ++counts_.unturned;
    sensors_.push_back(sensorNumber(sensor));
    const auto& apart = corrector_.parts().by_sensor;
    if (!apart.empty() && !(sensors_.back() && apart.contains(*sensors_.back()))) ++counts_.other_sensor;
  }
  rows_.push_back(std::move(row));
  return {};
}

void TableCorrector::flush(std::ostream& out) {
  std::vector<Pose> corrected(poses_.size());
  corrector_.correct(poses_, corrected, sensors_);
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (!turned_[i] && corrector_.takesOrientation())
      corrected[i].position_m = corrector_.correctPosition_m(poses_[i].position_m, sensors_[i]);
  for (const PendingRow& row : rows_) {
    out << row.text;
    if (row.pose) {
      writeCorrected(out, {poses_[*row.pose], turned_[*row.pose]}, corrected[*row.pose], sensors_[*row.pose]);
    } else {
      out << ",,,,,,,,,0,";
      ++counts_.lost;
    }
    out << ',' << nameOf(row.setup) << '\n';
    if (row.setup == SetupMatch::kNo) ++counts_.other_setup;
  }
  counts_.all += rows_.size();
  rows_.clear();
  poses_.clear();
  turned_.clear();
  sensors_.clear();
}

void TableCorrector::writeCorrected(std::ostream& out, const Reading& reading, const Pose& corrected,
                                    std::optional<int> sensor) {
  const auto& [tracked, is_turned] = reading;
  for (const double value : corrected.position_m) out << ',' << formatNumber(value);
  if (is_turned) {
    const Eigen::Quaterniond q = canonical(corrected.orientation);
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) out << ',' << formatNumber(value);
  } else {
    out << ",,,,";
  }
  out << ',';
  const auto uncertainty_m =
      is_turned ? corrector_.uncertaintyAt_m(tracked, sensor) : corrector_.uncertainty_m(tracked.position_m, sensor);
  if (uncertainty_m) out << formatNumber(*uncertainty_m);
  const bool covered = corrector_.covers(tracked.position_m, sensor);
  if (!covered) ++counts_.outside;
  out << ',' << (covered ? 1 : 0) << ',';
  if (is_turned && !orientations_seen_.empty()) out << formatNumber(nearestOrientation_deg(tracked));
}

double TableCorrector::nearestOrientation_deg(const Pose& tracked) const {
  double nearest_rad = kPi;
  for (const Eigen::Quaterniond& seen : orientations_seen_)
    nearest_rad = std::min(nearest_rad, angleBetween_rad(seen, tracked.orientation));
  return kDegPerRad * nearest_rad;
}

}  // namespace fieldtrue::cli
