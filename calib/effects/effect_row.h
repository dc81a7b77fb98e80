#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/core/declare.h"
#include "calib/core/error.h"
#include "calib/effects/effect_body.h"
#include "calib/effects/effect_fit.h"
#include "calib/effects/sample_evidence.h"
#include "calib/field/dipole_field.h"
#include "calib/field/effect.h"

namespace fieldtrue::effects {

/// One row of the effect registry.
struct Effect {
  std::string id;
  std::string label;
  std::string source;
  std::vector<Setting> parameters;  ///< A key ends in its unit: `center_m`.
  /// Builds the effect from resolved parameters. @error kBadInput for parameters that make no sense together
  Result<std::unique_ptr<field::PhysicalEffect>> (*make)(const nlohmann::json& parameters,
                                                         const field::Excitation& excitation) = nullptr;
  /// The ways to fit it to a table of this design, simplest first; null for what only samples show. A way whose
  /// parameters the design cannot show at all (time without times, a lever arm with one orientation) is left out.
  std::vector<std::unique_ptr<EffectFit>> (*fits)(const FitDesign& design) = nullptr;
  bool needs_dipoles =
      true;  ///< By the physics of a transmitter of dipoles; false for what the rig does to any tracker.
  bool acts_in_time = false;  ///< What it does changes during the session: nothing to be found without times.
  bool is_freer = false;      ///< Than others to fit what they leave over: it has to win by a share of its gain.
  /// Its shape; null for what does not stand in the room.
  EffectBody (*body)(const nlohmann::json& parameters) = nullptr;
  /// Adds what single readings show of it and the scene does not say yet; null where they show nothing.
  void (*detect)(const SampleEvidence& evidence, const SignalBelief& belief,
                 std::vector<recording::GapFinding>& findings) = nullptr;
};

}  // namespace fieldtrue::effects
