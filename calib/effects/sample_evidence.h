#pragma once

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/place_name.h"
#include "calib/field/effect.h"
#include "calib/recording/finding.h"
#include "calib/recording/noise_law.h"
#include "calib/recording/reading_lattice.h"
#include "calib/recording/sample_spectrum.h"

namespace fieldtrue::effects {

/// What single readings tell, whatever the cause. Parts that the recording cannot tell are unset.
struct SampleEvidence {
  std::optional<recording::SampleSpectrum> spectrum = {};
  std::optional<recording::ReadingLattice> lattice = {};
  std::optional<recording::NoiseLaw> noise_law = {};
  PlaceNames names;
};

/// What a scene already says of the electronics.
struct SignalBelief {
  field::SignalModel signal;
  std::optional<double> coupling_noise;  ///< Over the dipole constant [1/m^3].
  bool has_effect = false;               ///< The effect that is looked for is in the scene.
};

/// A sentence by a printf format. @param format ends within 320 bytes
template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace fieldtrue::effects
