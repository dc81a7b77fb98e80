#pragma once

#include <span>
#include <string>

#include "calib/identify/thresholds.h"

namespace fieldtrue::testing {

/// One member of Thresholds.
struct Deciding {
  std::string name;
  /// Whether half and double of it are tried: else it acts between two recordings, on plans, on what to measure
  /// next, or on single readings.
  bool is_tried = true;
  double (*value)(const identify::Thresholds& thresholds) = nullptr;
  void (*scale)(identify::Thresholds& thresholds, double factor) = nullptr;
};

/// Every member, in their order.
std::span<const Deciding> decidingOnes();

}  // namespace fieldtrue::testing
