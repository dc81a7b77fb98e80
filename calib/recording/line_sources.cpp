#include "calib/recording/line_sources.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "calib/recording/sample_spectrum.h"

namespace fieldtrue::recording {

namespace {

constexpr std::array kMains_hz = {50.0, 60.0};
constexpr double kHighestHarmonic_hz = 300.0;
constexpr double kSlowestMonitor_hz = 60.0;
constexpr double kFastestMonitor_hz = 85.0;

std::string mainsName(double mains_hz, int harmonic) {
  char text[64];
  if (harmonic == 1) {
    std::snprintf(text, sizeof text, "the mains of %.0f Hz", mains_hz);
  } else {
    std::snprintf(text, sizeof text, "the %.0f Hz harmonic of mains of %.0f Hz", harmonic * mains_hz, mains_hz);
  }
  return text;
}

/// Monitors whose alias is this frequency: k rate + seen and k rate - seen in their range.
void addMonitors(double seen_hz, double rate_hz, std::vector<LineSource>& sources) {
  for (int k = 0; k * rate_hz - seen_hz <= kFastestMonitor_hz; ++k) {
    for (const double sign : {-1.0, 1.0}) {
      const double source_hz = k * rate_hz + sign * seen_hz;
      if (source_hz < kSlowestMonitor_hz || source_hz > kFastestMonitor_hz) continue;
      char text[64];
      std::snprintf(text, sizeof text, "a monitor of %.1f Hz", source_hz);
      sources.push_back({source_hz, text});
    }
  }
}

}  // namespace

double aliasOf_hz(double frequency_hz, double rate_hz) {
  return std::abs(frequency_hz - rate_hz * std::round(frequency_hz / rate_hz));
}

std::vector<LineSource> lineSources(double seen_hz, double rate_hz, double tolerance_hz) {
  std::vector<LineSource> sources;
  for (const double mains_hz : kMains_hz) {
    for (int harmonic = 1; harmonic * mains_hz <= kHighestHarmonic_hz; ++harmonic) {
      const double source_hz = harmonic * mains_hz;
      const bool is_known = std::any_of(sources.begin(), sources.end(),
                                        [&](const LineSource& source) { return source.frequency_hz == source_hz; });
      if (is_known || std::abs(aliasOf_hz(source_hz, rate_hz) - seen_hz) > tolerance_hz) continue;
      sources.push_back({source_hz, mainsName(mains_hz, harmonic)});
    }
  }
  std::stable_sort(sources.begin(), sources.end(),
                   [](const LineSource& a, const LineSource& b) { return a.frequency_hz < b.frequency_hz; });
  addMonitors(seen_hz, rate_hz, sources);
  return sources;
}

}  // namespace fieldtrue::recording
