#include "app/cli_setup_check.h"

namespace fieldtrue::cli {

void SetupCheck::readHead(std::string_view key, std::string_view value) {
  // What is no fact of a set-up is somebody else's.
  if (key.starts_with(kSetupPrefix)) (void)state(head_, key.substr(kSetupPrefix.size()), value);
}

SetupMatch SetupCheck::ofRow(std::string_view sensor) {
  const auto known = by_sensor_.find(sensor);
  if (known != by_sensor_.end()) return known->second;
  Setup row = head_;
  (void)state(row, "sensor", sensor.empty() ? factOf(head_, "sensor").value_or("") : sensor);
  for (const auto& [key, value] : stated_) row[key] = value;
  const SetupMatch answer = match(calibrated_, row);
  if (answer == SetupMatch::kNo && difference_.empty()) difference_ = differenceText(calibrated_, row);
  return by_sensor_.emplace(sensor, answer).first->second;
}

}  // namespace fieldtrue::cli
