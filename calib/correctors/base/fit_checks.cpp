#include "calib/correctors/base/fit_checks.h"

#include <map>
#include <set>

#include "calib/correctors/base/fit_names.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kSamePlace_m = 0.005;

Eigen::MatrixXd rowsOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) rows.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  return rows;
}

}  // namespace

Places mergePlaces(const FitData& data) {
  Places places;
  std::map<int, std::vector<std::size_t>> groups_of_node;
  for (std::size_t row = 0; row < data.size(); ++row) {
    std::vector<std::size_t>& groups = groups_of_node[data.node[row]];
    std::size_t group = places.size();
    for (const std::size_t candidate : groups) {
      const Eigen::Vector3d& first_true_m = data.p_true_m[places.rows[candidate].front()];
      if ((first_true_m - data.p_true_m[row]).norm() <= kSamePlace_m) group = candidate;
    }
    if (group == places.size()) {
      groups.push_back(group);
      places.node.push_back(data.node[row]);
      if (!data.index.empty()) places.index.push_back(data.index[row]);
      places.rows.emplace_back();
      places.p_tracked_m.emplace_back(Eigen::Vector3d::Zero());
      places.p_true_m.emplace_back(Eigen::Vector3d::Zero());
    }
    places.rows[group].push_back(row);
    places.p_tracked_m[group] += data.p_tracked_m[row];
    places.p_true_m[group] += data.p_true_m[row];
  }
  for (std::size_t group = 0; group < places.size(); ++group) {
    const auto n_rows = static_cast<double>(places.rows[group].size());
    places.p_tracked_m[group] /= n_rows;
    places.p_true_m[group] /= n_rows;
  }
  return places;
}

Eigen::MatrixXd positionMatrix(const Places& places) { return rowsOf(places.p_tracked_m); }

Eigen::MatrixXd truthMatrix(const Places& places) { return rowsOf(places.p_true_m); }

int fewestLevels(const FitData& data) {
  int fewest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::set<int> levels;
    for (const auto& index : data.index) levels.insert(index[axis]);
    const auto n = static_cast<int>(levels.size());
    if (n > 1 && (fewest == 0 || n < fewest)) fewest = n;
  }
  return fewest;
}

Result<void> checkPositions(const FitData& data, const std::string& method) {
  FT_CHECK(data.p_true_m.size() == data.size() && data.node.size() == data.size());
  if (data.size() == 0) return fail(ErrorCode::kTooFewNodes, method + " needs measured places, got none");
  for (std::size_t row = 0; row < data.size(); ++row) {
    if (!data.p_tracked_m[row].allFinite() || !data.p_true_m[row].allFinite())
      return fail(ErrorCode::kBadInput,
                  method + ": " + rowName(data, row) + " has a coordinate that is not a finite number");
  }
  return {};
}

Result<void> checkOrientations(const FitData& data, const std::string& method) {
  if (auto positions = checkPositions(data, method); !positions) return positions;
  if (!data.hasOrientation())
    return fail(ErrorCode::kUnsupported,
                method + " needs an orientation in every row, and the table has rows without one");
  FT_CHECK(data.q_tracked.size() == data.size() && data.q_true.size() == data.size());
  for (std::size_t row = 0; row < data.size(); ++row) {
    const double norm_tracked = data.q_tracked[row].norm();
    const double norm_true = data.q_true[row].norm();
    if (!(std::abs(norm_tracked - 1.0) < 1e-3) || !(std::abs(norm_true - 1.0) < 1e-3))
      return fail(ErrorCode::kBadInput,
                  method + ": " + rowName(data, row) + " has an orientation that is not a unit quaternion");
  }
  return {};
}

Result<void> checkSpread(const std::string& method, std::size_t n_places, int dimension) {
  if (dimension >= 2) return {};
  return fail(ErrorCode::kDegenerate, method + " needs places that span a plane or a volume, and these " +
                                          std::to_string(n_places) + " lie " +
                                          (dimension == 1 ? "on one line" : "at one point"));
}

std::string planeNote(const FitData& data, const std::string& how) {
  return data.dimension == 2 ? "The places lie in one plane: " + how + "." : std::string();
}

}  // namespace fieldtrue::correctors
