#pragma once

#include <span>
#include <string>

#include "calib/identify/thresholds.h"

namespace fieldtrue::testing {

/// One member of Thresholds.
struct Deciding {
  std::string name;
  /// Whether it acts on one recording; else on what changed between two.
  bool acts_on_one = true;
  double (*value)(const identify::Thresholds& thresholds) = nullptr;
  void (*scale)(identify::Thresholds& thresholds, double factor) = nullptr;
};

/// Every member, in their order.
std::span<const Deciding> decidingOnes();

}  // namespace fieldtrue::testing
