#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/gap/report.h"
#include "calib/identify/thresholds.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::gap {

struct DiagnosisOptions {
  /// An earlier recording of the same room, whatever its places: what changed since is diagnosed, whatever was wrong
  /// then, and whatever the rig says. Null = none.
  std::shared_ptr<const CalibrationTable> against;
  int most_effects = 4;
  int replicates = 0;      ///< How many recordings are made again under what was found, to tell how far to trust it.
  std::uint64_t seed = 1;  ///< Of those.
  identify::Thresholds thresholds;
};

/// Where a recording differs from what the scene's simulator would have recorded, which unmodelled effect causes it,
/// and how far the gap shrinks once it is added.
/// @param samples the raw readings of the table's rows; null = none
/// @param scene what the simulator believes; null = an ideal tracker in free space
/// @error kTooFewNodes below 8 usable places (causes are looked for from 12 on), those with a value that is not finite
/// left out and named, or where an earlier recording tells the field at fewer; kBadInput where most samples are not
/// those of the table's rows; kCancelled
Result<GapReport> diagnose(const CalibrationTable& table, const SampleTable* samples, const simulation::Scene* scene,
                           const DiagnosisOptions& options = {}, const RunControl& control = {});

/// The scene with the selected effects of a report added; the transmitter's pose and signal effects are taken over too,
/// and the rig's tolerances where the recording states some that a scene can hold.
simulation::Scene updatedScene(const simulation::Scene& scene, const TableMetadata& recording, const GapReport& report);

}  // namespace fieldtrue::gap
