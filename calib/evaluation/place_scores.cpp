#include "calib/evaluation/place_scores.h"

#include <cmath>
#include <map>

namespace fieldtrue::evaluation {

PlaceScores gatherByPlace(const std::vector<int>& places, std::span<const Node> nodes,
                          std::span<const RowScore> scores) {
  FT_CHECK(nodes.size() == scores.size());
  std::map<int, std::size_t> slot;
  for (std::size_t i = 0; i < places.size(); ++i) slot[places[i]] = i;
  PlaceScores gathered{std::vector<double>(places.size(), 0.0),
                       std::vector<Eigen::Vector3d>(places.size(), Eigen::Vector3d::Zero()),
                       std::vector<bool>(places.size(), true)};
  std::vector<double> n_rows(places.size(), 0.0);
  for (std::size_t row = 0; row < nodes.size(); ++row) {
    const auto found = slot.find(nodes[row].node);
    if (found == slot.end()) continue;
    const std::size_t i = found->second;
    n_rows[i] += 1.0;
    gathered.errors[i] += scores[row].error * scores[row].error;
    gathered.residual_m[i] += scores[row].residual_m;
    gathered.covered[i] = gathered.covered[i] && scores[row].covered;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    FT_CHECK(n_rows[i] > 0.0);
    gathered.errors[i] = std::sqrt(gathered.errors[i] / n_rows[i]);
    gathered.residual_m[i] /= n_rows[i];
  }
  return gathered;
}

}  // namespace fieldtrue::evaluation
