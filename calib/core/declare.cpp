#include "calib/core/declare.h"

namespace fieldtrue::declare {

namespace {

Setting ranged(SettingType type, std::string key, std::string label, Range range, SettingValue usual,
               std::string help) {
  return {.key = std::move(key),
          .label = std::move(label),
          .type = type,
          .unit = std::move(range.unit),
          .min = range.min,
          .max = range.max,
          .default_value = std::move(usual),
          .choices = {},
          .help = std::move(help)};
}

}  // namespace

Setting number(std::string key, std::string label, Range range, double usual, std::string help) {
  return ranged(SettingType::kNumber, std::move(key), std::move(label), std::move(range), usual, std::move(help));
}

Setting integer(std::string key, std::string label, Range range, std::int64_t usual, std::string help) {
  return ranged(SettingType::kInteger, std::move(key), std::move(label), std::move(range), usual, std::move(help));
}

Setting flag(std::string key, std::string label, bool usual, std::string help) {
  return ranged(SettingType::kBool, std::move(key), std::move(label), {}, usual, std::move(help));
}

Setting choice(std::string key, std::string label, std::vector<std::string> choices, std::string usual,
               std::string help) {
  Setting setting =
      ranged(SettingType::kChoice, std::move(key), std::move(label), {}, std::move(usual), std::move(help));
  setting.choices = std::move(choices);
  return setting;
}

Setting autoNumber(std::string key, std::string label, Range range, SettingValue usual, std::string help) {
  return ranged(SettingType::kAutoNumber, std::move(key), std::move(label), std::move(range), std::move(usual),
                std::move(help));
}

Setting autoInteger(std::string key, std::string label, Range range, SettingValue usual, std::string help) {
  Setting setting = autoNumber(std::move(key), std::move(label), std::move(range), std::move(usual), std::move(help));
  setting.whole = true;
  return setting;
}

Setting number(std::string key, Range range, SettingValue usual, std::string help) {
  return ranged(SettingType::kNumber, std::move(key), {}, std::move(range), std::move(usual), std::move(help));
}

Setting choice(std::string key, std::vector<std::string> choices, std::string usual, std::string help) {
  return choice(std::move(key), {}, std::move(choices), std::move(usual), std::move(help));
}

Setting vector3(std::string key, Range range, std::vector<double> usual, std::string help) {
  return ranged(SettingType::kVector3, std::move(key), {}, std::move(range), std::move(usual), std::move(help));
}

Setting matrix3(std::string key, Range range, std::string help) {
  return ranged(SettingType::kMatrix3, std::move(key), {}, std::move(range), nullptr, std::move(help));
}

Setting numbers(std::string key, Range range, std::vector<double> usual, std::string help) {
  return ranged(SettingType::kNumbers, std::move(key), {}, std::move(range), std::move(usual), std::move(help));
}

}  // namespace fieldtrue::declare
