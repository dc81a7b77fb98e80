#pragma once

#include <span>
#include <vector>

#include "tests/blind/generate_effects.h"

namespace blind {

/// One effect with its parameters open.
struct RefittedEffect {
  double size = 1;             ///< As Drawn::apply takes it.
  std::vector<double> change;  ///< Of its shape, a number for each of Drawn::scales.
};

/// The true effects and the alignment of a session with their parameters fitted to its readings.
struct Refit {
  Setup setup;  ///< Where the rig and the sensor are by these readings.
  std::vector<RefittedEffect> effects;
  World world;        ///< What these effects do.
  double cost = 0.0;  ///< Whitened squares that are left, or twice their log likelihood where seating has heavy tails.
};

/// Levenberg and Marquardt, the alignment first and then all at once, on rows whitened by seating tolerance and scatter
/// of the readings, with numerical differences. Heavy tails of the seating are weighted as Student's t of 4 degrees of
/// freedom; an alignment that is known stays within its tolerance.
/// @param setup the true one: rows, noise, and where the alignment starts
/// @param effects what the session really has
/// @param start parameters that the fit starts from; one for each effect
/// @param readings a pose for each row of the setup, tracker frame
/// @param fits_effects false: the effects stay as they start and the alignment alone is fitted
/// @source Levenberg 1944, Marquardt 1963; weights: Lange, Little and Taylor 1989, J. Am. Stat. Assoc. 84, 881
Refit refitted(const Setup& setup, const std::vector<Placed>& effects, std::vector<RefittedEffect> start,
               std::span<const SolvedPose> readings, bool fits_effects);

/// Parameters as they were drawn.
std::vector<RefittedEffect> asDrawn(const std::vector<Placed>& effects);

}  // namespace blind
