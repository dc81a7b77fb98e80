#include "calib/effects/room_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/core/units.h"

namespace fieldtrue::effects {

namespace {

constexpr double kNearestToPlace_m = 0.12;
constexpr double kNearestToTransmitter_m = 0.15;
/// A fit may end a little nearer than the grid of starts goes.
constexpr double kLooser = 0.8;

/// Whether a point of a lattice of `counts` intervals lies on its surface.
bool isOnSurface(const Eigen::Vector3i& at, const Eigen::Vector3i& counts) {
  return (at.array() == 0).any() || (at.array() == counts.array()).any();
}

}  // namespace

RoomSearch::RoomSearch(const FitDesign& design) : box_m_(design.places_m) {
  for (const field::SensorSetting& setting : design.settings) {
    places_m_.push_back(setting.tracker_from_sensor.position_m);
    box_m_.extend(places_m_.back());
  }
  if (!box_m_.isEmpty()) extent_m_ = std::max(extent_m_, box_m_.sizes().maxCoeff());
  if (box_m_.isEmpty()) box_m_.extend(Eigen::Vector3d::Zero());
  keep_away_m_ = std::max(kNearestToPlace_m, 0.5 * design.pitch_m);
  const double reach_m = std::max(2.5 * extent_m_, 1.5);
  bounds_m_ = box_m_;
  bounds_m_.extend(Eigen::Vector3d::Zero());
  bounds_m_ = {bounds_m_.min().array() - reach_m, bounds_m_.max().array() + reach_m};
}

double RoomSearch::nearestPlace_m(const Eigen::Vector3d& p_m) const {
  double least_m2 = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& place_m : places_m_) least_m2 = std::min(least_m2, (place_m - p_m).squaredNorm());
  return std::sqrt(least_m2);
}

double RoomSearch::farthestAlong_m(const Eigen::Vector3d& direction) const {
  double farthest_m = 0.0;
  for (const Eigen::Vector3d& place_m : places_m_) farthest_m = std::max(farthest_m, direction.dot(place_m));
  return farthest_m;
}

std::vector<FitParameter> RoomSearch::centerParameters() const {
  const char* const kNames[] = {"center_x_m", "center_y_m", "center_z_m"};
  std::vector<FitParameter> parameters;
  for (int i = 0; i < 3; ++i) parameters.push_back({kNames[i], "m", bounds_m_.min()[i], bounds_m_.max()[i]});
  return parameters;
}

bool RoomSearch::isClear(const Eigen::Vector3d& p_m, double share) const {
  return p_m.norm() >= share * kNearestToTransmitter_m && nearestPlace_m(p_m) >= share * keep_away_m_;
}

bool RoomSearch::allowsCenter(const Eigen::Vector3d& center_m) const {
  return center_m.allFinite() && bounds_m_.contains(center_m) && isClear(center_m, kLooser);
}

std::vector<Eigen::Vector3d> RoomSearch::around_m(double spacing, const std::vector<double>& shells) const {
  std::vector<Eigen::Vector3d> found_m;
  for (const double shell : shells) {
    const double out_m = std::max(shell * extent_m_, 1.2 * keep_away_m_);
    const Eigen::Vector3d low_m = box_m_.min().array() - out_m;
    const Eigen::Vector3d size_m = box_m_.sizes().array() + 2.0 * out_m;
    const double spacing_m = spacing * extent_m_ + 0.55 * (out_m - shells.front() * extent_m_);
    const Eigen::Vector3i counts = (size_m / spacing_m).array().round().max(1.0).matrix().cast<int>();
    for (int i = 0; i <= counts.x(); ++i) {
      for (int j = 0; j <= counts.y(); ++j) {
        for (int k = 0; k <= counts.z(); ++k) {
          const Eigen::Vector3i at(i, j, k);
          if (!isOnSurface(at, counts)) continue;
          const Eigen::Vector3d share = at.cast<double>().cwiseQuotient(counts.cast<double>());
          const Eigen::Vector3d p_m = low_m + size_m.cwiseProduct(share);
          if (isClear(p_m, 1.0)) found_m.push_back(p_m);
        }
      }
    }
  }
  return found_m;
}

std::vector<Eigen::Vector3d> RoomSearch::aboutTransmitter_m() const {
  std::vector<Eigen::Vector3d> found_m;
  for (const double radius_m : {0.3, 0.6}) {
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        for (int k = -1; k <= 1; ++k) {
          const Eigen::Vector3d direction(i, j, k);
          const double squared = direction.squaredNorm();
          if (squared != 1.0 && squared != 3.0) continue;
          const Eigen::Vector3d p_m = radius_m * direction.normalized();
          if (isClear(p_m, 1.0) && !box_m_.contains(p_m)) found_m.push_back(p_m);
        }
      }
    }
  }
  return found_m;
}

DirectionChart::DirectionChart()
    : tracker_from_chart_(
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d(1.0, 1.0, 0.0))) {}

Eigen::Vector3d DirectionChart::direction(double latitude_rad, double longitude_rad) const {
  const double around = std::cos(latitude_rad);
  return tracker_from_chart_ *
         Eigen::Vector3d(around * std::cos(longitude_rad), around * std::sin(longitude_rad), std::sin(latitude_rad));
}

Eigen::Vector2d DirectionChart::angles_rad(const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d v = tracker_from_chart_.conjugate() * direction;
  return {std::asin(std::clamp(v.z(), -1.0, 1.0)), std::atan2(v.y(), v.x())};
}

std::vector<FitParameter> DirectionChart::parameters() {
  return {{"latitude_rad", "rad", -0.5 * kPi, 0.5 * kPi}, {"longitude_rad", "rad", -2.0 * kPi, 2.0 * kPi}};
}

std::span<const Eigen::Vector3d> firstNormals() {
  constexpr double kDiagonal = 0.57735026918962576;
  static const std::array<Eigen::Vector3d, 7> normals = {{{1, 0, 0},
                                                          {0, 1, 0},
                                                          {0, 0, 1},
                                                          {kDiagonal, kDiagonal, kDiagonal},
                                                          {kDiagonal, -kDiagonal, -kDiagonal},
                                                          {-kDiagonal, kDiagonal, -kDiagonal},
                                                          {-kDiagonal, -kDiagonal, kDiagonal}}};
  return normals;
}

Eigen::VectorXd joined(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd both(a.size() + b.size());
  both << a, b;
  return both;
}

}  // namespace fieldtrue::effects
