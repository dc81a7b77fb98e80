#pragma once

#include <string>
#include <vector>

#include "calib/core/settings.h"

/// How settings and parameters are declared, one call each. A setting of a method has a label for its form; a parameter
/// of an effect is called by its key.
namespace fieldtrue::declare {

/// Both bounds inclusive; both 0: any finite number.
struct Range {
  double min = 0.0;
  double max = 0.0;
  std::string unit = {};
};

Setting number(std::string key, std::string label, Range range, double usual, std::string help);
Setting integer(std::string key, std::string label, Range range, std::int64_t usual, std::string help);
Setting flag(std::string key, std::string label, bool usual, std::string help);
/// @param choices empty = any text
Setting choice(std::string key, std::string label, std::vector<std::string> choices, std::string usual,
               std::string help);
/// @param usual "auto" or a number
Setting autoNumber(std::string key, std::string label, Range range, SettingValue usual, std::string help);
/// One that takes whole numbers only.
Setting autoInteger(std::string key, std::string label, Range range, SettingValue usual, std::string help);

/// @param usual null: it may be left out
Setting number(std::string key, Range range, SettingValue usual, std::string help);
Setting choice(std::string key, std::vector<std::string> choices, std::string usual, std::string help);
Setting vector3(std::string key, Range range, std::vector<double> usual, std::string help);
/// A symmetric matrix that may be left out.
Setting matrix3(std::string key, Range range, std::string help);
/// A list of 1 to 64 numbers.
Setting numbers(std::string key, Range range, std::vector<double> usual, std::string help);

}  // namespace fieldtrue::declare
