#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli.h"
#include "app/cli_values.h"
#include "calib/calibration/corrector.h"
#include "calib/core/file_io.h"
#include "calib/core/setup.h"
#include "calib/core/statistics.h"
#include "calib/core/trimmed.h"
#include "calib/core/units.h"
#include "calib/recording/unit_slip.h"
#include "calib/tables/line_reader.h"
#include "calib/tables/table_sensors.h"

/// apply: corrects the poses of a table of any length, row by row.
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

/// Where the columns that matter stand.
struct Columns {
  std::size_t count = 0;
  std::array<std::size_t, 3> position{};
  std::optional<std::array<std::size_t, 4>> orientation;  ///< w x y z.
  std::optional<std::size_t> status;
  std::optional<std::size_t> sensor;
};

/// A row waiting for its batch.
struct PendingRow {
  std::string text;
  std::optional<std::size_t> pose;  ///< Index into the batch's poses; none for a row that holds no reading.
  SetupMatch setup = SetupMatch::kUnknown;
};

/// What a row holds.
struct Reading {
  Pose pose;
  bool is_turned = false;  ///< Its orientation is known.
};

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

/// Whether the rows of a table are of the set-up that was calibrated: by what the table's head states, what a person
/// states, which wins, and each row's sensor.
class SetupCheck {
 public:
  SetupCheck(Setup calibrated, Setup stated) : calibrated_(std::move(calibrated)), stated_(std::move(stated)) {}

  /// @param line of metadata, "# setup.room: Lab 2", or anything else
  void readHead(std::string_view line) {
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) return;
    const std::string_view key = trimmed(line.substr(1, colon - 1));
    // What is no fact of a set-up is somebody else's.
    if (key.starts_with(kSetupPrefix)) (void)state(head_, key.substr(kSetupPrefix.size()), line.substr(colon + 1));
  }

  /// @param sensor of the row, empty where the table does not tell
  SetupMatch ofRow(std::string_view sensor) {
    const auto known = by_sensor_.find(sensor);
    if (known != by_sensor_.end()) return known->second;
    Setup row = head_;
    (void)state(row, "sensor", sensor.empty() ? factOf(head_, "sensor").value_or("") : sensor);
    for (const auto& [key, value] : stated_) row[key] = value;
    const SetupMatch answer = match(calibrated_, row);
    if (answer == SetupMatch::kNo && difference_.empty()) difference_ = differenceText(calibrated_, row);
    return by_sensor_.emplace(sensor, answer).first->second;
  }

  /// What differs in the first rows that are of another set-up; empty where none is.
  const std::string& difference() const { return difference_; }

 private:
  Setup calibrated_, stated_, head_;
  std::map<std::string, SetupMatch, std::less<>> by_sensor_;
  std::string difference_;
};

class TableCorrector {
 public:
  TableCorrector(const calibration::Corrector& corrector, Setup stated, std::istream& in, std::string name)
      : corrector_(corrector),
        orientations_seen_(corrector.orientationsSeen()),
        lines_(in, std::move(name)),
        units_(corrector.region(), trackedPositions(corrector)),
        setup_(corrector.setup(), std::move(stated)) {}

  /// Copies the table with the corrected columns appended.
  Result<void> run(std::ostream& out) {
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

  /// Once the table was run. @error kBadInput when the readings seem to be in another unit
  Result<void> checkUnits() const { return units_.check(); }

  std::size_t n_rows() const { return n_rows_; }
  std::size_t n_outside() const { return n_outside_; }
  std::size_t n_lost() const { return n_lost_; }
  std::size_t n_other_setup() const { return n_other_setup_; }
  /// Rows of a sensor that has no correction of its own, where each has one.
  std::size_t n_other_sensor() const { return n_other_sensor_; }
  const std::string& setupDifference() const { return setup_.difference(); }
  /// Rows with a position and no orientation.
  std::size_t n_unturned() const { return n_unturned_; }
  bool hasOrientations() const { return columns_ && columns_->orientation; }

 private:
  static std::vector<Eigen::Vector3d> trackedPositions(const calibration::Corrector& corrector) {
    std::vector<Eigen::Vector3d> positions_m;
    for (const Node& node : corrector.table().nodes) positions_m.push_back(node.tracker_from_sensor.position_m);
    return positions_m;
  }

  tl::unexpected<Error> bad(const std::string& what) const {
    return fail(ErrorCode::kBadInput, lines_.name() + " line " + std::to_string(lines_.number()) + what);
  }

  Result<void> takeHeader(std::ostream& out) {
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

  static std::optional<std::size_t> find(const std::vector<std::string>& names, std::string_view name) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (names[i] == name) return i;
    }
    return std::nullopt;
  }

