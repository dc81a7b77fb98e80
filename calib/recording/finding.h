#pragma once

#include <string>
#include <vector>

namespace fieldtrue::recording {

struct GapFinding {
  std::string effect;  ///< An effect's id, or "" for a finding that is none: a duplicate, a stuck value.
  std::string text;
  std::vector<int> nodes;
};

}  // namespace fieldtrue::recording
