#include <charconv>
#include <type_traits>

#include "calib/calibration/alignment.h"
#include "calib/calibration/checksum.h"
#include "calib/calibration/corrector.h"
#include "calib/calibration/table_json.h"
#include "calib/core/file_io.h"
#include "calib/correctors/baked/baked_lattice.h"
#include "calib/correctors/base/json_values.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/tables/json_text.h"

namespace fieldtrue::calibration {
namespace {

using nlohmann::json;

constexpr std::string_view kSchemaName = "fieldtrue.ftcal/";
/// Version 2 has `baked` in place of the position part's `parameters`. What is not baked is still written as version 1.
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

FitReport reportFromJson(const json& from) {
  FitReport report;
  report.n_nodes = from.at("n_nodes").get<std::size_t>();
  report.rms_before_mm = from.at("rms_before_mm").get<double>();
  report.rms_m = from.at("rms_m").get<double>();
  report.max_m = from.at("max_m").get<double>();
  report.notes = from.at("notes").get<std::vector<std::string>>();
  if (from.contains("orientation_rms_rad")) report.orientation_rms_rad = from.at("orientation_rms_rad").get<double>();
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
Result<std::unique_ptr<Model>> loadModel(const correctors::CorrectionMethod<Model>& method, const json& part,
                                         bool is_baked) {
  if constexpr (std::is_same_v<Model, correctors::PositionModel>)
    if (is_baked) return correctors::BakedLattice::load(part.at("baked"));
  return method.load(part.at("parameters"));
}

template <class Model>
Result<LoadedPart<Model>> loadPart(const json& part,
                                   Result<const correctors::CorrectionMethod<Model>*> (*find)(std::string_view)) {
  LoadedPart<Model> loaded;
  loaded.id = part.at("method").get<std::string>();
  const auto method = find(loaded.id);
  if (!method) return tl::unexpected(method.error());
  // A setting that came to the method after the file was written stands at its default, as it did without it.
  json stored_settings = part.at("settings");
  const json defaults = toJson(resolveSettings(loaded.id, (*method)->settings, {}).value());
  if (stored_settings.is_object())
    for (const auto& [key, value] : defaults.items()) stored_settings.emplace(key, value);
  auto settings = settingsFromJson(loaded.id, (*method)->settings, stored_settings);
  if (!settings) return tl::unexpected(settings.error());
  loaded.settings = *std::move(settings);
  if constexpr (std::is_same_v<Model, correctors::PositionModel>) loaded.is_baked = part.contains("baked");
  auto model = loadModel(**method, part, loaded.is_baked);
  if (!model) return tl::unexpected(model.error());
  loaded.model = *std::move(model);
  return loaded;
}

/// Schema and checksum: whether this is a whole calibration file that this version can read.
Result<void> checkEnvelope(const json& content, const std::string& name) {
  const std::string schema = content.is_object() ? content.value("schema", std::string()) : std::string();
  if (!schema.starts_with(kSchemaName))
    return fail(ErrorCode::kBadInput, name + " is not a Fieldtrue calibration: its schema must be " +
                                          std::string(kSchemaName) + std::to_string(kSchemaVersion) +
                                          (schema.empty() ? ", and none is stated" : ", not " + schema));
  int version = 0;
  const char* const end = schema.data() + schema.size();
  const auto [rest, error] = std::from_chars(schema.data() + kSchemaName.size(), end, version);
  if (error != std::errc() || rest != end || version < 1)
    return fail(ErrorCode::kBadInput, name + " has a schema version that is not a number: " + schema);
  if (version > kSchemaVersion)
    return fail(ErrorCode::kNewerVersion, name + " was written by a newer version of Fieldtrue (" + schema +
                                              "); this one reads up to version " + std::to_string(kSchemaVersion));
  if (content.value("checksum", std::string()) != checksumOf(content))
    return fail(ErrorCode::kBadInput,
                name + " is damaged: its content does not match its checksum; export the calibration again");
  return {};
}

}  // namespace

std::string Corrector::toText() const {
  json content = {
      {"schema", std::string(kSchemaName) + std::to_string(is_baked_ ? kSchemaVersion : 1)},
      {"software", "Fieldtrue " FIELDTRUE_VERSION},
      {"direction", "tracker_from_sensor as tracked -> reference_from_sensor as corrected"},
      {"units", "m, rad; quaternions w x y z"},
      {"align", align_ == AlignMode::kRigid ? "rigid" : "none"},
      {"alignment",
       {{"reference_from_tracker", correctors::jsonOf(alignment_.reference_from_tracker)},
        {"sensor_from_mount_wxyz", correctors::jsonOf(alignment_.sensor_from_mount)}}},
      {"position",
       {{"method", choice_.position_id},
        {"settings", toJson(choice_.position_settings)},
        {is_baked_ ? "baked" : "parameters", position_->parameters()}}},
      {"orientation",
       {{"method", choice_.orientation_id},
        {"settings", toJson(choice_.orientation_settings)},
        {"parameters", orientation_->parameters()}}},
      {"region", region_.toJson()},
      {"report", reportToJson(report_)},
      {"table", tableToJson(table_)},
  };
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

Result<Corrector> Corrector::fromText(const std::string& text, const std::string& name) {
  const Result<json> parsed = parseJson(text, name);
  if (!parsed) return tl::unexpected(parsed.error());
  const json& content = *parsed;
  return correctors::guarded<Corrector>("calibration " + name, [&]() -> Result<Corrector> {
    if (auto checked = checkEnvelope(content, name); !checked) return tl::unexpected(checked.error());
    auto position = loadPart<correctors::PositionModel>(content.at("position"), correctors::findPositionMethod);
    if (!position) return fail(position.error().code, name + ": " + position.error().message);
    auto orientation =
        loadPart<correctors::OrientationModel>(content.at("orientation"), correctors::findOrientationMethod);
    if (!orientation) return fail(orientation.error().code, name + ": " + orientation.error().message);
    auto region = Region::fromJson(content.at("region"));
    if (!region) return fail(region.error().code, name + ": " + region.error().message);

    Corrector corrector;
    corrector.choice_ = {position->id, position->settings, orientation->id, orientation->settings};
    corrector.align_ = content.at("align").get<std::string>() == "rigid" ? AlignMode::kRigid : AlignMode::kNone;
    corrector.alignment_.reference_from_tracker =
        correctors::poseFrom(content.at("alignment").at("reference_from_tracker"));
    corrector.alignment_.sensor_from_mount =
        correctors::quaternionFrom(content.at("alignment").at("sensor_from_mount_wxyz"));
    corrector.position_ = position->model;
    corrector.is_baked_ = position->is_baked;
    corrector.orientation_ = orientation->model;
    corrector.region_ = *std::move(region);
    corrector.report_ = reportFromJson(content.at("report"));
    corrector.table_ = tableFromJson(content.at("table"));
    return corrector;
  });
}

}  // namespace fieldtrue::calibration
