#include "calib/identify/profile.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::identify {
namespace {

constexpr double kFall = 2.706;  // 90 % of chi-square with one degree of freedom.

/// One side of the interval: the distance at which the fall is reached, by secants on its square root, which is linear
/// where the likelihood is normal.
std::optional<double> side(const GapSearch& search, const RefinedModel& refined, std::size_t term,
                           Eigen::Index searched, Eigen::Index column, double first_step, double best_bic) {
  constexpr int kMostSteps = 4;
  GapModel model = refined.model;
  const double center = model.terms[term].searched[searched];
  double step = first_step;
  double inner = 0.0;
  double inner_root = 0.0;
  for (int i = 0; i < kMostSteps; ++i) {
    model.terms[term].searched[searched] = center + step;
    if (!model.terms[term].fit->allows(model.terms[term].searched)) return std::nullopt;
    model = search.fittedWithout(model, column);
    const double root = std::sqrt(std::max(0.0, search.bicOf(model) - best_bic));
    const double wanted = std::sqrt(kFall);
    if (std::abs(root - wanted) < 0.1 * wanted) return center + step;
    if (root < wanted) {
      inner = step;
      inner_root = root;
      step *= std::clamp(root > 0.0 ? wanted / root : 3.0, 1.1, 3.0);
    } else {
      const double share = (wanted - inner_root) / (root - inner_root);
      step = inner + std::clamp(share, 0.1, 0.95) * (step - inner);
    }
  }
  return center + step;
}

}  // namespace

ProfileInterval profileInterval(const GapSearch& search, const RefinedModel& refined, std::size_t term,
                                Eigen::Index searched) {
  Eigen::Index column = refined.n_alignment;
  for (std::size_t t = 0; t < term; ++t)
    column += refined.model.terms[t].linear.size() + refined.model.terms[t].searched.size();
  column += refined.model.terms[term].linear.size() + searched;
  const double variance = refined.covariance(column, column);
  if (!(variance > 0.0) || !std::isfinite(variance)) return {};
  const double step = std::sqrt(kFall * variance);
  const double best_bic = search.bicOf(refined.model);
  ProfileInterval interval;
  interval.low = side(search, refined, term, searched, column, -step, best_bic);
  interval.high = side(search, refined, term, searched, column, step, best_bic);
  return interval;
}

}  // namespace fieldtrue::identify
