#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "calib/correctors/automatic_blend.h"
#include "calib/correctors/automatic_choice.h"

namespace fieldtrue::correctors {

/// Logarithm of the likelihood of errors under a trivariate Student t with three degrees of freedom, at the scale that
/// makes it largest [nats; errors in m]. A few places far off cost it little.
/// @param shares what each place counts for, in any unit; none = all alike
/// @source Lange, Little, Taylor 1989, "Robust statistical modeling using the t distribution"
double heavyTailedLikelihood(std::span<const Eigen::Vector3d> errors_m, const std::vector<double>& shares);

/// What fits to all places say of the harmonic field.
struct FieldEvidence {
  std::size_t candidate = 0;  ///< The harmonic field.
  double more_nats = 0.0;     ///< Than the best of no correction, a rigid motion, the affine map and the polynomials.
  double whole_rms_m = 0.0;   ///< That its fit to all places leaves at them, over the region.
};

/// Fits to all places that the evidence needed.
struct WholeFits {
  std::vector<std::unique_ptr<PositionModel>> models;  ///< By candidate; null where none was made.
  std::optional<FieldEvidence> evidence;               ///< None without sources, and in a plane.
};

/// Fits the harmonic field and, where it finds sources, what it is held against. Each is told by the likelihood of what
/// it leaves, less half the logarithm of the values measured for each of its unknowns.
/// @error kCancelled
/// @source Schwarz 1978, "Estimating the dimension of a model"
Result<WholeFits> fitWhole(const std::vector<AutomaticCandidate>& candidates, const std::vector<InnerScore>& scores,
                           const FitData& data, const InnerFolds& folds, const RunControl& control);

/// One candidate, or a blend in its place.
struct AutomaticAnswer {
  AutomaticDecision decision;
  std::optional<Blend> blend;
  std::optional<std::size_t> stuck;  ///< Candidate that was left out since its fit to all places is stuck.
};

/// The harmonic field where all places together speak for it and places left out do not speak against it. Few places
/// near metal carry the disturbance: left out they are foretold by no fit, and left out they judge every method by
/// luck, while a law of physics that explains them with few unknowns is told by all. A blend takes its place only where
/// it foretells more likely as well as better. Otherwise what chooseCandidate and isWorthBlending say; where that would
/// use a harmonic field whose fit to all places leaves more than fits without them do, the same without it.
/// @param data,folds those of the scores
/// @param evidence or null
AutomaticAnswer answerOf(const std::vector<AutomaticCandidate>& candidates, const std::vector<InnerScore>& scores,
                         const FitData& data, const InnerFolds& folds, const FieldEvidence* evidence);

}  // namespace fieldtrue::correctors
