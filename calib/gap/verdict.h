#pragma once

#include <string>
#include <vector>

#include "calib/gap/held_out.h"
#include "calib/gap/report.h"
#include "calib/identify/search.h"
#include "calib/identify/structure.h"
#include "calib/identify/traces.h"

namespace fieldtrue::gap {

/// A trace of what no catalogue holds is told from here on.
inline constexpr double kSureTrace = 1e-5;

/// What the verdict goes by.
struct Evidence {
  bool has_effect = false;      ///< One of the catalogue was selected.
  bool has_structure = false;   ///< Before any effect.
  bool is_above_floor = false;  ///< Clearly larger than a stated floor, structured or not.
  double fraction = 1.0;        ///< What is surely left over what there was before, amplitude.
};

/// What a selection leaves: all that smooth physics could make, and single traces of what no catalogue holds.
struct LeftOver {
  identify::Structure structure;
  std::vector<identify::Trace> traces;
};

LeftOver leftBy(const identify::GapSearch& search, const identify::GapModel& model, const identify::GapRows& rows);

/// @param stated the rows as the table and the scene state them
/// @param report its RMS are there already
Evidence weigh(const identify::GapSearch& search, const identify::EffectSelection& selection,
               const HeldOutGap& held_out, const LeftOver& left, const identify::GapRows& stated,
               const GapReport& report);

GapVerdict verdictOf(const Evidence& evidence);

/// A figure as the sentences of a diagnosis show it.
std::string shown(double value);

/// One sentence: what was found, how sure, what to do.
std::string verdictText(const GapReport& report);

}  // namespace fieldtrue::gap
