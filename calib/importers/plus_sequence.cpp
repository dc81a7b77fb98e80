#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/core/trimmed.h"
#include "calib/core/units.h"
#include "calib/importers/pose_matrix.h"
#include "calib/importers/rows.h"
#include "calib/tables/csv_reader.h"

namespace fieldtrue::importers {
namespace {

constexpr std::string_view kFrame = "Seq_Frame";
constexpr std::string_view kTransform = "Transform";
constexpr std::string_view kStatus = "TransformStatus";

/// What one frame says of one transform.
struct Reading {
  std::string matrix;
  std::string status;
  std::size_t line = 0;
};

struct Sequence {
  std::map<std::string, std::map<int, Reading>> transforms;  ///< By name, "StylusToTracker", and frame.
  std::map<int, double> time_s;                              ///< Of each frame, as stamped.
};

/// "Seq_Frame0012_StylusToTrackerTransform" as 12 and the rest; none for another key.
std::optional<std::pair<int, std::string_view>> frameKey(std::string_view key) {
  if (!key.starts_with(kFrame)) return std::nullopt;
  key.remove_prefix(kFrame.size());
  int frame = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), frame);
  if (error != std::errc()) return std::nullopt;
  key.remove_prefix(static_cast<std::size_t>(end - key.data()));
  if (!key.starts_with('_')) return std::nullopt;
  return std::pair{frame, key.substr(1)};
}

/// A header line's key and value: "key = value" in .mha, "key:=value" in .nrrd.
std::pair<std::string_view, std::string_view> fieldOf(std::string_view line) {
  const std::size_t nrrd = line.find(":="), equals = line.find('=');
  if (equals == std::string_view::npos) return {};
  const std::size_t key_end = nrrd != std::string_view::npos && nrrd < equals ? nrrd : equals;
  return {trimmed(line.substr(0, key_end)), trimmed(line.substr(equals + 1))};
}

/// The header: up to the pixels, which are no text.
Result<Sequence> readHeader(std::istream& in, const std::string& name) {
  Sequence sequence;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const auto [key, value] = fieldOf(line);
    if (line.empty() || key == "ElementDataFile") break;
    const auto frame = frameKey(key);
    if (!frame) continue;
    const auto& [index, field] = *frame;
    if (field == "Timestamp") {
      const auto time_s = parseFinite(value);
      if (!time_s)
        return fail(ErrorCode::kBadInput, name + ", line " + std::to_string(number) + ": the time stamp '" +
                                              std::string(value.substr(0, 40)) + "' is not a finite number");
      sequence.time_s[index] = *time_s;
    } else if (field.ends_with(kStatus)) {
      sequence.transforms[std::string(field.substr(0, field.size() - kStatus.size()))][index].status = value;
    } else if (field.ends_with(kTransform)) {
      Reading& reading = sequence.transforms[std::string(field.substr(0, field.size() - kTransform.size()))][index];
      reading.matrix = value;
      reading.line = number;
    }
  }
  if (sequence.transforms.empty())
    return fail(ErrorCode::kBadInput,
                name + " has no transforms of frames (Seq_Frame0000_StylusToTrackerTransform = 16 numbers)");
  return sequence;
}

/// The transform that is wanted, or the only one to a tracker.
Result<std::string> chosenTransform(const Sequence& sequence, const std::string& wanted, const std::string& name) {
  std::string known;
  std::set<std::string> to_tracker;
  for (const auto& [transform, readings] : sequence.transforms) {
    if (!known.empty()) known += ", ";
    known += transform;
    if (transform.ends_with("ToTracker")) to_tracker.insert(transform);
  }
  if (!wanted.empty()) {
    if (sequence.transforms.contains(wanted)) return wanted;
    return fail(ErrorCode::kBadInput, name + " has no transform " + wanted + "; it has " + known);
  }
  if (sequence.transforms.size() == 1) return sequence.transforms.begin()->first;
  if (to_tracker.size() == 1) return *to_tracker.begin();
  return fail(ErrorCode::kBadInput,
              name + " has several transforms: " + known + "; choose the sensor's with plus_sequence:transform=NAME");
}

