#include <string>

#include "acquisition/devices/registry.h"
#include "app/cli.h"
#include "app/cli_values.h"
#include "calib/core/file_io.h"
#include "calib/correctors/registry.h"
#include "calib/effects/effect_listing.h"
#include "calib/exporters/exporter.h"
#include "calib/exporters/imported_calibration.h"
#include "calib/exporters/registry.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"

/// methods, effects, devices, formats: what is available, with settings and units.
namespace fieldtrue::cli {
namespace {

struct ListOptions {};

std::string rangeText(const Setting& setting) {
  if (setting.type == SettingType::kBool) return "true or false";
  if (setting.type == SettingType::kChoice) {
    std::string text;
    for (const std::string& choice : setting.choices) text += (text.empty() ? "" : "|") + choice;
    return text.empty() ? "text" : text;
  }
  std::string text =
      setting.isBounded() ? formatNumber(setting.min) + " to " + formatNumber(setting.max) : "any number";
  if (setting.type == SettingType::kAutoNumber) text = "auto, or " + text;
  return setting.unit.empty() ? text : text + " " + setting.unit;
}

std::string settingsLines(const std::vector<Setting>& settings) {
  std::string text;
  for (const Setting& setting : settings) {
    const std::string default_value = textOf(setting.default_value);
    text += "      " + setting.key + "=" + rangeText(setting);
    text += default_value.empty() ? "" : " (default " + default_value + ")";
    text += "  " + (setting.help.empty() ? setting.label : setting.help) + "\n";
  }
  return text;
}

template <class Row>
nlohmann::json rowJson(const Row& row) {
  return {{"id", row.id}, {"label", row.label}, {"source", row.source}, {"settings", toJson(row.settings)}};
}

/// One kind of row under its heading, for people and for programs.
template <class Rows>
void addMethods(Answer& answer, const std::string& kind, const Rows& rows) {
  answer.text += (answer.text.empty() ? "" : "\n") + kind + "\n";
  auto& list = answer.json[kind] = nlohmann::json::array();
  for (const auto& row : rows) {
    list.push_back(rowJson(row));
    list.back()["reading"] = row.reading;
    answer.text += "  " + row.id + "  " + row.label + (row.source.empty() ? "" : "  [" + row.source + "]") + "\n";
    if (!row.reading.empty()) answer.text += "      Read as: " + row.reading + "\n";
    answer.text += settingsLines(row.settings);
  }
}

Outcome listMethods(const ListOptions&, const CommonOptions&) {
  Answer answer;
  addMethods(answer, "position", correctors::positionMethods());
  addMethods(answer, "orientation", correctors::orientationMethods());
  return answer;
}

Outcome listEffects(const ListOptions&, const CommonOptions&) {
  Answer answer;
  answer.json["effects"] = effects::effectListing();
  answer.text = effects::effectListingText();
  return answer;
}

Outcome listDevices(const ListOptions&, const CommonOptions&) {
  Answer answer;
  auto& kinds = answer.json["devices"] = nlohmann::json::array();
  for (const acquisition::DeviceKind& kind : acquisition::deviceKinds()) {
    nlohmann::json row = rowJson(kind);
    row["address"] = kind.address_help;
    kinds.push_back(std::move(row));
    answer.text += kind.id + "  " + kind.label + "\n      " + kind.address_help + "\n" + settingsLines(kind.settings);
  }
  auto& lines = answer.json["serial_lines"] = nlohmann::json::array();
  answer.text += "\nserial lines of this machine\n";
  for (const acquisition::SerialLine& line : acquisition::serialLines()) {
    lines.push_back({{"path", line.path}, {"description", line.description}});
    answer.text += "  " + line.path + "  " + line.description + "\n";
  }
  if (lines.empty()) answer.text += "  none\n";
  return answer;
}

Outcome listFormats(const ListOptions&, const CommonOptions&) {
  Answer answer;
  auto& imports = answer.json["import"] = nlohmann::json::array();
  answer.text = "import\n";
  for (const importers::Importer& importer : importers::importers()) {
    nlohmann::json row = rowJson(importer);
    row["needs_truth"] = importer.needs_truth;
    imports.push_back(std::move(row));
    answer.text += "  " + importer.id + "  " + importer.label + (importer.needs_truth ? " (needs --truth)" : "") +
                   "\n" + settingsLines(importer.settings);
  }
  auto& calibrations = answer.json["import_calibration"] = nlohmann::json::array();
  answer.text += "\nimport, as a calibration (--calibration)\n";
  for (const exporters::CalibrationFormat& format : exporters::calibrationFormats()) {
    calibrations.push_back({{"id", format.id}, {"label", format.label}, {"unit", format.unit}});
    answer.text += "  " + format.id + "  " + format.label + ", in " + format.unit + "\n";
  }
  auto& exports = answer.json["export"] = nlohmann::json::array();
  answer.text += "\nexport\n";
  for (const exporters::Exporter& exporter : exporters::exporters()) {
    exports.push_back({{"id", exporter.id},
                       {"label", exporter.label},
                       {"extension", exporter.extension},
                       {"reads_it", exporter.reads_it},
                       {"content", exporter.in_words},
                       {"may_be_inverse", exporter.may_be_inverse},
                       {"has_free_pitch", exporter.has_free_pitch}});
    answer.text += "  " + exporter.id + "  " + exporter.label + " (" + exporter.extension + ")  read by " +
                   exporter.reads_it + "\n      " + exporter.in_words + "\n";
  }
  return answer;
}

}  // namespace

void addListCommands(CommandLine& line) {
  line.add("methods", "List the correction methods and their settings", listMethods);
  line.add("effects", "List the physical effects a scene can hold", listEffects);
  line.add("devices", "List the kinds of tracker and this machine's serial lines", listDevices);
  line.add("formats", "List the import and export formats", listFormats);
}

}  // namespace fieldtrue::cli
