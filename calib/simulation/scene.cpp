#include "calib/simulation/scene.h"

#include <string_view>

#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"
#include "calib/effects/effect_row.h"
#include "calib/effects/registry.h"
#include "calib/field/pose_solver.h"

namespace fieldtrue::simulation {

namespace {

constexpr std::string_view kSchema = "fieldtrue.scene/";
constexpr int kVersion = 1;
constexpr double kFarthest_m = 1000.0;

std::vector<std::string> solverNames() {
  std::vector<std::string> names;
  for (const field::PoseSolver solver :
       {field::PoseSolver::kClosedForm, field::PoseSolver::kLeastSquares, field::PoseSolver::kDamped}) {
    names.emplace_back(field::nameOf(solver));
  }
  return names;
}

TrackerModel trackerFrom(const JsonReader& json) {
  TrackerModel tracker;
  json.text("name", tracker.name);
  json.oneOf("excitation", tracker.excitation, {"ac", "pulsed_dc"});
  json.number("carrier_hz", tracker.carrier_hz, {1.0, 1e6}, "Hz");
  json.number("sampling_delay_s", tracker.sampling_delay_s, {0.0, 1.0}, "s");
  json.oneOf("solver", tracker.solver, solverNames());
  json.number("dipole_constant_m3", tracker.dipole_constant_m3, {1e-9, 1e9}, "m^3");
  json.number("rate_hz", tracker.rate_hz, {0.1, 1e4}, "Hz");
  json.number("quantum_m", tracker.quantum_m, {0.0, 0.1}, "m");
  json.number("coupling_noise", tracker.coupling_noise, {0.0, 1e9}, "dipole_constant_m3/m^3");
  json.number("correlation", tracker.correlation, {0.0, 0.999}, "");
  json.number("nearest_range_m", tracker.nearest_range_m, {0.0, kFarthest_m}, "m");
  json.number("farthest_range_m", tracker.farthest_range_m, {0.01, kFarthest_m}, "m");
  json.refuseOtherKeys();
  if (tracker.nearest_range_m >= tracker.farthest_range_m) {
    json.fail("has nearest_range_m " + formatNumber(tracker.nearest_range_m) +
              "; it must be less than farthest_range_m, " + formatNumber(tracker.farthest_range_m) + ".");
  }
  return tracker;
}

Pose poseFrom(const JsonReader& json) {
  Pose pose;
  json.vector3("position_m", pose.position_m, kFarthest_m, "m");
  json.quaternion("orientation_wxyz", pose.orientation);
  json.refuseOtherKeys();
  return pose;
}

RigModel rigFrom(const JsonReader& json) {
  RigModel rig;
  std::string alignment = "unknown";
  json.text("name", rig.name);
  json.number("tolerance_m", rig.tolerance_m, {0.0, 1.0}, "m");
  json.number("tolerance_rad", rig.tolerance_rad, {0.0, 1.0}, "rad");
  json.oneOf("alignment", alignment, {"known", "unknown"});
  json.number("alignment_tolerance_m", rig.alignment_tolerance_m, {0.0, 1.0}, "m");
  json.number("alignment_tolerance_rad", rig.alignment_tolerance_rad, {0.0, 1.0}, "rad");
  json.refuseOtherKeys();
  rig.alignment_known = alignment == "known";
  if (!rig.alignment_known && (rig.alignment_tolerance_m > 0.0 || rig.alignment_tolerance_rad > 0.0)) {
    json.fail(
        "has an alignment tolerance but its alignment is unknown; set rig.alignment to \"known\" or leave the "
        "tolerance out.");
  }
  return rig;
}

EffectInstance effectFrom(const JsonReader& json, const field::Excitation& excitation) {
  EffectInstance instance;
  json.text("id", instance.id);
  nlohmann::json given = nlohmann::json::object();
  if (const auto parameters = json.find("parameters")) given = parameters->object();
  json.refuseOtherKeys();
  const effects::Effect* effect = json.valueOf(effects::findEffect(instance.id));
  instance.parameters = json.valueOf(effects::resolveEffectParameters(*effect, given));
  json.valueOf(effect->make(instance.parameters, excitation));
  return instance;
}

Scene sceneFrom(const JsonReader& json) {
  json.schema(kSchema, kVersion, "a scene");
  Scene scene;
  json.text("name", scene.name);
  const auto tracker = json.find("tracker");
  const auto transmitter = json.find("transmitter");
  const auto mount = json.find("sensor_mount");
  const auto rig = json.find("rig");
  const auto effects = json.find("effects");
  json.refuseOtherKeys();
  if (tracker) scene.tracker = trackerFrom(*tracker);
  if (transmitter) scene.reference_from_tracker = poseFrom(*transmitter);
  if (mount) scene.mount_from_sensor = poseFrom(*mount);
  if (rig) scene.rig = rigFrom(*rig);
  if (!effects) return scene;
  const field::Excitation excitation = excitationOf(scene.tracker);
  scene.effects = effects->list([&](const JsonReader& effect) { return effectFrom(effect, excitation); });
  return scene;
}

}  // namespace

field::Excitation excitationOf(const TrackerModel& tracker) {
  return {tracker.excitation == "pulsed_dc", tracker.carrier_hz, tracker.sampling_delay_s};
}

Result<std::vector<std::unique_ptr<field::PhysicalEffect>>> makeEffects(std::span<const EffectInstance> instances,
                                                                        const field::Excitation& excitation) {
  std::vector<std::unique_ptr<field::PhysicalEffect>> made;
  for (const EffectInstance& instance : instances) {
    FT_TRY(auto effect, effects::makeEffect(instance.id, instance.parameters, excitation));
    made.push_back(std::move(effect));
  }
  return made;
}

Result<Scene> sceneFromJson(const nlohmann::json& json, const std::string& name) {
  return readJson<Scene>(json, name, sceneFrom);
}

Result<Scene> readScene(const std::filesystem::path& path) {
  FT_TRY(const std::string text, readFile(path));
  const std::string name = path.filename().string();
  FT_TRY(const nlohmann::json json, parseJson(text, name, JsonComments::kSkipped));
  return sceneFromJson(json, name);
}

namespace {

nlohmann::json poseToJson(const Pose& pose) {
  const Eigen::Vector3d& p_m = pose.position_m;
  const Eigen::Quaterniond q = canonical(pose.orientation);
  return {{"position_m", {p_m.x(), p_m.y(), p_m.z()}}, {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}}};
}

}  // namespace

