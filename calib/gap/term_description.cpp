#include "calib/gap/term_description.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fieldtrue::gap {
namespace {

constexpr double kSdsOfNinety = 1.645;

/// SD of a place that stands for the physics the catalogue leaves out [m]: a place is not known better than to a share
/// of the size of what stands there, or of a plane's distance, however many nodes say so.
double unmodelledPlaceSd_m(const effects::FittedEffect& fitted, const identify::Thresholds& thresholds) {
  double sd_m = 0.0;
  for (const effects::FittedParameter& p : fitted.values) {
    if (p.name == "size_m") sd_m = std::max(sd_m, thresholds.share_of_size * p.value);
    if (p.name == "radius_m") sd_m = std::max(sd_m, 2.0 * thresholds.share_of_size * p.value / std::numbers::sqrt2);
    if (p.name == "distance_m") sd_m = std::max(sd_m, thresholds.share_of_distance * p.value);
  }
  return std::min(sd_m, thresholds.widest_place_m);
}

/// No interval of a searched parameter reaches beyond where it may be searched, and no radius is below nothing.
void keepWithinSearch(const effects::EffectFit& fit, GapCandidate& candidate) {
  for (Estimate& estimate : candidate.parameters)
    if (estimate.name == "radius_m" && estimate.low90 && estimate.value >= 0.0)
      estimate.low90 = std::max(*estimate.low90, 0.0);
  for (const effects::FitParameter& bound : fit.searched()) {
    for (Estimate& estimate : candidate.parameters) {
      if (estimate.name != bound.name || !estimate.low90 || !estimate.high90) continue;
      estimate.low90 = std::max(*estimate.low90, bound.low);
      estimate.high90 = std::min(*estimate.high90, bound.high);
    }
  }
}

/// The same SD of one parameter, in its unit. An image as far behind a plane as the source stands before it answers
/// with the inverse cube of the distance, so that its strength is not known better than to three times the distance's
/// share.
double unmodelledSd(const Estimate& estimate, bool is_plane, double place_sd_m,
                    const identify::Thresholds& thresholds) {
  if (estimate.name.rfind("center_", 0) == 0) return place_sd_m;
  if (!is_plane) return 0.0;
  if (estimate.name == "distance_m") return place_sd_m;
  return estimate.name == "strength" ? 3.0 * thresholds.share_of_distance * std::abs(estimate.value) : 0.0;
}

/// Widens the intervals of a thing in the room for the physics that its model leaves out.
void widenPlaced(const effects::FittedEffect& fitted, const identify::Thresholds& thresholds, GapCandidate& candidate) {
  if (!fitted.location_m) return;
  const double place_sd_m = unmodelledPlaceSd_m(fitted, thresholds);
  const double wider = thresholds.wider_of_placed;
  const bool is_plane = std::any_of(fitted.values.begin(), fitted.values.end(),
                                    [](const effects::FittedParameter& p) { return p.name == "distance_m"; });
  for (Estimate& estimate : candidate.parameters) {
    if (!estimate.low90 || !estimate.high90) continue;
    const double more = kSdsOfNinety * unmodelledSd(estimate, is_plane, place_sd_m, thresholds);
    estimate.low90 = estimate.value - std::hypot(wider * (estimate.value - *estimate.low90), more);
    estimate.high90 = estimate.value + std::hypot(wider * (*estimate.high90 - estimate.value), more);
  }
  if (!candidate.location_covariance_m2) return;
  *candidate.location_covariance_m2 =
      wider * wider * *candidate.location_covariance_m2 + place_sd_m * place_sd_m * Eigen::Matrix3d::Identity();
}

/// Parameters of one term within the covariance of a refined model.
struct TermPlace {
  Eigen::Index begin = 0;
  Eigen::Index linear = 0;
  Eigen::Index searched = 0;
};

TermPlace placeOf(const identify::RefinedModel& refined, std::size_t term) {
  TermPlace place;
  place.begin = identify::firstParameterOf(refined, term);
  place.linear = refined.model.terms[term].linear.size();
  place.searched = refined.model.terms[term].searched.size();
  return place;
}

/// Reported values and location as functions of the fitted parameters, linearised.
struct Sensitivity {
  Eigen::MatrixXd values;    ///< Reported value by parameter.
  Eigen::MatrixXd location;  ///< 3 by parameter.
};

Sensitivity sensitivityOf(const identify::GapTerm& term, const effects::FittedEffect& fitted) {
  const Eigen::Index linear = term.linear.size();
  const Eigen::Index count = linear + term.searched.size();
  Sensitivity sensitivity;
  sensitivity.values = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(fitted.values.size()), count);
  sensitivity.location = Eigen::MatrixXd::Zero(3, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    Eigen::VectorXd x = term.linear;
    Eigen::VectorXd searched = term.searched;
    double& moved = j < linear ? x[j] : searched[j - linear];
    const double h = 1e-4 * std::max(1e-3, std::abs(moved));
    moved += h;
    const effects::FittedEffect shifted = term.fit->describe(searched, x);
    if (shifted.values.size() != fitted.values.size()) continue;
    for (std::size_t v = 0; v < fitted.values.size(); ++v)
      sensitivity.values(static_cast<Eigen::Index>(v), j) = (shifted.values[v].value - fitted.values[v].value) / h;
    if (fitted.location_m && shifted.location_m)
      sensitivity.location.col(j) = (*shifted.location_m - *fitted.location_m) / h;
  }
  return sensitivity;
}

