#pragma once

#include <map>
#include <span>
#include <vector>

#include "acquisition/session/session_store.h"

namespace fieldtrue::acquisition {

/// Chooses which readings of no stored take a session keeps. Pure: readings in, readings out.
///
/// Between the places 10 a second of each sensor. All of a take that failed or was cancelled, up to a million of them;
/// from there on they are thinned too, so that a day of failing takes cannot fill a disk.
class LooseReadings {
 public:
  std::vector<LooseSample> between(const Sample& sample);
  std::vector<LooseSample> cancelled(int node, std::span<const Sample> samples);

 private:
  bool isDue(const Sample& sample);

  std::map<int, double> newest_tenth_;  ///< By sensor.
  std::size_t n_cancelled_ = 0;
};

}  // namespace fieldtrue::acquisition