nlohmann::json toJson(const Scene& scene) {
  const TrackerModel& t = scene.tracker;
  const RigModel& r = scene.rig;
  nlohmann::json effects = nlohmann::json::array();
  for (const EffectInstance& effect : scene.effects) {
    effects.push_back({{"id", effect.id},
                       {"parameters", effect.parameters.is_null() ? nlohmann::json::object() : effect.parameters}});
  }
  return {{"schema", std::string(kSchema) + std::to_string(kVersion)},
          {"name", scene.name},
          {"tracker",
           {{"name", t.name},
            {"excitation", t.excitation},
            {"carrier_hz", t.carrier_hz},
            {"sampling_delay_s", t.sampling_delay_s},
            {"solver", t.solver},
            {"dipole_constant_m3", t.dipole_constant_m3},
            {"rate_hz", t.rate_hz},
            {"quantum_m", t.quantum_m},
            {"coupling_noise", t.coupling_noise},
            {"correlation", t.correlation},
            {"nearest_range_m", t.nearest_range_m},
            {"farthest_range_m", t.farthest_range_m}}},
          {"transmitter", poseToJson(scene.reference_from_tracker)},
          {"sensor_mount", poseToJson(scene.mount_from_sensor)},
          {"rig",
           {{"name", r.name},
            {"tolerance_m", r.tolerance_m},
            {"tolerance_rad", r.tolerance_rad},
            {"alignment", r.alignment_known ? "known" : "unknown"},
            {"alignment_tolerance_m", r.alignment_tolerance_m},
            {"alignment_tolerance_rad", r.alignment_tolerance_rad}}},
          {"effects", effects}};
}

}  // namespace fieldtrue::simulation
