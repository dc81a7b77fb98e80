#pragma once

#include <string>
#include <vector>

namespace fieldtrue::recording {

/// What a line may be: a source of steady frequency that readings taken at a rate show at another one.
struct LineSource {
  double frequency_hz = 0.0;
  std::string name;  ///< "the mains of 50 Hz", "a monitor of 72.0 Hz".
};

/// Where readings at a rate show a line: |f - k rate|, in [0, rate/2].
double aliasOf_hz(double frequency_hz, double rate_hz);

/// The mains (50 and 60 Hz and their harmonics up to 300 Hz) and monitors (60 to 85 Hz) that readings at this rate show
/// at a frequency; the mains first, low harmonics before high ones.
std::vector<LineSource> lineSources(double seen_hz, double rate_hz, double tolerance_hz);

}  // namespace fieldtrue::recording