  Result<std::optional<std::array<std::size_t, 4>>> findOrientation(const std::vector<std::string>& names) const {
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

  Result<double> number(const std::vector<std::string_view>& fields, std::size_t column) const {
    std::string_view text = trimmed(fields[column], kBlankOrQuote);
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size() && std::isfinite(value)) return value;
    return bad(", column " + names_[column] + ": '" + std::string(text) + "' is not a finite number");
  }

  bool isBlank(const std::vector<std::string_view>& fields, std::size_t column) const {
    return trimmed(fields[column], kBlankOrQuote).empty();
  }

  /// @return none where the tracker put its mark for a missing reading
  Result<std::optional<Reading>> reading(const std::vector<std::string_view>& fields) const {
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

  Result<void> takeRow() {
    const std::vector<std::string_view> fields = splitFields(line_);
    if (fields.size() != columns_->count) {
      return bad(" has " + std::to_string(fields.size()) + " fields, the header has " +
                 std::to_string(columns_->count) + "; is the file cut off?");
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
      if (!turned_.back()) ++n_unturned_;
      sensors_.push_back(sensorNumber(sensor));
      const auto& apart = corrector_.parts().by_sensor;
      if (!apart.empty() && !(sensors_.back() && apart.contains(*sensors_.back()))) ++n_other_sensor_;
    }
    rows_.push_back(std::move(row));
    return {};
  }

  void flush(std::ostream& out) {
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
        ++n_lost_;
      }
      out << ',' << nameOf(row.setup) << '\n';
      if (row.setup == SetupMatch::kNo) ++n_other_setup_;
    }
    n_rows_ += rows_.size();
    rows_.clear();
    poses_.clear();
    turned_.clear();
    sensors_.clear();
  }

  void writeCorrected(std::ostream& out, const Reading& reading, const Pose& corrected, std::optional<int> sensor) {
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
    if (!covered) ++n_outside_;
    out << ',' << (covered ? 1 : 0) << ',';
    if (is_turned && !orientations_seen_.empty()) out << formatNumber(nearestOrientation_deg(tracked));
  }

  double nearestOrientation_deg(const Pose& tracked) const {
    double nearest_rad = kPi;
    for (const Eigen::Quaterniond& seen : orientations_seen_)
      nearest_rad = std::min(nearest_rad, angleBetween_rad(seen, tracked.orientation));
    return kDegPerRad * nearest_rad;
  }

  const calibration::Corrector& corrector_;
  std::vector<Eigen::Quaterniond> orientations_seen_;
  LineReader lines_;
  recording::ReadingUnits units_;
  SetupCheck setup_;
  std::string line_;
  std::optional<Columns> columns_;
  std::vector<std::string> names_;
  std::vector<PendingRow> rows_;
  std::vector<Pose> poses_;
  std::vector<bool> turned_;                 ///< Whether each pose has an orientation.
  std::vector<std::optional<int>> sensors_;  ///< Of each pose.
  std::size_t n_rows_ = 0;
  std::size_t n_outside_ = 0;
  std::size_t n_lost_ = 0;
  std::size_t n_unturned_ = 0;
  std::size_t n_other_setup_ = 0;
  std::size_t n_other_sensor_ = 0;
};

