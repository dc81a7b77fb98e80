#include "calib/correctors/automatic_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "calib/correctors/base/fit_rows.h"
#include "calib/correctors/base/method.h"
#include "calib/geometry/region_shares.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kFolds = 5;
constexpr double kClearlyWorse = 2.0;  ///< Standard errors.
constexpr std::size_t kPlacesForFolds = 20;
constexpr double kLeastGain = 0.05;
constexpr double kOneSided95 = 1.645;
constexpr double kOneSided99 = 2.326;
constexpr double kOneSided999 = 3.09;  ///< Of a dozen candidates that are asked, less than two in a hundred by chance.

/// Mean of a - b over the places, and its standard error; of a candidate that is still being scored, over those that
/// are.
struct PairedDifference {
  double mean = 0.0;
  double standard_error = HUGE_VAL;

  PairedDifference(const InnerScore& a, const InnerScore& b) {
    double n = 0.0, shares = 0.0, sum = 0.0;
    const auto each = [&](const auto& take) {
      for (std::size_t i = 0; i < a.squares_m2.size(); ++i) {
        const double difference = a.squares_m2[i] - b.squares_m2[i];
        if (!std::isnan(difference)) take(difference, a.shareOf(i));
      }
    };
    each([&](double difference, double share) {
      n += 1.0;
      shares += share;
      sum += share * difference;
    });
    if (!(shares > 0.0)) return;
    mean = sum / shares;
    double squares = 0.0;
    each([&](double difference, double share) { squares += std::pow(share * (difference - mean), 2); });
    if (n > 1.0) standard_error = std::sqrt(squares * n / (n - 1.0)) / shares;
  }
};

/// True minus corrected position of a row.
Eigen::Vector3d residual_m(const PositionModel& model, const FitData& data, std::size_t row) {
  const Eigen::Vector3d& p_m = data.p_tracked_m[row];
  if (!model.covers(p_m)) return data.p_true_m[row] - p_m;
  const Eigen::Vector3d move_m =
      data.hasOrientation() ? model.displacementAt_m({p_m, data.q_tracked[row]}) : model.displacement_m(p_m);
  return data.p_true_m[row] - p_m - move_m;
}

/// Whether what one candidate corrects otherwise than another points to where the other errs, in SDs of chance: the
/// cosines between both, weighted by how far they differ. Squares cannot tell where a few places carry them; a
/// correction that knows nothing of a place left out points anywhere, however far that place errs.
double pointsTheRightWay(const InnerScore& score, const InnerScore& other) {
  double sum = 0.0, variance = 0.0;
  for (std::size_t i = 0; i < std::min(score.residual_m.size(), other.residual_m.size()); ++i) {
    const Eigen::Vector3d change_m = other.residual_m[i] - score.residual_m[i];
    const double error_m = other.residual_m[i].norm();
    if (!(error_m > 0.0)) continue;
    sum += change_m.dot(other.residual_m[i]) / error_m;
    variance += change_m.squaredNorm() / other.dimension;
  }
  return variance > 0.0 ? sum / std::sqrt(variance) : 0.0;
}

using ModelOfFold = std::function<Result<std::unique_ptr<PositionModel>>(const std::vector<std::size_t>& held_out)>;

/// How a candidate's models without some rows are made: downdated from one fit, or fitted anew where a fit is tuned.
Result<ModelOfFold> modelsOf(const AutomaticCandidate& candidate, const FitData& data, const RunControl& control) {
  const PositionMethod& method = *candidate.method;
  if (method.holdsOutExactly(candidate.settings) && method.canHoldOut(data, candidate.settings)) {
    FT_TRY(auto fits, method.hold_out(data, candidate.settings, control));
    return [shared = std::shared_ptr<const HoldOutFits<PositionModel>>(std::move(fits))](
               const std::vector<std::size_t>& held_out) { return shared->without(held_out, Pose{}); };
  }
  return [&candidate, &data, &control](const std::vector<std::size_t>& held_out) {
    std::vector<std::size_t> kept;
    for (std::size_t row = 0; row < data.size(); ++row)
      if (!std::binary_search(held_out.begin(), held_out.end(), row)) kept.push_back(row);
    return candidate.method->fit(rowsOfFitData(data, kept), candidate.settings, control);
  };
}

