#include "calib/calibration/calibration_envelope.h"

#include <string_view>

#include "calib/calibration/checksum.h"

namespace fieldtrue::calibration {
namespace {

using nlohmann::json;

constexpr std::string_view kSchemaName = "fieldtrue.ftcal/";
constexpr int kSchemaVersion = 3;
constexpr std::string_view kChecksumKind = "fnv1a64:";

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
}

}  // namespace fieldtrue::calibration
