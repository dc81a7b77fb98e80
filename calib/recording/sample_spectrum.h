#pragma once

#include <string>
#include <vector>

#include "calib/recording/sample_visits.h"

namespace fieldtrue::recording {

/// A line that stands out of the noise.
struct SpectralLine {
  double frequency_hz = 0.0;  ///< As seen, below half the rate.
  double error_hz = 0.0;
  double amplitude_sd = 0.0;  ///< In SDs of one reading's noise, RMS over the channels.
  double p_value = 1.0;       ///< That the strongest of all frequencies searched stands out as much by chance.
};

/// By which figures a line is one. What half and double of each do is printed by tests/studies/lines_study.
struct LineRules {
  /// That noise alone shows one anywhere. Set by reason: once in a thousand recordings.
  double largest_chance = 1e-3;
  /// A line that adds less than this share to the noise's power is none. Set by reason: it does no harm that could be
  /// seen.
  double least_excess = 0.2;
  /// The same below 6.5 periods a part, where noise known mostly from above may hide a broad hump. Set on simulated
  /// noise: a hump three resolutions wide (second order, pole radius 0.85) stood out by 0.5 at most.
  double least_low_excess = 0.6;
  /// The same below 4 periods, where it stood out by 1.7 at most.
  double least_lowest_excess = 2.0;
};

/// The readings' power by frequency, every stop and channel scaled to its own noise and pooled.
struct SampleSpectrum {
  double rate_hz = 0.0;
  std::size_t readings_per_stop = 0;  ///< Median.
  std::size_t stops = 0;
  double series = 0.0;  ///< Independent series pooled: stops (or parts of them) times channels.
  std::vector<double> frequencies_hz;
  std::vector<double> power;  ///< 1 = white noise; after prewhitening.
  /// What a line must stand out of: of the neighbourhood, and where power passes that, of the noise elsewhere.
  std::vector<double> background;
  std::vector<SpectralLine> lines;  ///< Strongest first.
  double correlation = 0.0;         ///< Of successive readings, without the lines, corrected for the fitted means.
  double correlation_sd = 0.0;
};

/// Pools the periodograms of all stops before looking for lines: what is invisible at one stop shows in a hundred.
/// Noise coloured by the tracker's filter is prewhitened to first order. A line must stand out of both sides of its
/// neighbourhood, and of an autoregression of the readings fitted to all other frequencies. Up to 6.5 cycles a part,
/// where neighbours below are few or none, it must stand out of the likeliest sum of relaxations, a random walk and
/// white noise too. Below two cycles nothing is looked for.
/// @return nothing where fewer than 4 stops of 16 readings are there, or their rate is unknown
/// @source Lomb 1976; Scargle 1982; Welch 1967 for the pooling; van der Ziel 1950 for slow noise as a sum of
/// relaxations, Whittle 1953 for its fit
std::optional<SampleSpectrum> sampleSpectrum(const std::vector<SampleVisit>& visits, const TableMetadata& metadata,
                                             const LineRules& rules = {});

}  // namespace fieldtrue::recording
