#include "acquisition/session/metadata_json.h"

#include <nlohmann/json.hpp>

namespace fieldtrue::acquisition {

namespace {

/// Calls visit(key, member) for every optional member; one list serves writing, reading and merging.
template <class Metadata, class Visit>
void visitOptionals(Metadata& metadata, Visit visit) {
  visit("tracker", metadata.tracker);
  visit("rig", metadata.rig);
  visit("date", metadata.date);
  visit("excitation", metadata.excitation);
  visit("carrier_hz", metadata.carrier_hz);
  visit("rate_hz", metadata.rate_hz);
  visit("quantum_m", metadata.quantum_m);
  visit("jig_tolerance_m", metadata.jig_tolerance_m);
  visit("jig_tolerance_rad", metadata.jig_tolerance_rad);
  visit("alignment_tolerance_m", metadata.alignment_tolerance_m);
  visit("alignment_tolerance_rad", metadata.alignment_tolerance_rad);
}

void read(const nlohmann::json& value, std::optional<std::string>& member) {
  if (value.is_string()) member = value.get<std::string>();
}

void read(const nlohmann::json& value, std::optional<double>& member) {
  if (value.is_number()) member = value.get<double>();
}

}  // namespace

nlohmann::json toJson(const TableMetadata& metadata) {
  nlohmann::json json{{"frame", metadata.frame}, {"alignment", metadata.alignment_known ? "known" : "unknown"}};
  visitOptionals(metadata, [&](const char* key, const auto& member) {
    if (member) json[key] = *member;
  });
  if (!metadata.other.empty()) json["other"] = metadata.other;
  return json;
}

TableMetadata metadataFromJson(const nlohmann::json& json) {
  TableMetadata metadata;
  if (!json.is_object()) return metadata;
  if (json.contains("frame") && json.at("frame").is_string()) metadata.frame = json.at("frame").get<std::string>();
  metadata.alignment_known = json.contains("alignment") && json.at("alignment") == "known";
  visitOptionals(metadata, [&](const char* key, auto& member) {
    if (json.contains(key)) read(json.at(key), member);
  });
  if (!json.contains("other") || !json.at("other").is_object()) return metadata;
  for (const auto& [key, value] : json.at("other").items()) {
    if (value.is_string()) metadata.other[key] = value.get<std::string>();
  }
  return metadata;
}

TableMetadata merged(TableMetadata known, const TableMetadata& more) {
  const nlohmann::json extra = toJson(more);
  visitOptionals(known, [&](const char* key, auto& member) {
    if (!member && extra.contains(key)) read(extra.at(key), member);
  });
  known.alignment_known = known.alignment_known || more.alignment_known;
  known.other.insert(more.other.begin(), more.other.end());
  return known;
}

}  // namespace fieldtrue::acquisition
