#pragma once

namespace fieldtrue::identify {

/// Shares of the gap by where it comes from, 0..1, before any effect is named.
struct GapOrigin {
  double room = 0.0;
  double transmitter = 0.0;
  double sensor = 0.0;
  double jig_or_time = 0.0;
};

}  // namespace fieldtrue::identify
