#include "app/cli_table_corrector.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ostream>
#include <utility>

#include "calib/core/file_io.h"
#include "calib/core/statistics.h"
#include "calib/core/trimmed.h"
#include "calib/core/units.h"

namespace fieldtrue::cli {
namespace {

constexpr std::size_t kBatch = 4096;
constexpr std::array<const char*, 11> kAppended = {
    "x_corrected_m", "y_corrected_m", "z_corrected_m", "qw_corrected", "qx_corrected",
    "qy_corrected",  "qz_corrected",  "uncertainty_m", "covered",      "nearest_orientation_deg",
    "setup_matches"};

/// The fields of one line; commas inside double quotes do not separate.
std::vector<std::string_view> splitFields(std::string_view line) {
  std::vector<std::string_view> fields;
  std::size_t start = 0;
  bool quoted = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') quoted = !quoted;
    if (i < line.size() && (quoted || line[i] != ',')) continue;
    fields.push_back(line.substr(start, i - start));
    start = i + 1;
  }
  return fields;
}

constexpr std::string_view kBlankOrQuote = " \t\"";

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

std::optional<std::size_t> find(const std::vector<std::string>& names, std::string_view name) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return i;
  }
  return std::nullopt;
}

bool isBlank(const std::vector<std::string_view>& fields, std::size_t column) {
  return trimmed(fields[column], kBlankOrQuote).empty();
}

}  // namespace

TableCorrector::TableCorrector(const calibration::Corrector& corrector, Setup stated, std::istream& in,
                               std::string name)
    : corrector_(corrector),
      orientations_seen_(corrector.orientationsSeen()),
      lines_(in, std::move(name)),
      units_(corrector.region(), trackedPositions(corrector)),
      setup_(corrector.setup(), std::move(stated)) {}

Result<void> TableCorrector::run(std::ostream& out) {
  while (true) {
    const Result<bool> more = lines_.next(line_);
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
    if (line_.empty() || line_.front() == '#') {
      // Between rows the order of rows and remarks is kept by emptying the batch first.
      flush(out);
      if (!columns_ && !line_.empty()) setup_.readHead(line_);
      out << line_ << '\n';
      continue;
    }
    const Result<void> taken = columns_ ? takeRow() : takeHeader(out);
    if (!taken) return taken;
    if (rows_.size() == kBatch) flush(out);
  }
  if (!columns_)
    return fail(ErrorCode::kBadInput, lines_.name() + " has no header row; columns x_m, y_m, z_m are needed");
  flush(out);
  return {};
}

tl::unexpected<Error> TableCorrector::bad(const std::string& what) const {
  return fail(ErrorCode::kBadInput, lines_.name() + " line " + std::to_string(lines_.number()) + what);
}

Result<void> TableCorrector::takeHeader(std::ostream& out) {
  std::vector<std::string> names;
  for (const std::string_view field : splitFields(line_)) names.emplace_back(trimmed(field, kBlankOrQuote));
  for (const std::string& name : names) {
    if (std::count(names.begin(), names.end(), name) > 1) return bad(": column " + name + " stands there twice");
  }
  for (const char* appended : kAppended) {
    if (find(names, appended)) return bad(": column " + std::string(appended) + " is there already; remove it first");
  }
  Columns columns;
  columns.count = names.size();
  constexpr std::array kPosition = {"x_m", "y_m", "z_m"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto index = find(names, kPosition[axis]);
    if (!index) return bad(": column " + std::string(kPosition[axis]) + " is missing");
    columns.position[axis] = *index;
  }
  const auto orientation = findOrientation(names);
  if (!orientation) return tl::unexpected(orientation.error());
  columns.orientation = *orientation;
  columns.status = find(names, "status");
  columns.sensor = find(names, "sensor");
  columns_ = columns;
  names_ = std::move(names);
  out << line_;
  for (const char* appended : kAppended) out << ',' << appended;
  out << '\n';
  return {};
}

Result<std::optional<std::array<std::size_t, 4>>> TableCorrector::findOrientation(
    const std::vector<std::string>& names) const {
  constexpr std::array kOrientation = {"qw", "qx", "qy", "qz"};
  std::array<std::size_t, 4> indices{};
  std::string missing;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto index = find(names, kOrientation[i]);
    if (index) indices[i] = *index;
    if (!index) missing += (missing.empty() ? "" : ", ") + std::string(kOrientation[i]);
  }
  if (missing.empty()) return std::optional(indices);
  if (missing == "qw, qx, qy, qz") return std::optional<std::array<std::size_t, 4>>();
  return bad(": an orientation needs qw, qx, qy and qz; missing: " + missing);
}

Result<double> TableCorrector::number(const Fields& fields, std::size_t column) const {
  std::string_view text = trimmed(fields[column], kBlankOrQuote);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size() && std::isfinite(value)) return value;
  return bad(", column " + names_[column] + ": '" + std::string(text) + "' is not a finite number");
}

Result<std::optional<TableCorrector::Reading>> TableCorrector::reading(const Fields& fields) const {
  Reading reading;
  bool is_missing = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    FT_TRY(const double value_m, number(fields, columns_->position[axis]));
    reading.pose.position_m[static_cast<Eigen::Index>(axis)] = value_m;
    is_missing = is_missing || isMissingMark(value_m);
  }
  const auto& q = columns_->orientation;
  reading.is_turned =
      q && !std::all_of(q->begin(), q->end(), [&](std::size_t column) { return isBlank(fields, column); });
  if (reading.is_turned) {
    std::array<double, 4> parts{};
    for (std::size_t i = 0; i < 4; ++i) {
      FT_TRY(parts[i], number(fields, (*q)[i]));
      is_missing = is_missing || isMissingMark(parts[i]);
    }
    const Eigen::Quaterniond orientation(parts[0], parts[1], parts[2], parts[3]);
    if (!(orientation.norm() > 1e-6)) return bad(", columns qw to qz: the quaternion is zero");
    reading.pose.orientation = orientation.normalized();
  }
  return is_missing ? std::nullopt : std::optional(reading);
}

Result<void> TableCorrector::takeRow() {
  const Fields fields = splitFields(line_);
  if (fields.size() != columns_->count) {
    return bad(" has " + std::to_string(fields.size()) + " fields, the header has " + std::to_string(columns_->count) +
               "; is the file cut off?");
  }
  const bool marked = columns_->status && !trimmed(fields[*columns_->status], kBlankOrQuote).empty();
  const auto read = reading(fields);
  // A reading the tracker itself marked may hold anything; it is kept, and corrected only when it is a pose.
  if (!read && !marked) return tl::unexpected(read.error());
  const std::string_view sensor =
      columns_->sensor ? trimmed(fields[*columns_->sensor], kBlankOrQuote) : std::string_view();
  PendingRow row{line_, std::nullopt, setup_.ofRow(sensor)};
  if (read && *read) {
    row.pose = poses_.size();
    if (!marked) units_.add((*read)->pose.position_m);
    poses_.push_back((*read)->pose);
    turned_.push_back((*read)->is_turned);
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
