#pragma once

#include <cstddef>

#include "calib/recording/sample_spectrum.h"

namespace fieldtrue::identify {

/// Every figure by which a diagnosis decides: what is refused, selected, named, called a gap, told apart and told. What
/// only says how finely or how long is searched stands beside the search. Each comment says what the figure means, how
/// it was set, and its unit. BIC units are twice a log likelihood, nats a log likelihood.
///
/// "Open sessions" are recordings made by other physics (tests/blind) whose truth was known when the figure was set.
/// What half and double of each do is printed by tests/studies/tuning_study and stands in the guide.
struct Thresholds {
  // What is refused.

  /// Places below which nothing is diagnosed. Set by reason: alignment and lever arm
  /// take 9 of the 24 numbers that eight positions are.
  std::size_t fewest_places = 8;
  /// Places below which no cause is looked for; there are noise to tell and whether there is a gap. Set by reason: a
  /// body takes up to nine parameters beside the alignment.
  std::size_t fewest_places_for_causes = 12;
  /// Median misfit beside alignment and mountings, as a share of the places' spread, beyond which readings are not of
  /// these places. Set between what is known: steel floors reach 0.2, rows in another order 1; of 95 strong or flipped
  /// open sessions none is above.
  double astray = 0.4;
  /// RMS misfit of the mirror image over that of any turn, below which an axis has the wrong sign. Set by reason:
  /// field distortion does not make one three times better than the other.
  double mirrored = 0.3;

  // What may be noise.

  /// SD per axis of placing where no tolerance is stated, at most [m]: a foot set on its mark within a finger's breadth
  /// (20 mm, two SD). Set by reason.
  double worst_placing_m = 0.010;
  /// The same of turning [rad]: held upright by eye within ten degrees (two SD). Set by reason.
  double worst_placing_rad = 0.087;
  /// A tolerance may be stated so many times too small; that is a finding and no gap. Set on open sessions: tolerances
  /// stated at half of the truth must alarm nobody, mechanical faults that scatter more are gaps.
  double stated_too_small = 2.2;
  /// SD per axis that no jig is better than, whatever is stated [m]. Set by reason.
  double best_placing_m = 0.0002;
  /// The same of turning [rad]. Set by reason.
  double best_placing_rad = 0.001;

  // Which effects are selected.

  /// BIC units that the first effect of a set must gain. Set on open sessions without an effect; by reason alone 6 to
  /// 10 count as strong.
  double least_gain_first = 8.0;
  /// BIC units that each further effect must gain, and must cost when it is left out. Set on open sessions: what is
  /// left of one effect is easily taken for a second.
  double least_gain_more = 14.0;
  /// BIC units by which another effect must be better to take a selected one's part. Set by reason: less is a draw.
  double least_gain_exchange = 2.0;
  /// BIC units that an implausible fit loses against plausible ones. Set on open sessions.
  double implausible_cost = 12.0;
  /// Share of its gain that an effect which is freer than others to fit what they leave has to win by. Set on open
  /// sessions with an effect that does not move.
  double share_of_freer = 0.06;
  /// Share of the best gain from which the best effect of the other kind (in the room, or not) starts a set of its own.
  /// Set on open sessions with two effects.
  double other_kind_start = 0.05;
  /// And from which effects of that kind alone are grown on with all others. Set on open sessions with two effects.
  double other_kind_share = 0.4;

  // Which of them are named.

  /// Nats over a field without a name that a name needs, and by which each effect of a set must be missed. Set by
  /// reason: odds of 20 to 1.
  double least_nats = 3.0;
  /// Nats for each effect where several are named together and do not foretell unseen blocks better: two or three free
  /// things imitate much. Set on open sessions: of 90 true sets none had less, of 35 that stood for something else 13.
  double least_nats_of_several = 12.0;
  /// Share of what effects and smooth rest together take of unseen places, which the effects must take. Set by reason:
  /// a name must stand for the larger part.
  double least_share = 0.5;

  // What is a gap, and how far it is explained.

  /// p of structure below which there is a gap though nothing is named. Set on open sessions without an effect: F tests
  /// of many columns are a little too sure, most of all where noise wanders; at 1e-6 five of 300 of these were called a
  /// gap by it.
  double sure_of_structure = 1e-8;
  /// Nats of a smooth field over noise from which there is a gap though nothing is named. Set on open sessions whose
  /// noise wanders: at 12 one in twenty of these was called a gap, at 24 one in fifty.
  double sure_nats = 24.0;
  /// BIC units of an effect from which there is a gap though it foretells nothing: at the edge of the places it bends
  /// so few that the others cannot foretell it. Set on open sessions: 0 of 300 without an effect reach it.
  double sure_unselected = 40.0;
  /// Chance that noise by the law of the others puts any reading of a recording as far off a smooth field as one that
  /// strays: that is a gap, and no noise. It must lie off by `far_off` too. Set by reason, as sure_trace.
  double sure_stray = 1e-5;
  /// Scatter over what may be noise, from which on it is a gap. Set so that tolerances stated at half of the truth stay
  /// none on open sessions.
  double clearly_scattered = 1.2;
  /// Share of the start's excess that is surely left (low end of the 90 % interval), above which a gap is only partly
  /// explained. Set by reason.
  double partly_left = 0.15;
  /// And above which it is unexplained. Set by reason: the larger part is.
  double unexplained_left = 0.5;

