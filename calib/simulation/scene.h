#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/field/effect.h"

namespace fieldtrue::simulation {

/// The tracker as the simulator believes it to be. Every default is that of a long-range AC tracker of the Fastrak
/// kind.
struct TrackerModel {
  std::string name = "simulated tracker";
  std::string excitation = "ac";       ///< `ac` or `pulsed_dc`.
  double carrier_hz = 10016.0;         ///< AC only.
  double sampling_delay_s = 0.0;       ///< Pulsed DC: from the pulse's edge to the reading.
  std::string solver = "closed_form";  ///< `closed_form`, `least_squares` or `damped`: from couplings to a pose.
  double dipole_constant_m3 = 1.0;     ///< C of G(p) = C (3uu^T - I)/r^3; couplings are in these units.
  double rate_hz = 120.0;              ///< Readings per second.
  double quantum_m = 0.0;              ///< Lattice of reported positions; 0 = none.
  double coupling_noise = 2.0e-4;      ///< SD of each coupling in each reading (units of dipole_constant_m3 / m^3).
  double correlation = 0.0;            ///< Of the noise of successive readings, left by the tracker's filter, [0, 1).
  double nearest_range_m = 0.1;        ///< Nearer, the receiver saturates.
  double farthest_range_m = 9.144;     ///< Farther, the signal is too weak. 30 ft, the long-range transmitter's reach.
};

/// How it drives its transmitter, as effects ask for it.
field::Excitation excitationOf(const TrackerModel& tracker);

/// How truth is known: the jig and its tolerances.
struct RigModel {
  std::string name = "wooden jig";
  double tolerance_m = 0.0;              ///< SD of placing, per axis, anew on every visit.
  double tolerance_rad = 0.0;            ///< SD of placing, per axis, anew on every visit.
  bool alignment_known = false;          ///< Whether the rig says where the transmitter stands.
  double alignment_tolerance_m = 0.0;    ///< Where it says so: SD of the transmitter's true place about it, per axis.
  double alignment_tolerance_rad = 0.0;  ///< Likewise of its rotation, per axis.
};

/// An effect in the scene: an id of the effect registry and its parameters (defaults filled in on reading).
struct EffectInstance {
  std::string id;
  nlohmann::json parameters;
};

/// The effects themselves, in their order. @error kBadInput as effects::makeEffect, of the first that cannot be made
Result<std::vector<std::unique_ptr<field::PhysicalEffect>>> makeEffects(std::span<const EffectInstance> instances,
                                                                        const field::Excitation& excitation = {});

/// What the simulator believes about the room. Effects' positions are in the tracker (transmitter) frame [m].
struct Scene {
  std::string name = "clean room";
  TrackerModel tracker;
  Pose reference_from_tracker;  ///< Transmitter pose in the rig's frame.
  RigModel rig;
  Pose mount_from_sensor;  ///< The sensor in the holder whose poses the rig states.
  std::vector<EffectInstance> effects;
};

/// Reads `*.scene.json` (`fieldtrue.scene/1`): the keys `schema`, `name`, `tracker`, `transmitter` (`position_m`,
/// `orientation_wxyz`: its pose in the rig's frame), `sensor_mount` (likewise, the sensor's in its holder), `rig` and
/// `effects` (list of `id`, `parameters`). Every key is optional but an effect's id; the keys of `tracker` and `rig`
/// are the members above, `alignment` is `known` or `unknown`. A key `comment` may stand anywhere and is ignored, and
/// so are // comments.
/// @error kIo; kBadInput naming the key, what was seen and what is needed; kNewerVersion
Result<Scene> readScene(const std::filesystem::path& path);
/// @param name stands in error messages ("lab.scene.json")
Result<Scene> sceneFromJson(const nlohmann::json& json, const std::string& name);
/// Writes every key; reading it back gives the same scene, bit for bit.
nlohmann::json toJson(const Scene& scene);

}  // namespace fieldtrue::simulation
