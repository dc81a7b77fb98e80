#include <charconv>
#include <limits>
#include <type_traits>

#include "calib/calibration/alignment.h"
#include "calib/calibration/checksum.h"
#include "calib/calibration/corrector.h"
#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"
#include "calib/correctors/baked/baked_lattice.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/tables/table_json.h"
#include "calib/tables/table_setup.h"

namespace fieldtrue::calibration {
namespace {

using nlohmann::json;

constexpr std::string_view kSchemaName = "fieldtrue.ftcal/";
/// Version 2 has `baked` in place of the position part's `parameters`, or a position part that takes the whole pose.
/// What version 1 could hold is still written as version 1.
constexpr int kSchemaVersion = 2;
constexpr std::string_view kChecksumKind = "fnv1a64:";

/// Metadata may hold bytes that are not UTF-8; they become replacement characters rather than an exception.
std::string compactText(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

/// Of the content without the checksum itself: keys sorted, no white space, so that re-indenting a file does no harm.
std::string checksumOf(json content) {
  content.erase("checksum");
  return std::string(kChecksumKind) + fnv1a64(compactText(content));
}

json reportToJson(const FitReport& report) {
  json to = {{"n_nodes", report.n_nodes},
             {"rms_before_mm", report.rms_before_mm},
             {"rms_m", report.rms_m},
             {"max_m", report.max_m},
             {"notes", report.notes}};
  if (report.orientation_rms_rad) to["orientation_rms_rad"] = *report.orientation_rms_rad;
  return to;
}

FitReport reportFrom(const JsonReader& from) {
  FitReport report;
  report.n_nodes = static_cast<std::size_t>(from["n_nodes"].integer(0, std::numeric_limits<int>::max()));
  report.rms_before_mm = from["rms_before_mm"].number();
  report.rms_m = from["rms_m"].number();
  report.max_m = from["max_m"].number();
  report.notes = from["notes"].texts();
  if (const auto rms_rad = from.find("orientation_rms_rad")) report.orientation_rms_rad = rms_rad->number();
  return report;
}

/// A method's id and settings, and the model rebuilt from its parameters.
template <class Model>
struct LoadedPart {
  std::string id;
  Settings settings;
  bool is_baked = false;
  std::shared_ptr<const Model> model;
};

template <class Model>
LoadedPart<Model> partFrom(const JsonReader& part,
                           Result<const correctors::CorrectionMethod<Model>*> (*find)(std::string_view)) {
  LoadedPart<Model> loaded;
  loaded.id = part["method"].text();
  const correctors::CorrectionMethod<Model>& method = *part["method"].valueOf(find(loaded.id));
  // A setting that came to the method after the file was written stands at its default, as it did without it.
  const JsonReader settings = part["settings"];
  json stored_settings = settings.object();
  const json defaults = toJson(resolveSettings(loaded.id, method.settings, {}).value());
  for (const auto& [key, value] : defaults.items()) stored_settings.emplace(key, value);
  loaded.settings = settings.valueOf(settingsFromJson(loaded.id, method.settings, stored_settings));
  if constexpr (std::is_same_v<Model, correctors::PositionModel>) {
    loaded.is_baked = part.has("baked");
    if (loaded.is_baked) loaded.model = correctors::BakedLattice::fromJson(part["baked"]);
  }
  if (!loaded.is_baked) loaded.model = method.read(part["parameters"]);
  return loaded;
}

/// Every fact, null where it is not stated.
json setupToJson(const Setup& setup) {
  json to = json::object();
  for (const SetupFact& fact : setupFacts()) {
    const auto value = factOf(setup, fact.key);
    to[std::string(fact.key)] = value ? json(*value) : json(nullptr);
  }
  return to;
}

/// A key of the mountings: the sensor's number.
int sensorFrom(const JsonReader& mounts, const std::string& key) {
  int sensor = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), sensor);
  if (error != std::errc() || end != key.data() + key.size())
    mounts.fail("has the key '" + key + "', which is not a sensor's number");
  return sensor;
}

/// Schema and checksum: whether this is a whole calibration file that this version can read.
void checkEnvelope(const JsonReader& content) {
  if (!content.schema(kSchemaName, kSchemaVersion, "a Fieldtrue calibration"))
    content.fail("is not a Fieldtrue calibration; it needs the key schema with \"" + std::string(kSchemaName) +
                 std::to_string(kSchemaVersion) + "\".");
  if (const auto checksum = content.find("checksum"); !checksum || checksum->raw() != checksumOf(content.raw()))
    content.fail("is damaged: its content does not match its checksum; export the calibration again.");
}

}  // namespace

