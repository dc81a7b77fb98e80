#include "app/cli_acquire_sensors.h"

#include "calib/tables/table_sensors.h"

namespace fieldtrue::cli {

std::vector<int> recordedSensors(const acquisition::AcquisitionStatus& status) {
  std::vector<int> sensors;
  for (const acquisition::SensorProgress& one : status.sensors) sensors.push_back(one.sensor);
  return sensors;
}

std::vector<int> silentSensors(const acquisition::AcquisitionStatus& status) {
  std::vector<int> sensors;
  for (const acquisition::SensorProgress& one : status.sensors)
    if (one.silent) sensors.push_back(one.sensor);
  return sensors;
}

std::string notTheSessionsText(const std::string& session, const std::vector<int>& of_session,
                               const std::vector<int>& asked, const std::string& because) {
  return session + ": its places were taken by " + sensorsText(of_session) + ", not by " + sensorsText(asked) +
         (because.empty() ? "" : ": " + because) + "; leave --sensor out, or name a new session file";
}

std::string leaderStaysText(const std::vector<int>& recorded, const std::vector<int>& asked) {
  return "the session stays led by sensor " + std::to_string(recorded.front()) + ", not by sensor " +
         std::to_string(asked.front()) + ": its first places were taken so";
}

std::string recordingText(const std::vector<int>& recorded, std::size_t n_reporting) {
  std::string text = "Recording " + sensorsText(recorded);
  if (recorded.size() > 1) text += ", led by sensor " + std::to_string(recorded.front());
  return text + " of " + std::to_string(n_reporting) + " that report (--sensor chooses)";
}

}  // namespace fieldtrue::cli
