#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "calib/core/error.h"
#include "calib/core/pose.h"

namespace fieldtrue {

/// The tracker as the simulator believes it to be. Every default is that of a long-range AC tracker of the Fastrak kind.
struct TrackerModel {
  std::string excitation = "ac";  ///< `ac` or `pulsed_dc`.
  double carrier_hz = 10016.0;
  double sampling_delay_s = 0.0;      ///< Pulsed DC: from the pulse's edge to the reading.
  double dipole_constant_m3 = 1.0;    ///< C of G(p) = C (3uu^T - I)/r^3; couplings are in these units.
  double rate_hz = 120.0;
  double quantum_m = 0.0;             ///< Lattice of reported positions; 0 = none.
  double coupling_noise = 2.0e-4;     ///< SD of each of the nine couplings (units of dipole_constant_m3 / m^3), per sample.
  double correlation = 0.0;           ///< Lag-1 autocorrelation of successive readings left by the tracker's filter, [0, 1).
};

/// How truth is known: the jig and its tolerances.
struct RigModel {
  std::string name = "wooden jig";
  double tolerance_m = 0.0;    ///< SD of placing, per axis.
  double tolerance_rad = 0.0;  ///< SD of placing, per axis.
};

/// An effect in the scene: an id of the effect registry and its parameters (defaults filled in on reading).
struct EffectInstance {
  std::string id;
  nlohmann::json parameters;
};

/// What the simulator believes about the room. Effects' positions are in the tracker (transmitter) frame [m].
struct Scene {
  std::string name = "clean room";
  TrackerModel tracker;
  Pose reference_from_tracker;  ///< Transmitter pose in the rig's frame.
  RigModel rig;
  std::vector<EffectInstance> effects;
};

/// Reads `*.scene.json` (`fieldtrue.scene/1`).
/// @error kIo; kBadInput naming the key, what was seen and what is needed; kNewerVersion
Result<Scene> readScene(const std::filesystem::path& path);
Result<Scene> sceneFromJson(const nlohmann::json& json, const std::string& name);
nlohmann::json toJson(const Scene& scene);

}  // namespace fieldtrue