effects::FittedEffect fittedOf(const identify::GapTerm& term) { return term.fit->describe(term.searched, term.linear); }

/// What a fitted term says, with intervals where its model was refined.
void setFigures(const identify::RefinedModel& refined, std::size_t term, GapCandidate& candidate) {
  const identify::GapTerm& fitted_term = refined.model.terms[term];
  const effects::FittedEffect fitted = fittedOf(fitted_term);
  candidate.effect = fitted_term.effect->id;
  candidate.location_m = fitted.location_m;
  candidate.material = fitted.material;
  candidate.is_plausible = fitted.is_plausible;
  candidate.doubt = fitted.doubt;
  candidate.scene_parameters = fitted.parameters;
  for (const effects::FittedParameter& p : fitted.values)
    candidate.parameters.push_back({p.name, p.unit, p.value, {}, {}});
  if (refined.covariance.size() == 0) return;
  const TermPlace place = placeOf(refined, term);
  const Eigen::Index count = place.linear + place.searched;
  const Eigen::MatrixXd covariance = refined.covariance.block(place.begin, place.begin, count, count);
  const Sensitivity sensitivity = sensitivityOf(fitted_term, fitted);
  for (std::size_t v = 0; v < candidate.parameters.size(); ++v) {
    const Eigen::RowVectorXd row = sensitivity.values.row(static_cast<Eigen::Index>(v));
    const double variance = (row * covariance * row.transpose()).value();
    if (!(variance >= 0.0) || !std::isfinite(variance)) continue;
    const double half = kSdsOfNinety * std::sqrt(variance);
    candidate.parameters[v].low90 = candidate.parameters[v].value - half;
    candidate.parameters[v].high90 = candidate.parameters[v].value + half;
  }
  if (fitted.location_m)
    candidate.location_covariance_m2 = sensitivity.location * covariance * sensitivity.location.transpose();
}

/// Replaces the intervals of searched parameters.
void setIntervals(std::span<const identify::ProfileInterval> intervals, const identify::GapTerm& term,
                  GapCandidate& candidate) {
  const std::vector<effects::FitParameter> names = term.fit->searched();
  for (std::size_t d = 0; d < intervals.size(); ++d) {
    const auto is_it = [&](const Estimate& e) { return e.name == names[d].name; };
    const auto found = std::find_if(candidate.parameters.begin(), candidate.parameters.end(), is_it);
    if (found == candidate.parameters.end()) continue;
    if (intervals[d].low) found->low90 = *intervals[d].low;
    if (intervals[d].high) found->high90 = *intervals[d].high;
  }
}

}  // namespace

void describeTerm(const identify::RefinedModel& refined, std::size_t term,
                  std::span<const identify::ProfileInterval> intervals, const identify::Thresholds& thresholds,
                  GapCandidate& candidate) {
  const identify::GapTerm& described = refined.model.terms[term];
  setFigures(refined, term, candidate);
  setIntervals(intervals, described, candidate);
  widenPlaced(fittedOf(described), thresholds, candidate);
  keepWithinSearch(*described.fit, candidate);
}

}  // namespace fieldtrue::gap
