#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

namespace fieldtrue::effects {

enum class DrawnShape { kBall, kPlane, kPlate, kLoop };

/// The shape of a thing that stands in the room, for those who draw it. Its place is where the fit says.
struct EffectBody {
  DrawnShape shape = DrawnShape::kBall;
  /// Unit, tracker frame; of plane, plate and loop. A plane's points away from the transmitter.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d side = Eigen::Vector3d::UnitX();  ///< Unit, tracker frame; along a plate's length.
  double radius_m = 0.0;                            ///< Of ball and loop; 0 = not known.
  double length_m = 0.0;                            ///< Of a plate, along `side`.
  double width_m = 0.0;                             ///< Of a plate.
};

/// The body that an effect's parameters describe, as a scene holds them; what they lack is not known.
EffectBody ballOf(const nlohmann::json& parameters);
EffectBody planeOf(const nlohmann::json& parameters);
EffectBody plateOf(const nlohmann::json& parameters);
EffectBody loopOf(const nlohmann::json& parameters);

}  // namespace fieldtrue::effects
