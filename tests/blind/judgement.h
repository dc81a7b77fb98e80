#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/blind/sealed_folder.h"
#include "tests/blind/statistics.h"

namespace blind {

/// The class of effects that the session's design cannot tell apart, the given effect among them.
std::vector<std::string> classOf(const Session& session, std::string_view effect);
bool areAlike(const Session& session, std::string_view a, std::string_view b);

/// The first candidate that is an effect, `none` among them; a field without a name is not.
/// @return null where there is none
const NamedCause* firstCandidate(const Session& session);
/// Its effect, `none` when there is none or the verdict is no_gap, "" when there is no answer.
std::string firstNamed(const Session& session);
/// What is named: the selected effects of an answer that explains a gap or a part of it, without fields that have no
/// name.
std::vector<const NamedCause*> namedCauses(const Session& session);
/// The effect named first, `none` when nothing is, "" when there is no answer.
std::string firstSelected(const Session& session);
/// Whether a named effect is in the class of one of the session's true effects, or is `none` where there is none.
bool isRight(const Session& session, std::string_view named);

/// Called unexplained or partly explained.
bool isAbstention(const Session& session);
/// Answered no_gap.
bool isSilent(const Session& session);
/// The truth is none of the catalogue's effects.
bool isOutsideCatalogue(const Session& session);
/// A cause was named that is no effect of the signal.
bool namesCause(const Session& session);
/// The same of a cause that is not in the class of a true effect.
bool namesOtherCause(const Session& session);
/// A body of metal in the room was named.
bool namesMetal(const Session& session);

/// Classes, one label each, of the session's true effects and of those the answer selected.
std::set<std::string> trueClasses(const Session& session);
std::set<std::string> selectedClasses(const Session& session);
/// Whether a true effect is selected or stands among the findings.
bool isFound(const Session& session);

/// Probability stated of the first candidate and of all that the design cannot tell from it.
double firstProbability(const Session& session);
/// That probability and whether the first candidate is right: in the truth's class; a field without a name where the
/// truth is outside the catalogue; `none` where an effect of the signal was found. No answer is sure and wrong.
/// @return nothing for an answer without candidates
std::optional<Forecast> forecastOf(const Session& session);

/// Distance of the first candidate's place from the true one.
/// @return metres; nothing unless a right candidate and the truth both have a place
std::optional<double> locationError(const Session& session);
/// Shrinkage by the selected effects over the shrinkage the true effect itself gives; 0 when there is no answer, at
/// most 1: to do better than the truth is luck of the noise.
/// @return nothing where the true effect shrinks nothing or the oracle is unknown
std::optional<double> relativeShrinkage(const Session& session);
/// Shrinkage by the selected effects as the answer states it; 0 when there is no answer.
/// @return nothing where there is no effect to shrink
std::optional<double> shrinkage(const Session& session);

/// Share of the mean squared excess at places that no table held which the answer's scene takes away, uncapped; 0 where
/// there is no answer, no gap or no explanation, and where the scene could not be simulated.
/// @return nothing where `foretell` did not run
std::optional<double> foretoldShrinkage(const Session& session, bool is_inside);
/// Whether the stated interval of what is left holds what `foretell` found left inside.
/// @return nothing unless both are there and an effect was selected
std::optional<bool> leftIsCovered(const Session& session);
/// Of the stated 90 % interval of what is left; nothing where none is stated.
std::optional<double> leftWidth(const Session& session);
/// Whether all is called explained while `foretell` found more than half of the excess left inside, or a scene that
/// cannot be simulated.
bool explainsInVain(const Session& session);
/// Whether all is called explained without reserve: the stated interval of what is left ends where the word does, and
/// is not wide.
bool explainsSurely(const Session& session);
/// Whether `foretell` found more left inside than *explained* allows.
bool leavesAPart(const Session& session);
/// Stated less found share of what is left inside.
std::optional<double> leftStatedOff(const Session& session);

/// For each 90 % interval that has a true value beside it: whether it holds that value.
std::vector<bool> locationCoverage(const Session& session);
std::vector<bool> amplitudeCoverage(const Session& session);

/// Fewest candidates, most probable first, that hold 90 % of the probability, and whether the true effect is in them.
struct CredibleSet {
  std::size_t size = 0;
  bool holds_truth = false;
};
std::optional<CredibleSet> credibleSet(const Session& session);

}  // namespace blind
