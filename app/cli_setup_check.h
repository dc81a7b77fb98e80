#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "calib/core/setup.h"

namespace fieldtrue::cli {

/// Whether the rows of a table are of the set-up that was calibrated: by what the table's head states, what a person
/// states, which wins, and each row's sensor.
class SetupCheck {
 public:
  SetupCheck(Setup calibrated, Setup stated) : calibrated_(std::move(calibrated)), stated_(std::move(stated)) {}

  /// @param key of metadata, "setup.room", or anything else
  void readHead(std::string_view key, std::string_view value);

  /// @param sensor of the row, empty where the table does not tell
  SetupMatch ofRow(std::string_view sensor);

  /// What differs in the first rows that are of another set-up; empty where none is.
  const std::string& difference() const { return difference_; }

 private:
  Setup calibrated_, stated_, head_;
  std::map<std::string, SetupMatch, std::less<>> by_sensor_;
  std::string difference_;
};

}  // namespace fieldtrue::cli
