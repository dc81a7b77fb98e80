#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"

namespace fieldtrue::correctors {

/// Which methods an automatic choice looks at.
enum class CandidateSet {
  kSurvey,  ///< The survey's methods.
  kOurs,    ///< Those that came after it.
  kAll
};

/// A method with settings that may be chosen.
struct AutomaticCandidate {
  const PositionMethod* method = nullptr;
  Settings settings;
  std::string text;    ///< As a person writes it, settings that differ from the defaults only.
  int complexity = 0;  ///< The rank that its method states.
};

/// What the rows of a set want tried, simplest first; the baselines none, rigid and affine are in every set.
std::vector<AutomaticCandidate> automaticCandidates(CandidateSet set);

/// What inner cross-validation found about one candidate.
struct InnerScore {
  std::vector<double> squares_m2;               ///< Held-out squared error of each place, mean over its rows.
  std::vector<double> shares;                   ///< Of the region, which each place stands for; none = all alike.
  std::vector<Eigen::Vector3d> residual_m;      ///< True minus corrected there, mean over its rows.
  std::vector<Eigen::Vector3d> row_residual_m;  ///< The same of each row.
  int dimension = 3;                            ///< Of the places.
  std::optional<std::string> skipped;           ///< Why it cannot be used here; then nothing else is set.

  /// Takes one row of a place in. @param weight one over the place's rows
  void add(std::size_t place, std::size_t row, const Eigen::Vector3d& left_m, double weight);
  double shareOf(std::size_t place) const { return shares.empty() ? 1.0 : shares[place]; }
  /// Over the region, as far as it is scored.
  double rms_m() const;
};

/// What a fit to all rows leaves at them, in the form of errors held out; where it does not cover a place, what was
/// there before.
/// @param shares of the region, by place
InnerScore scoreOfFit(const PositionModel& model, const FitData& data, const std::vector<double>& shares);

/// Whether the mean square exceeds that of another by more than two standard errors of the difference; of a candidate
/// that is still being scored, on the places that are.
bool isClearlyWorse(const InnerScore& score, const InnerScore& best);

/// The candidate of least mean square of those not skipped; the first must not be.
std::size_t leastSquare(const std::vector<InnerScore>& scores);

/// At how many places, and by how much, one candidate errs less than another, in SDs of chance: Wilcoxon's signed ranks
/// of the squares' differences, weighted by what each place stands for. A few places that carry the squares carry it no
/// further than others.
/// @source Wilcoxon 1945, "Individual comparisons by ranking methods"
double errsLessMostly(const InnerScore& score, const InnerScore& other);

/// Places as 0, 1, ... in order of first appearance, by row.
std::vector<std::size_t> placeSlots(const FitData& data);

/// Rows in folds by place, the same for every candidate: five, or one a place below twenty places. Places left out at
/// an edge are foretold from one side, and are more of the places than edges are of the region: each counts for the
/// share that it stands for.
struct InnerFolds {
  std::vector<std::vector<std::size_t>> rows;
  std::vector<double> shares;  ///< Of the region, by place.
};
InnerFolds innerFolds(const FitData& data);

/// Scores a candidate on places its fits did not see: in closed form where the method has one and is not tuned by the
/// data, by refits otherwise.
/// @param best so far, or null: a costly method that after any fold is worse by two standard errors is dropped
/// @error kCancelled only; what a method cannot do is in the score
Result<InnerScore> scoreCandidate(const AutomaticCandidate& candidate, const FitData& data, const InnerFolds& folds,
                                  const InnerScore* best, const RunControl& control);

/// Steps of the progress after the scores: fits to all places, and the answer's own.
inline constexpr std::size_t kFitsAfterScores = 2;

/// Scores every candidate, costly ones last; in the candidates' order.
/// @param progress is told the fraction done
/// @error kCancelled
Result<std::vector<InnerScore>> scoreCandidates(const std::vector<AutomaticCandidate>& candidates, const FitData& data,
                                                const InnerFolds& folds, const RunControl& control);

/// Which candidate, and how it was told that it is better than none.
struct AutomaticDecision {
  std::size_t candidate = 0;
  bool is_despite_squares = false;  ///< By most places and by directions, while a few places carry the squares.
  bool is_by_evidence = false;      ///< Of all places, rather than by places left out.
};

/// The simplest candidate that corrects at all and whose mean squared error exceeds the least by no more than one
/// standard error of the difference. Among equally simple ones that the squares do not tell apart by two, the one that
/// errs less at most places, by signed ranks: a few places carry the squares. It or the one of least square must lower
/// the RMS by 5 % at least and clearly: the mean square by 1.645 standard errors (one-sided 95 %), or, where a few
/// places carry the squares, by corrections that point to where the places left out err, by 2.326 SDs of the mean
/// cosine of directions that know nothing (one-sided 99 %), or by signed ranks, by as many SDs.
/// Where neither does, and the squares cannot tell a candidate from none (no worse by 1.645 standard errors), one whose
/// corrections point the right way by 3.09 SDs (one-sided 99.9 %) and that errs less at most places by signed ranks; of
/// several the one with the most by these. Else none, which must be the first.
/// @source the one-standard-error rule: Breiman, Friedman, Olshen, Stone 1984, section 3.4.3
AutomaticDecision chooseCandidate(const std::vector<AutomaticCandidate>& candidates,
                                  const std::vector<InnerScore>& scores);

}  // namespace fieldtrue::correctors
