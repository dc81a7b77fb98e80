#include "calib/correctors/baked/baked_position.h"

#include <algorithm>
#include <random>
#include <vector>

#include "calib/core/number_text.h"
#include "calib/correctors/baked/baked_lattice_maker.h"
#include "calib/correctors/baked/turning_lattices.h"
#include "calib/correctors/base/sensor_coils.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kPosesTried = 4000;
constexpr std::size_t kMostPoseDraws = 40 * kPosesTried;
/// How far a pose that is tried near an orientation is turned from it.
constexpr double kNear_rad = 0.3;

class RegionMaker : public LatticeMaker {
 public:
  RegionMaker(const Region& region, std::span<const Eigen::Vector3d> places_m, const RunControl& control)
      : region_(region), places_m_(places_m), control_(control) {}

  Result<std::unique_ptr<PositionModel>> make(const PositionModel& of_position, double max_deviation_m) const override {
    FT_TRY(auto lattice, bakeLattice(of_position, region_, places_m_, max_deviation_m, control_));
    return lattice;
  }

 private:
  const Region& region_;
  std::span<const Eigen::Vector3d> places_m_;
  const RunControl& control_;
};

/// Poses drawn in the region; every second one near an orientation of the fit.
std::vector<Pose> posesIn(const Region& region, std::span<const Eigen::Vector3d> places_m,
                          std::span<const Eigen::Quaterniond> orientations) {
  std::mt19937_64 generator(1);
  // The generator's own bits, since the standard leaves its distributions to each library.
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
  const auto signedVector = [&] {
    return Eigen::Vector3d(2.0 * uniform() - 1.0, 2.0 * uniform() - 1.0, 2.0 * uniform() - 1.0);
  };
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p_m : places_m) box.extend(p_m);
  std::vector<Pose> poses;
  for (std::size_t draw = 0; draw < kMostPoseDraws && poses.size() < kPosesTried; ++draw) {
    Pose pose{box.center() + 0.5 * box.sizes().cwiseProduct(signedVector()),
              rotationFromVector(kNear_rad * signedVector())};
    if (orientations.empty() || draw % 2 == 0)
      pose.orientation = Eigen::Quaterniond(Eigen::Vector4d(2.0 * uniform() - 1.0, 2.0 * uniform() - 1.0,
                                                            2.0 * uniform() - 1.0, 2.0 * uniform() - 1.0))
                             .normalized();
    else
      pose.orientation = pose.orientation * orientations[draw / 2 % orientations.size()];
    if (region.contains(pose.position_m)) poses.push_back(pose);
  }
  return poses;
}

double largestDeviation_m(const PositionModel& model, const PositionModel& baked, const std::vector<Pose>& poses,
                          const RunControl& control) {
  std::vector<double> deviation_m(poses.size(), 0.0);
  control.parallel_for(poses.size(), [&](std::size_t i) {
    if (model.covers(poses[i].position_m) && baked.covers(poses[i].position_m))
      deviation_m[i] = (model.displacementAt_m(poses[i]) - baked.displacementAt_m(poses[i])).norm();
  });
  return deviation_m.empty() ? 0.0 : *std::max_element(deviation_m.begin(), deviation_m.end());
}

}  // namespace

Result<std::unique_ptr<PositionModel>> bakePosition(const PositionModel& model, const Region& region,
                                                    std::span<const Eigen::Vector3d> places_m,
                                                    std::span<const Eigen::Quaterniond> orientations,
                                                    double max_deviation_m, const RunControl& control) {
  FT_TRY(auto baked, model.onLattices(RegionMaker(region, places_m, control), max_deviation_m));
  if (!model.takesOrientation()) return baked;
  const double off_m = largestDeviation_m(model, *baked, posesIn(region, places_m, orientations), control);
  if (!(off_m <= max_deviation_m))
    return fail(ErrorCode::kUnsupported,
                "Lattices cannot follow how this correction depends on the sensor's orientation within " +
                    significantText(1e6 * max_deviation_m) + " um: they are off it by up to " +
                    significantText(1e6 * off_m) + " um; ask for a larger deviation, or use it as it is");
  return baked;
}

std::unique_ptr<PositionModel> readBaked(const JsonReader& parameters) {
  if (parameters.has("coils")) return readCoils(parameters, readBaked);
  if (parameters.has("turning")) return TurningLattices::fromJson(parameters);
  return BakedLattice::fromJson(parameters);
}

}  // namespace fieldtrue::correctors
