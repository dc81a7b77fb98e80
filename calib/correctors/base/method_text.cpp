#include "calib/correctors/base/method_text.h"

#include "calib/core/file_io.h"

namespace fieldtrue::correctors {
namespace {

struct ValueText {
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return formatNumber(value); }
  std::string operator()(const std::string& value) const { return value; }
};

}  // namespace

std::string methodText(const std::string& id, const Settings& settings) {
  std::string text = id;
  char separator = ':';
  for (const auto& [key, value] : settings) {
    text += separator + key + "=" + std::visit(ValueText(), value);
    separator = ',';
  }
  return text;
}

}  // namespace fieldtrue::correctors
