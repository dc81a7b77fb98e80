#pragma once

#include <map>
#include <string>
#include <vector>

#include "calib/tables/table_metadata.h"

namespace fieldtrue::acquisition {

/// What a tracker calls its sensors, by their numbers: a name, or a tool's serial number. Empty where it tells none.
std::map<int, std::string> sensorNames(const TableMetadata& metadata);
/// Forgets the names, for those of another tracker or another order to take their place.
void forgetSensorNames(TableMetadata& metadata);
/// Which of the sensors have another name now than in the session, and what to do. Empty where none has; a sensor that
/// has no name on either side is not compared.
std::string otherNamesText(const std::vector<int>& sensors, const std::map<int, std::string>& then,
                           const std::map<int, std::string>& now);

}  // namespace fieldtrue::acquisition
