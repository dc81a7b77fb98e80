#pragma once

#include "calib/core/run_control.h"
#include "calib/identify/shared_field.h"
#include "calib/identify/thresholds.h"

namespace fieldtrue::identify {

/// The law under which readings are likeliest, each of its figures in turn over a ladder.
SharedLaw likeliestSharedLaw(const FieldReadings& readings, const SmoothParts& parts);

/// Whether the later of two recordings saw another field than the earlier one.
struct FieldComparison {
  SharedLaw law;             ///< Were nothing changed.
  SharedLaw earlier;         ///< By the earlier recording alone.
  double log_odds = 0.0;     ///< Of some change against none, averaged over the sizes and widths tried; less what the
                             ///< same readings give when they are dealt to the two recordings by chance.
  ChangeLaw change;          ///< The likeliest of those.
  double least_shown = 0.0;  ///< SD of a change that these readings would show, in the unit of the values.
};

/// @param pitch_m a change varies over no less than one and a half times this
FieldComparison compareFields(const FieldReadings& readings, const SmoothParts& parts, double pitch_m,
                              const Thresholds& thresholds = {}, const RunControl& control = {});

}  // namespace fieldtrue::identify
