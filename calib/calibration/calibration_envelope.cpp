#include "calib/calibration/calibration_envelope.h"

#include <initializer_list>
#include <string_view>

#include "calib/calibration/checksum.h"

namespace fieldtrue::calibration {
namespace {

using nlohmann::json;

constexpr std::string_view kSchemaName = "fieldtrue.ftcal/";
constexpr int kSchemaVersion = 3;
constexpr std::string_view kChecksumKind = "fnv1a64:";

void mustSay(const JsonReader& statement, std::string_view ours) {
  if (statement.text() != ours) statement.refuse("\"" + std::string(ours) + "\", for nothing is converted");
}

void refuseKeysBeside(std::initializer_list<const char*> known, const JsonReader& object) {
  for (const char* key : known) static_cast<void>(object.has(key));
  object.refuseOtherKeys();
}

}  // namespace

std::string calibrationSchema(int version) { return std::string(kSchemaName) + std::to_string(version); }

std::string compactText(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

std::string checksumOf(json content) {
  content.erase("checksum");
  return std::string(kChecksumKind) + fnv1a64(compactText(content));
}

void checkEnvelope(const JsonReader& content) {
  if (!content.schema(kSchemaName, kSchemaVersion, "a Fieldtrue calibration"))
    content.fail("is not a Fieldtrue calibration; it needs the key schema with \"" + calibrationSchema(kSchemaVersion) +
                 "\".");
  if (const auto checksum = content.find("checksum"); !checksum || checksum->raw() != checksumOf(content.raw()))
    content.fail("is damaged: its content does not match its checksum; export the calibration again.");
  mustSay(content["units"], kCalibrationUnits);
  mustSay(content["direction"], kCalibrationDirection);
  refuseKeysBeside({"schema", "checksum", "software", "direction", "units", "align", "alignment", "position",
                    "orientation", "inputs", "orientations_seen", "setup", "region", "by_sensor", "report", "table"},
                   content);
  refuseKeysBeside({"reference_from_tracker", "sensor_from_mount_wxyz", "mounts_wxyz"}, content["alignment"]);
  for (const char* part : {"position", "orientation"})
    refuseKeysBeside({"method", "settings", "parameters", "baked", "by_sensor"}, content[part]);
}

}  // namespace fieldtrue::calibration
