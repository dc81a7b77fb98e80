#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/correctors/automatic_choice.h"

namespace fieldtrue::correctors {

/// Candidates whose corrections are averaged.
struct Blend {
  std::vector<std::size_t> members;  ///< Candidates, ascending; two to four, of different methods.
  std::vector<double> weights;       ///< One a member, above 0, sum 1.
  InnerScore score;                  ///< In each fold with members and weights chosen without it.
};

/// The weighted mean of candidates that errs least on the places their fits did not see, weights at least 0: of the
/// best candidate of each of the four methods that err least. Nothing where one candidate alone errs least.
/// @param folds those of the scores
/// @source Wolpert 1992 ("Stacked generalization"); Breiman 1996 ("Stacked regressions"), equation 2 with sum 1
std::optional<Blend> blendCandidates(const std::vector<AutomaticCandidate>& candidates,
                                     const std::vector<InnerScore>& scores, const FitData& data,
                                     const InnerFolds& folds);

/// Whether a blend is worth its further parts beside one candidate: its RMS is at least 5 % lower, and it errs less at
/// most places (1.645 SDs of signed ranks): few places carry the squares that its weights are made of.
bool isWorthBlending(const InnerScore& blend, const InnerScore& chosen);

/// One member of a fitted blend.
struct BlendMember {
  std::string method;       ///< Its id.
  nlohmann::json settings;  ///< Its settings as stored.
  double weight = 0.0;
  std::unique_ptr<PositionModel> model;
};

/// The mean of the members' displacements with their weights. It covers what all members cover; its uncertainty is the
/// same mean of theirs, as if their errors were one error, and none where one of them knows none.
std::unique_ptr<PositionModel> makeBlend(std::vector<BlendMember> members);

/// What makeBlend stored; throws as a JsonReader does.
std::unique_ptr<PositionModel> readBlend(const JsonReader& parameters);

}  // namespace fieldtrue::correctors