/// RMS over the places alike, whatever part of the region each stands for.
double rmsOfPlaces_m(const InnerScore& score) {
  const double sum_m2 = std::accumulate(score.squares_m2.begin(), score.squares_m2.end(), 0.0);
  return std::sqrt(sum_m2 / static_cast<double>(score.squares_m2.size()));
}

/// Whether a candidate is better than correcting nothing: by its RMS over the region, no worse over the places alike
/// (those at the edge stand for little of the region, and err most), and by more than chance.
bool isWorthIt(const InnerScore& score, const InnerScore& none) {
  const PairedDifference gain(none, score);
  const bool is_clear = gain.mean > kOneSided95 * gain.standard_error || pointsTheRightWay(score, none) > kOneSided99 ||
                        errsLessMostly(score, none) > kOneSided99;
  return is_clear && score.rms_m() <= (1.0 - kLeastGain) * none.rms_m() && rmsOfPlaces_m(score) <= rmsOfPlaces_m(none);
}

/// What the squares do not show to be worse than none, points to where the places left out err, and errs less at most
/// of them.
AutomaticDecision chosenDespiteSquares(const std::vector<InnerScore>& scores) {
  AutomaticDecision chosen;
  double most = 0.0;
  for (std::size_t i = 1; i < scores.size(); ++i) {
    if (scores[i].skipped || pointsTheRightWay(scores[i], scores.front()) <= kOneSided999) continue;
    const PairedDifference loss(scores[i], scores.front());
    const double less = errsLessMostly(scores[i], scores.front());
    if (loss.mean > kOneSided95 * loss.standard_error || less <= most) continue;
    most = less;
    chosen = {i, true};
  }
  return chosen;
}

std::vector<double> rowsOfPlaces(const std::vector<std::size_t>& slots) {
  std::vector<double> n_rows(1 + *std::max_element(slots.begin(), slots.end()), 0.0);
  for (const std::size_t slot : slots) n_rows[slot] += 1.0;
  return n_rows;
}

/// @param square_m2 of places that no row was taken in of
InnerScore emptyScore(const FitData& data, std::size_t n_places, const std::vector<double>& shares, double square_m2) {
  InnerScore score;
  score.shares = shares;
  score.squares_m2.assign(n_places, square_m2);
  score.residual_m.assign(n_places, Eigen::Vector3d::Zero());
  score.row_residual_m.assign(data.size(), Eigen::Vector3d::Zero());
  score.dimension = data.dimension;
  return score;
}

InnerScore skippedScore(std::string why) {
  InnerScore score;
  score.skipped = std::move(why);
  return score;
}

bool isIn(MethodOrigin origin, CandidateSet set) {
  if (origin == MethodOrigin::kBaseline || set == CandidateSet::kAll) return true;
  return (origin == MethodOrigin::kSurvey) == (set == CandidateSet::kSurvey);
}

}  // namespace

std::vector<AutomaticCandidate> automaticCandidates(CandidateSet set) {
  std::vector<AutomaticCandidate> candidates;
  for (const PositionMethod& method : positionMethods()) {
    if (!isIn(method.origin, set)) continue;
    for (const AutomaticTry& tried : method.tries) {
      const std::string text = method.id + (tried.settings.empty() ? "" : ":" + tried.settings);
      auto settings = resolveSettings(method.id, method.settings, parseMethodText(text).value().given);
      FT_CHECK(settings.has_value());
      candidates.push_back({&method, *std::move(settings), text, tried.rank});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const AutomaticCandidate& a, const AutomaticCandidate& b) {
    return a.complexity < b.complexity;
  });
  return candidates;
}

