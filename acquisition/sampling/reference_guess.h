#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// Where the transmitter stands in the rig's frame, as far as is known while recording. No corrector takes part.
struct ReferenceGuess {
  Pose reference_from_tracker;
  bool known = false;  ///< Fitted to at least 4 places not in one plane, or the alignment was known before.
};

/// Fits the rigid part over the places done so far; below 3 places off one line the fallback stands.
/// @param done finished takes; skipped ones are left out
/// @param fallback what is believed before the first place (the scene's, or identity)
/// @param alignment_known the fallback is a fact and is kept
ReferenceGuess guessReference(std::span<const Node> done, const Pose& fallback, bool alignment_known);

/// Distance from the place within which a resting sensor is taken to stand on it: half the way to the next place, plus
/// the largest residual of the rigid fit at the four nearest places done, together at most the way to the next place
/// [m].
double nearDistance_m(const PlannedPlace& place, double spacing_m, std::span<const Node> done,
                      const Pose& reference_from_tracker);

/// Distance to the nearest other planned position; places of the same position (other visits) do not count [m].
/// @return 0.3 when there is no other
double spacing_m(std::span<const PlannedPlace> places, std::size_t place);

}  // namespace fieldtrue::acquisition
