#pragma once

#include <cctype>
#include <string>
#include <string_view>

namespace fieldtrue {

/// Letters only, small: Jig-Tolerance_M and jig_tolerance_m are the same.
inline std::string smallLetters(std::string_view text) {
  std::string small;
  for (const char c : text)
    if (std::isalpha(static_cast<unsigned char>(c))) small += static_cast<char>(std::tolower(c));
  return small;
}

}  // namespace fieldtrue