bool isClearlyWorse(const InnerScore& score, const InnerScore& best) {
  const PairedDifference excess(score, best);
  return excess.mean > 0.0 && excess.mean > kClearlyWorse * excess.standard_error;
}

std::size_t leastSquare(const std::vector<InnerScore>& scores) {
  FT_CHECK(!scores.empty() && !scores.front().skipped);
  std::size_t best = 0;
  for (std::size_t i = 1; i < scores.size(); ++i)
    if (!scores[i].skipped && PairedDifference(scores[i], scores[best]).mean < 0.0) best = i;
  return best;
}

double errsLessMostly(const InnerScore& score, const InnerScore& other) {
  std::vector<std::size_t> order(score.squares_m2.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto gain_m2 = [&](std::size_t place) { return other.squares_m2[place] - score.squares_m2[place]; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return std::abs(gain_m2(a)) < std::abs(gain_m2(b)); });
  double sum = 0.0, variance = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const double gain = gain_m2(order[rank]);
    if (gain == 0.0) continue;
    const double weight = static_cast<double>(rank + 1) * score.shareOf(order[rank]);
    sum += gain > 0.0 ? weight : -weight;
    variance += weight * weight;
  }
  return variance > 0.0 ? sum / std::sqrt(variance) : 0.0;
}

std::vector<std::size_t> placeSlots(const FitData& data) {
  std::map<int, std::size_t> slot_of_node;
  std::vector<std::size_t> slots;
  for (const int node : data.node) slots.push_back(slot_of_node.emplace(node, slot_of_node.size()).first->second);
  return slots;
}

void InnerScore::add(std::size_t place, std::size_t row, const Eigen::Vector3d& left_m, double weight) {
  squares_m2[place] += weight * left_m.squaredNorm();
  residual_m[place] += weight * left_m;
  row_residual_m[row] = left_m;
}

double InnerScore::rms_m() const {
  double sum_m2 = 0.0, sum = 0.0;
  for (std::size_t place = 0; place < squares_m2.size(); ++place) {
    sum_m2 += shareOf(place) * squares_m2[place];
    sum += shareOf(place);
  }
  return std::sqrt(sum_m2 / sum);
}

InnerFolds innerFolds(const FitData& data) {
  const std::vector<std::size_t> slots = placeSlots(data);
  const std::size_t n_places = 1 + *std::max_element(slots.begin(), slots.end());
  std::vector<std::size_t> order(n_places);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937_64 generator(1);
  for (std::size_t i = n_places - 1; i > 0; --i) std::swap(order[i], order[generator() % (i + 1)]);
  const std::size_t n_folds = n_places < kPlacesForFolds ? n_places : kFolds;
  std::vector<std::size_t> fold_of_place(n_places);
  for (std::size_t i = 0; i < n_places; ++i) fold_of_place[order[i]] = i % n_folds;
  InnerFolds folds{std::vector<std::vector<std::size_t>>(n_folds), {}};
  std::vector<Eigen::Vector3d> places_m(n_places);
  for (std::size_t row = 0; row < data.size(); ++row) {
    folds.rows[fold_of_place[slots[row]]].push_back(row);
    places_m[slots[row]] = data.p_true_m[row];
  }
  folds.shares = regionShares(places_m);
  return folds;
}

InnerScore scoreOfFit(const PositionModel& model, const FitData& data, const std::vector<double>& shares) {
  const std::vector<std::size_t> slots = placeSlots(data);
  const std::vector<double> n_rows = rowsOfPlaces(slots);
  InnerScore score = emptyScore(data, n_rows.size(), shares, 0.0);
  for (std::size_t row = 0; row < data.size(); ++row)
    score.add(slots[row], row, residual_m(model, data, row), 1.0 / n_rows[slots[row]]);
  return score;
}