Result<Pose> poseOf(const Reading& reading, const std::string& name) {
  const auto bad = [&](const std::string& what) {
    return fail(ErrorCode::kBadInput, name + ", line " + std::to_string(reading.line) + ": " + what);
  };
  Eigen::Matrix4d matrix;
  std::string_view rest = reading.matrix;
  for (Eigen::Index i = 0; i < 16; ++i) {
    const std::size_t end = std::min(rest.find_first_of(" \t"), rest.size());
    const auto value = parseFinite(rest.substr(0, end));
    if (!value) return bad("a transform needs 16 finite numbers, got '" + reading.matrix.substr(0, 60) + "'");
    matrix(i / 4, i % 4) = *value;
    rest = trimmed(rest.substr(end));
  }
  if (!rest.empty()) return bad("a transform needs 16 numbers, got more");
  if (const std::string wrong = wrongWithPose(matrix); !wrong.empty()) return bad("the transform is no pose: " + wrong);
  return Pose{kMPerMm * matrix.topRightCorner<3, 1>(),
              canonical(Eigen::Quaterniond(Eigen::Matrix3d(matrix.topLeftCorner<3, 3>())))};
}

Result<Import> importSequence(const std::filesystem::path& path, const std::optional<std::filesystem::path>&,
                              const Settings& settings) {
  FT_TRY(std::ifstream in, openForReading(path));
  const std::string name = path.filename().string();
  FT_TRY(const Sequence sequence, readHeader(in, name));
  FT_TRY(const std::string transform, chosenTransform(sequence, choiceSetting(settings, "transform"), name));
  Import import;
  import.samples.emplace();
  import.samples->metadata.frame = "tracker";
  import.samples->metadata.other["transform"] = transform;
  std::size_t n_lost = 0, n_without_time = 0;
  std::optional<double> start_s;
  for (const auto& [frame, reading] : sequence.transforms.at(transform)) {
    if (reading.matrix.empty()) continue;
    SampleRow row;
    if (!reading.status.empty() && reading.status != "OK") row.sample.status = reading.status;
    const auto pose = poseOf(reading, name);
    // What the tracker itself marked may hold anything.
    if (!pose && row.sample.status.empty()) return tl::unexpected(pose.error());
    if (pose) row.sample.tracker_from_sensor = *pose;
    const auto time = sequence.time_s.find(frame);
    if (time == sequence.time_s.end()) {
      ++n_without_time;
      continue;
    }
    if (!start_s) start_s = time->second;
    row.sample.time_s = time->second - *start_s;
    n_lost += row.sample.status.empty() ? 0 : 1;
    import.samples->rows.push_back(std::move(row));
  }
  if (import.samples->rows.empty())
    return fail(ErrorCode::kBadInput, name + " has no frame with a time stamp and the transform " + transform);
  import.notes.push_back("Transform " + transform +
                         ", taken as millimetres: " + std::to_string(import.samples->rows.size()) + " frames, " +
                         std::to_string(n_lost) + " of them marked by the tracker");
  if (n_without_time > 0)
    import.notes.push_back(std::to_string(n_without_time) + " frames without a time stamp were left out");
  import.notes.push_back("A sequence has no true positions: samples only");
  return import;
}

}  // namespace

/// Recordings of PLUS and 3D Slicer's sequences of transforms: the header of a .mha or .nrrd, its pixels unread.
Importer plusSequenceImporter() {
  return {.id = "plus_sequence",
          .label = "PLUS sequence (.mha, .nrrd)",
          .source = "PlusToolkit, sequence file: Seq_FrameNNNN_<Name>Transform",
          .settings = {declare::choice("transform", "Transform", {}, "",
                                       "Name of the sensor's transform, such as StylusToTracker; empty: the only one, "
                                       "or the only one to a tracker")},
          .read = importSequence};
}

}  // namespace fieldtrue::importers
