#include "tests/blind/generate_effects.h"

namespace blind {

const std::vector<Kind>& unforeseenKinds() {
  static const std::vector<Kind> kinds;
  return kinds;
}

}  // namespace blind