Result<InnerScore> scoreCandidate(const AutomaticCandidate& candidate, const FitData& data, const InnerFolds& folds,
                                  const InnerScore* best, const RunControl& control) {
  const auto cancelled = [] { return fail(ErrorCode::kCancelled, "Stopped on request"); };
  if (control.stop.stop_requested()) return cancelled();
  const auto model_without = modelsOf(candidate, data, control);
  if (!model_without) {
    if (model_without.error().code == ErrorCode::kCancelled) return tl::unexpected(model_without.error());
    return skippedScore(model_without.error().message);
  }
  const std::vector<std::size_t> slots = placeSlots(data);
  const std::vector<double> n_rows = rowsOfPlaces(slots);
  InnerScore score = emptyScore(data, n_rows.size(), folds.shares, std::nan(""));
  for (std::size_t k = 0; k < folds.rows.size(); ++k) {
    if (control.stop.stop_requested()) return cancelled();
    const std::vector<std::size_t>& out = folds.rows[k];
    const auto model = (*model_without)(out);
    if (!model && model.error().code == ErrorCode::kCancelled) return tl::unexpected(model.error());
    if (!model) return skippedScore(model.error().message);
    for (const std::size_t row : out) score.squares_m2[slots[row]] = 0.0;
    for (const std::size_t row : out) {
      const Eigen::Vector3d left_m = residual_m(**model, data, row);
      if (!left_m.allFinite()) return skippedScore("its errors at held-out places are not finite");
      score.add(slots[row], row, left_m, 1.0 / n_rows[slots[row]]);
    }
    const bool may_drop = best != nullptr && candidate.method->isCostly() && k + 1 < folds.rows.size();
    if (may_drop && isClearlyWorse(score, *best))
      return skippedScore("dropped after " + std::to_string(k + 1) + " of " + std::to_string(folds.rows.size()) +
                          " folds, clearly worse than another candidate");
  }
  return score;
}

Result<std::vector<InnerScore>> scoreCandidates(const std::vector<AutomaticCandidate>& candidates, const FitData& data,
                                                const InnerFolds& folds, const RunControl& control) {
  RunControl inner = control;
  inner.progress = [](double) {};
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return candidates[a].method->isCostly() < candidates[b].method->isCostly();
  });
  std::vector<InnerScore> scores(candidates.size());
  const InnerScore* best = nullptr;
  double n_done = 0.0;
  for (const std::size_t i : order) {
    FT_TRY(auto score, scoreCandidate(candidates[i], data, folds, best, inner));
    scores[i] = std::move(score);
    if (!scores[i].skipped && (best == nullptr || PairedDifference(scores[i], *best).mean < 0.0)) best = &scores[i];
    control.progress(++n_done / static_cast<double>(candidates.size() + kFitsAfterScores));
  }
  return scores;
}

AutomaticDecision chooseCandidate(const std::vector<AutomaticCandidate>& candidates,
                                  const std::vector<InnerScore>& scores) {
  FT_CHECK(candidates.size() == scores.size());
  const std::size_t best = leastSquare(scores);
  if (best == 0) return chosenDespiteSquares(scores);
  std::size_t chosen = best;
  for (std::size_t i = 1; i < scores.size(); ++i) {
    if (scores[i].skipped) continue;
    const PairedDifference excess(scores[i], scores[best]);
    const bool is_simpler = candidates[i].complexity < candidates[chosen].complexity;
    const bool is_as_simple = candidates[i].complexity == candidates[chosen].complexity;
    if (is_simpler && excess.mean <= excess.standard_error) chosen = i;
    if (is_as_simple && excess.mean <= kClearlyWorse * excess.standard_error &&
        errsLessMostly(scores[i], scores[chosen]) > 0.0)
      chosen = i;
  }
  if (isWorthIt(scores[chosen], scores.front())) return {chosen};
  return isWorthIt(scores[best], scores.front()) ? AutomaticDecision{best} : chosenDespiteSquares(scores);
}

}  // namespace fieldtrue::correctors
