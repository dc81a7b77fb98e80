#pragma once

#include <string>
#include <vector>

#include "calib/gap/how_far.h"
#include "calib/identify/selection.h"
#include "calib/identify/traces.h"

namespace fieldtrue::gap {

/// What a selection leaves: all that smooth physics could make, and single traces of what no catalogue holds.
struct LeftOver {
  identify::Structure structure;
  std::vector<identify::Trace> traces;
};

LeftOver leftBy(const identify::GapSearch& search, const identify::GapModel& model);

/// Why effects that fit are not named.
enum class Refusal {
  kNone,
  kForetellsNoBetter,  ///< A smooth field without a name foretells unseen blocks as well, and the evidence is no
                       ///< better.
  kSmallShare,         ///< What they take is less than what a field without a name takes of the rest.
};

/// The selected effects held against their rivals without a name.
struct Judgement {
  identify::EffectSelection selection;  ///< What stays: nothing where it is refused.
  std::vector<std::string> dropped;     ///< Effects that the search had chosen and that were taken out one by one.
  Refusal refusal = Refusal::kNone;
  std::vector<std::string> refused;  ///< Effects that fitted together and are not named.
  HowFar far;
  LeftOver left;
  double nats_over_unnamed = 0.0;  ///< Log evidence of effects and smooth rest over a smooth field alone.
  double unnamed_nats = 0.0;       ///< Of the smooth field alone over noise alone.
  Bounded unseen_gain;             ///< What they foretell better than a smooth field alone, whitened, unseen blocks.
  double smooth_left = 1.0;        ///< Of the start's excess, with the smooth field alone; unseen places.
  double rest_m2 = 0.0;            ///< Mean square that the smooth rest beside the effects foretells of unseen places.
  double named_share = 1.0;        ///< Of what effects and smooth rest take of unseen places, what the effects take.
};

/// Each effect stays only if it makes no unseen place worse on the whole and leaving it out costs evidence; together
/// they are named only if they foretell unseen blocks better than a field without a name, or, foretelling the same, are
/// the likelier by Thresholds::least_nats, or, several together, by least_nats_of_several each, every parameter
/// counted; and only if they take at least Thresholds::least_share of what they and such a field together take.
Judgement judge(const identify::GapSearch& search, identify::EffectSelection selection, const RunControl& control);

}  // namespace fieldtrue::gap
