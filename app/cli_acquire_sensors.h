#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "acquisition/session/acquisition_controller.h"

namespace fieldtrue::cli {

/// Those of a status that are recorded, the leading one first.
std::vector<int> recordedSensors(const acquisition::AcquisitionStatus& status);
/// Of these, those that do not report.
std::vector<int> silentSensors(const acquisition::AcquisitionStatus& status);

/// Why a session does not go on with the sensors that were asked for, and what to do.
/// @param because what more there is to it: "sensor 0 leads and reports"; empty = nothing
std::string notTheSessionsText(const std::string& session, const std::vector<int>& of_session,
                               const std::vector<int>& asked, const std::string& because = {});
/// That another one leads than was asked for: the first take settled it.
std::string leaderStaysText(const std::vector<int>& recorded, const std::vector<int>& asked);
/// Which of several are recorded.
std::string recordingText(const std::vector<int>& recorded, std::size_t n_reporting);

}  // namespace fieldtrue::cli
