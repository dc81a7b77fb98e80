#pragma once

#include <Eigen/Core>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "calib/effects/effect_row.h"
#include "calib/effects/room_search.h"

namespace fieldtrue::effects {

/// A compact metal body as the effects with one know it.
struct MetalBody {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();           ///< Tracker frame.
  Eigen::Matrix3d polarizability_m3 = Eigen::Matrix3d::Zero();  ///< Symmetric, tracker axes.
  double radius_m = 0.0;                                        ///< Within it is metal.

  /// Change of the field matrix at a sensor for C = 1 [1/m^3].
  Eigen::Matrix3d fieldChange_per_m3(const Eigen::Vector3d& p_sensor_m) const;
};

/// center_m, radius_m, material, relative_permeability, conductivity_s_per_m, polarizability_m3.
std::vector<Setting> bodyParameters();

/// @param effect_id stands in the message
/// @error kBadInput when the transmitter would be inside the body
Result<MetalBody> bodyOf(const nlohmann::json& parameters, const field::Excitation& excitation,
                         const std::string& effect_id);

/// The ways a body can answer: alike in all directions, or as a general symmetric tensor.
enum class BodyShape { kSphere, kTensor };

/// Linear parameters: polarizability_m3, or its six components xx yy zz xy xz yz.
std::vector<FitParameter> polarizabilityParameters(BodyShape shape);

/// Field changes per unit of each linear parameter, for C = 1 [1/m^3]; adds nothing else.
/// @param field_of_transmitter G(center; 1/(4 pi))
/// @param responses one per linear parameter, overwritten
void respondAsBody(BodyShape shape, const Eigen::Vector3d& center_m, const Eigen::Matrix3d& field_of_transmitter,
                   const Eigen::Vector3d& p_sensor_m, std::span<field::EffectResponse> responses);

/// A fitted body in scene parameters, with its material from the sign of its polarizability.
/// @param linear in the order of polarizabilityParameters
FittedEffect describeBody(BodyShape shape, const Eigen::Vector3d& center_m, const Eigen::VectorXd& linear,
                          const RoomSearch& search);

}  // namespace fieldtrue::effects
