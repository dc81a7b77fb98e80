#include <limits>
#include <utility>

#include "calib/calibration/alignment.h"
#include "calib/calibration/calibration_envelope.h"
#include "calib/calibration/corrector.h"
#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/tables/table_json.h"
#include "calib/tables/table_setup.h"

namespace fieldtrue::calibration {
namespace {

using nlohmann::json;

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

/// What one correction holds, beside the method's id and settings.
json correctionToJson(const Correction& correction) {
  json to;
  to["position"][correction.is_baked ? "baked" : "parameters"] = correction.position->parameters();
  to["orientation"]["parameters"] = correction.orientation->parameters();
  to["region"] = correction.region.toJson();
  return to;
}

/// A method's id and settings.
template <class Model>
std::pair<std::string, Settings> methodFrom(
    const JsonReader& part, Result<const correctors::CorrectionMethod<Model>*> (*find)(std::string_view)) {
  const std::string id = part["method"].text();
  const correctors::CorrectionMethod<Model>& method = *part["method"].valueOf(find(id));
  // A setting that came to the method after the file was written stands at its default, as it did without it.
  const JsonReader settings = part["settings"];
  json stored_settings = settings.object();
  const json defaults = toJson(resolveSettings(id, method.settings, {}).value());
  for (const auto& [key, value] : defaults.items()) stored_settings.emplace(key, value);
  for (const std::string& key : method.former_settings) stored_settings.erase(key);
  return {id, settings.valueOf(settingsFromJson(id, method.settings, stored_settings))};
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

}  // namespace

std::string Corrector::toText() const {
  json orientations = json::array();
  for (const Eigen::Quaterniond& q : orientationsSeen()) orientations.push_back(jsonOf(q));
  json content = {
      {"schema", calibrationSchema(!parts().by_sensor.empty()        ? 3
                                   : isBaked() || takesOrientation() ? 2
                                                                     : 1)},
      {"software", "Fieldtrue " FIELDTRUE_VERSION},
      {"direction", kCalibrationDirection},
      {"units", kCalibrationUnits},
      {"align", align_ == AlignMode::kRigid ? "rigid" : "none"},
      {"alignment",
       {{"reference_from_tracker", jsonOf(alignment().reference_from_tracker)},
        {"sensor_from_mount_wxyz", jsonOf(alignment().sensor_from_mount)}}},
      {"position", {{"method", choice_.position_id}, {"settings", toJson(choice_.position_settings)}}},
      {"orientation", {{"method", choice_.orientation_id}, {"settings", toJson(choice_.orientation_settings)}}},
      {"inputs", takesOrientation() ? "pose" : "position"},
      {"orientations_seen", std::move(orientations)},
      {"setup", setupToJson(setup_)},
      {"report", reportToJson(report_)},
      {"table", fieldtrue::toJson(table_)},
  };
  if (!parts().by_sensor.empty()) {
    content["position"]["by_sensor"] = choice_.separate_position;
    content["orientation"]["by_sensor"] = choice_.separate_orientation;
  }
  for (const auto& [sensor, correction] : parts().by_sensor)
    content["by_sensor"][std::to_string(sensor)] = correctionToJson(correction);
  if (parts().by_sensor.empty()) content.update(correctionToJson(parts()), true);
  for (const auto& [sensor, sensor_from_mount] : alignment().mounts)
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
  const auto position = methodFrom<correctors::PositionModel>(content["position"], correctors::findPositionMethod);
  const auto orientation =
      methodFrom<correctors::OrientationModel>(content["orientation"], correctors::findOrientationMethod);
  Corrector corrector(evaluatorPartsFrom(content));
  corrector.choice_ = {position.first, position.second, orientation.first, orientation.second};
  if (const auto apart = content["position"].find("by_sensor")) corrector.choice_.separate_position = apart->flag();
  if (const auto apart = content["orientation"].find("by_sensor"))
    corrector.choice_.separate_orientation = apart->flag();
  corrector.align_ = content["align"].oneOf({"rigid", "none"}) == "rigid" ? AlignMode::kRigid : AlignMode::kNone;
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
