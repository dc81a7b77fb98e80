#include "calib/correctors/base/method_text.h"

namespace fieldtrue::correctors {

std::string methodText(const std::string& id, const Settings& settings) {
  std::string text = id;
  char separator = ':';
  for (const auto& [key, value] : settings) {
    text += separator + key + "=" + textOf(value);
    separator = ',';
  }
  return text;
}

}  // namespace fieldtrue::correctors