  // Probabilities, and what is not told apart.

  /// By which differences of BIC are divided: they are over-confident where the catalogue is not the world. Set on open
  /// sessions, so that probabilities are met.
  double temperature = 2.5;
  /// Share of the recordings that named a thing in the room, and were of something that the catalogue does not hold:
  /// that much of such a name's probability is left to a cause without one. Set on 2,098 open sessions, a quarter of
  /// which had such a cause.
  double unknown_as_thing = 0.25;
  /// The same of those that named any other effect.
  double unknown_as_other = 0.06;
  /// The same of those in which nothing was found.
  double unknown_as_none = 0.12;
  /// Squared correlation of fitted signals from which effects are not told apart. Set by reason.
  double same_signal = 0.9;
  /// BIC units within which that holds. Set by reason: odds of 7 to 1 when tempered.
  double same_evidence = 10.0;
  /// BIC units within which two such names are one thing, whose first carries both probabilities. Set by reason.
  double twin_evidence = 0.5;
  /// BIC units that a cause loses where it does not help on unseen places. Set on open sessions.
  double cost_of_failing = 10.0;
  /// BIC units that all causes lose where none was selected or refused. Set on open sessions without an effect.
  double cost_of_unselected = 12.0;
  /// BIC units that part the rivals without a name from causes where the judgement has decided: half of it where causes
  /// are refused, all of it where nothing was selected. Set by reason: odds of 11 to 1 when tempered.
  double nameless_margin = 12.0;
  /// Share of the gap's square that scatters, above which a field that scatters leads the ranking. Set by reason.
  double mostly_scattered = 0.5;
  /// Share of one's signal that another can imitate, above which a design cannot tell the two apart. Set by reason.
  double same_on_design = 0.9;
  /// And above which that is hard. Set by reason.
  double hard_on_design = 0.5;

  // How wide intervals of things in the room are: these are no point dipoles, round loops or endless planes.

  /// SD of a centre as a share of the thing's size; of a loop 2 times that times radius / sqrt 2. Set on open sessions,
  /// by coverage.
  double share_of_size = 0.12;
  /// SD of a plane's place as a share of its distance; of its strength 3 times that. Set on open sessions, by coverage.
  double share_of_distance = 0.03;
  /// None of these SDs is above [m]. Set by reason.
  double widest_place_m = 0.3;
  /// Factor on all other intervals of things in the room. Set on open sessions, by coverage.
  double wider_of_placed = 1.4;

  // What is told in words, and decides nothing else.

  /// p below which a trace of what no catalogue holds is told. Set on open sessions.
  double sure_trace = 1e-5;
  /// Rate of false discoveries among the rows that are flagged. Set by custom.
  double false_discoveries = 0.05;
  /// Mean square of a smooth rest beside what is named, over the start's excess, from which it is told. Set by reason.
  double told_rest = 0.1;
  /// Factor on a stated tolerance from which it is told to be too small. Set by reason.
  double told_tolerance = 1.3;
  /// Floors from which a place counts among those where something is left. Set by reason.
  double told_place = 2.5;
  /// BIC units from which a thing in the room is asked for its shape. Set by reason.
  double sure_thing = 20.0;
  /// Share of the strongest polarizability below which an axis does not answer, and above which it does. Set by reason:
  /// a sheet and a bar of ten to one have a tenth, a block of two to one a half.
  double silent_axis = 0.4;
  /// Probability of the second cause from which a measurement is sought that separates the first two. Set by reason.
  double open_cause = 0.05;
  /// Mean square difference that such a measurement must be expected to show, in noise variances. Set by reason.
  double least_separation = 0.05;

  // What changed between two recordings.

  /// Log odds of a change from which the field is said to have changed: by Markov's inequality no unchanged field gives
  /// them more often than once in a hundred recordings.
  double sure_of_change = 4.605;
  /// Share of the variance without any reading, below which the earlier recording knows the field at a place. Set by
  /// reason: the SD is half.
  double far_surer = 0.25;
  /// SDs that a reading must lie from what the earlier recording foretells, or from a smooth field through the others,
  /// to be astray: no slip of a placing that is as stated. Set on pairs of simulated recordings without a change, by
  /// false alarms.
  double far_off = 10.0;
  /// Places astray from which that may be a change. Set by reason: fewer are slips of the hand.
  std::size_t fewest_far_off = 3;
  /// Times the log odds of the one, from which what went is told and not what came, where recordings asked both ways
  /// say either. Set by reason: what came shows both ways, what went clearly one way only.
  double gone_is_surer = 2.0;
  /// How far a rig stands from where it stood, from which that is told [mm]. Set by reason: a foot set on a mark.
  double told_rig_moved_mm = 5.0;
  /// The same of its turn [degrees]. Set by reason.
  double told_rig_turned_deg = 0.5;
  /// Factor by which scatter grew or fell, from which that is told. Set by reason.
  double told_scatter = 1.7;

  // What single readings show.

  /// What is a line.
  recording::LineRules lines;
};

}  // namespace fieldtrue::identify