/// What rows without an orientation get; empty where nothing is to be said.
std::string remarkOnUnturned(const TableCorrector& table, const calibration::Corrector& corrector,
                             const std::string& name) {
  if (table.n_unturned() == 0 || (!table.hasOrientations() && !corrector.takesOrientation())) return {};
  std::string text = table.hasOrientations()
                         ? std::to_string(table.n_unturned()) + " of " + std::to_string(table.n_rows()) + " rows of " +
                               name + " have no orientation"
                         : name + " has no orientations (qw, qx, qy, qz)";
  if (!corrector.takesOrientation()) return text + ": their positions alone are corrected";
  return text + ", on which this correction depends: positions are corrected as for the mean of the " +
         std::to_string(corrector.orientationsSeen().size()) + " orientations it was fitted on";
}

struct ApplyOptions {
  std::string calibration;
  std::string in;
  std::string out;
  std::vector<std::string> setup;
  bool force = false;
};

Outcome runApply(const ApplyOptions& options, const CommonOptions&) {
  auto setup = readSetupArgument(options.setup);
  if (!setup) return tl::unexpected(setup.error());
  const auto corrector = calibration::Corrector::load(options.calibration);
  if (!corrector) return notPossible(corrector.error());
  if (std::filesystem::is_directory(options.in)) return notPossible(options.in + " is a folder, not a table");
  std::ifstream in(options.in, std::ios::binary);
  if (!in) {
    const auto reason = readFile(options.in);
    return notPossible(reason ? options.in + " cannot be opened" : reason.error().message);
  }
  TableCorrector table(*corrector, *std::move(setup), in, options.in);
  std::optional<Error> in_error;
  const auto written = writeFileAtomically(options.out, [&](std::ostream& out) {
    auto corrected = table.run(out);
    if (const auto units = table.checkUnits(); corrected && !units && !options.force) {
      corrected = fail(units.error().code, options.in + ": " + units.error().message + ", or go on with --force");
    }
    if (corrected) return;
    in_error = corrected.error();
    out.setstate(std::ios::failbit);
  });
  if (in_error) return notPossible(*in_error);
  if (!written) return notPossible(written.error());
  Answer answer;
  answer.json = {{"file", options.out},
                 {"rows", table.n_rows()},
                 {"outside", table.n_outside()},
                 {"lost", table.n_lost()},
                 {"other_setup", table.n_other_setup()},
                 {"other_sensor", table.n_other_sensor()}};
  answer.text = std::to_string(table.n_rows()) + " rows written to " + options.out + "; " +
                std::to_string(table.n_outside()) + " outside the calibrated region (covered = 0), " +
                std::to_string(table.n_lost()) + " without a pose\n";
  if (const std::string remark = remarkOnUnturned(table, *corrector, options.in); !remark.empty())
    answer.remarks.push_back(remark);
  if (table.n_other_sensor() > 0)
    answer.remarks.push_back(std::to_string(table.n_other_sensor()) + " of " + std::to_string(table.n_rows()) +
                             " rows of " + options.in + " name none of the sensors that have a correction each (" +
                             sensorsText(corrector->sensorsApart()) + "): they are corrected as sensor " +
                             std::to_string(corrector->sensorsApart().front()));
  if (table.n_other_setup() > 0)
    answer.remarks.push_back(std::to_string(table.n_other_setup()) + " of " + std::to_string(table.n_rows()) +
                             " rows of " + options.in + " are of another set-up than the calibration (" +
                             table.setupDifference() + "): its correction is not theirs; setup_matches is no");
  if (const auto units = table.checkUnits(); !units)
    answer.remarks.push_back(options.in + ": " + units.error().message + "; used all the same");
  return answer;
}

}  // namespace

void addApplyCommand(CommandLine& line) {
  auto [command, options] = line.add("apply", "Correct the poses of a node or sample table", runApply);
  command->add_option("--calibration", options->calibration, "Calibration (*.ftcal.json)")
      ->type_name("FILE")
      ->required();
  command->add_option("--in", options->in, "Table with columns x_m, y_m, z_m and, if there, qw, qx, qy, qz")
      ->type_name("CSV")
      ->required();
  command->add_option("--out", options->out, "The same table with the corrected columns appended")
      ->type_name("CSV")
      ->required();
  addSetupOption(*command, options->setup, "What the table does not state of its set-up");
  addForceOption(*command, options->force, "Go on although the readings seem to be in another unit than metres");
}

}  // namespace fieldtrue::cli