std::string Corrector::toText() const {
  json orientations = json::array();
  for (const Eigen::Quaterniond& q : orientationsSeen()) orientations.push_back(jsonOf(q));
  json content = {
      {"schema", std::string(kSchemaName) + std::to_string(is_baked_ || takesOrientation() ? kSchemaVersion : 1)},
      {"software", "Fieldtrue " FIELDTRUE_VERSION},
      {"direction", "tracker_from_sensor as tracked -> reference_from_sensor as corrected"},
      {"units", "m, rad; quaternions w x y z"},
      {"align", align_ == AlignMode::kRigid ? "rigid" : "none"},
      {"alignment",
       {{"reference_from_tracker", jsonOf(alignment_.reference_from_tracker)},
        {"sensor_from_mount_wxyz", jsonOf(alignment_.sensor_from_mount)}}},
      {"position",
       {{"method", choice_.position_id},
        {"settings", toJson(choice_.position_settings)},
        {is_baked_ ? "baked" : "parameters", position_->parameters()}}},
      {"orientation",
       {{"method", choice_.orientation_id},
        {"settings", toJson(choice_.orientation_settings)},
        {"parameters", orientation_->parameters()}}},
      {"inputs", takesOrientation() ? "pose" : "position"},
      {"orientations_seen", std::move(orientations)},
      {"region", region_.toJson()},
      {"setup", setupToJson(setup_)},
      {"report", reportToJson(report_)},
      {"table", fieldtrue::toJson(table_)},
  };
  for (const auto& [sensor, sensor_from_mount] : alignment_.mounts)
    content["alignment"]["mounts_wxyz"][std::to_string(sensor)] = jsonOf(sensor_from_mount);
  content["checksum"] = checksumOf(content);
  // One line a top-level key: readable at the head, and compact where thousands of numbers stand.
  std::string text = "{";
  for (const auto& [key, value] : content.items())
    text += (text == "{" ? "\n" : ",\n") + compactText(key) + ": " + compactText(value);
  return text + "\n}\n";
}

Result<void> Corrector::save(const std::filesystem::path& path) const {
  const std::string text = toText();
  return writeFileAtomically(path, [&](std::ostream& out) { out << text; });
}

Result<Corrector> Corrector::load(const std::filesystem::path& path) {
  return readFile(path).and_then([&](const std::string& text) { return fromText(text, path.filename().string()); });
}

Corrector Corrector::fromJson(const JsonReader& content) {
  checkEnvelope(content);
  auto position = partFrom<correctors::PositionModel>(content["position"], correctors::findPositionMethod);
  auto orientation = partFrom<correctors::OrientationModel>(content["orientation"], correctors::findOrientationMethod);
  const JsonReader alignment = content["alignment"];
  Corrector corrector;
  corrector.choice_ = {position.id, position.settings, orientation.id, orientation.settings};
  corrector.align_ = content["align"].oneOf({"rigid", "none"}) == "rigid" ? AlignMode::kRigid : AlignMode::kNone;
  corrector.alignment_.reference_from_tracker = alignment["reference_from_tracker"].pose();
  corrector.alignment_.sensor_from_mount = alignment["sensor_from_mount_wxyz"].quaternion();
  corrector.position_ = position.model;
  corrector.is_baked_ = position.is_baked;
  if (const auto mounts = alignment.find("mounts_wxyz"))
    for (const auto& [sensor, raw] : mounts->object().items())
      corrector.alignment_.mounts[sensorFrom(*mounts, sensor)] = (*mounts)[sensor].quaternion();
  corrector.orientation_ = orientation.model;
  corrector.region_ = Region::fromJson(content["region"]);
  corrector.report_ = reportFrom(content["report"]);
  corrector.table_ = tableFrom(content["table"]);
  const auto setup = content.find("setup");
  corrector.setup_ = setup ? setupFrom(*setup) : setupOf(corrector.table_);
  return corrector;
}

Result<Corrector> Corrector::fromText(const std::string& text, const std::string& name) {
  return parseJson(text, name).and_then([&](const json& content) {
    return readJson<Corrector>(content, name, Corrector::fromJson);
  });
}

}  // namespace fieldtrue::calibration
