#include "calib/simulation/scene.h"

#include <charconv>
#include <string_view>

#include "calib/core/file_io.h"
#include "calib/effects/effect_row.h"
#include "calib/effects/object_reader.h"
#include "calib/effects/registry.h"
#include "calib/field/pose_solver.h"
#include "calib/tables/json_text.h"

namespace fieldtrue::simulation {

namespace {

constexpr std::string_view kSchema = "fieldtrue.scene/";
constexpr int kVersion = 1;
constexpr double kFarthest_m = 1000.0;

const nlohmann::json& emptyObject() {
  static const nlohmann::json kEmpty = nlohmann::json::object();
  return kEmpty;
}

/// The object of a key, or an empty one: its defaults then hold.
const nlohmann::json& objectOf(effects::ObjectReader& reader, const std::string& key) {
  const nlohmann::json* found = reader.object(key);
  return found == nullptr ? emptyObject() : *found;
}

Result<void> checkSchema(const nlohmann::json& json, const std::string& file) {
  const auto found = json.is_object() ? json.find("schema") : json.end();
  if (found == json.end()) return {};
  const std::string schema = found->is_string() ? found->get<std::string>() : std::string();
  int version = 0;
  if (schema.starts_with(kSchema)) {
    std::from_chars(schema.data() + kSchema.size(), schema.data() + schema.size(), version);
  }
  const std::string known = std::string(kSchema) + std::to_string(kVersion);
  if (version > kVersion) {
    return fail(ErrorCode::kNewerVersion, file + ": schema is \"" + schema +
                                              "\", written by a newer version of Fieldtrue; this one reads " + known +
                                              ".");
  }
  if (schema == known) return {};
  return fail(ErrorCode::kBadInput,
              file + ": schema is " + effects::seenValue(*found) + "; a scene has \"" + known + "\".");
}

std::vector<std::string> solverNames() {
  std::vector<std::string> names;
  for (const field::PoseSolver solver :
       {field::PoseSolver::kClosedForm, field::PoseSolver::kLeastSquares, field::PoseSolver::kDamped}) {
    names.emplace_back(field::nameOf(solver));
  }
  return names;
}

Result<TrackerModel> trackerFrom(const nlohmann::json& json, const std::string& file) {
  effects::ObjectReader reader(json, file, "tracker");
  TrackerModel tracker;
  reader.text("name", tracker.name);
  reader.choice("excitation", tracker.excitation, {"ac", "pulsed_dc"});
  reader.number("carrier_hz", tracker.carrier_hz, {1.0, 1e6}, "Hz");
  reader.number("sampling_delay_s", tracker.sampling_delay_s, {0.0, 1.0}, "s");
  reader.choice("solver", tracker.solver, solverNames());
  reader.number("dipole_constant_m3", tracker.dipole_constant_m3, {1e-9, 1e9}, "m^3");
  reader.number("rate_hz", tracker.rate_hz, {0.1, 1e4}, "Hz");
  reader.number("quantum_m", tracker.quantum_m, {0.0, 0.1}, "m");
  reader.number("coupling_noise", tracker.coupling_noise, {0.0, 1e9}, "dipole_constant_m3/m^3");
  reader.number("correlation", tracker.correlation, {0.0, 0.999}, "");
  reader.number("nearest_range_m", tracker.nearest_range_m, {0.0, kFarthest_m}, "m");
  reader.number("farthest_range_m", tracker.farthest_range_m, {0.01, kFarthest_m}, "m");
  if (const Result<void> done = reader.finish(); !done) return tl::unexpected<Error>(done.error());
  if (tracker.nearest_range_m >= tracker.farthest_range_m) {
    return fail(ErrorCode::kBadInput, file + ": tracker.nearest_range_m is " + formatNumber(tracker.nearest_range_m) +
                                          "; it must be less than farthest_range_m, " +
                                          formatNumber(tracker.farthest_range_m) + ".");
  }
  return tracker;
}

Result<Pose> transmitterFrom(const nlohmann::json& json, const std::string& file) {
  effects::ObjectReader reader(json, file, "transmitter");
  Pose pose;
  reader.vector3("position_m", pose.position_m, kFarthest_m, "m");
  reader.quaternion("orientation_wxyz", pose.orientation);
  if (const Result<void> done = reader.finish(); !done) return tl::unexpected<Error>(done.error());
  return pose;
}

Result<RigModel> rigFrom(const nlohmann::json& json, const std::string& file) {
  effects::ObjectReader reader(json, file, "rig");
  RigModel rig;
  std::string alignment = "unknown";
  reader.text("name", rig.name);
  reader.number("tolerance_m", rig.tolerance_m, {0.0, 1.0}, "m");
  reader.number("tolerance_rad", rig.tolerance_rad, {0.0, 1.0}, "rad");
  reader.choice("alignment", alignment, {"known", "unknown"});
  reader.number("alignment_tolerance_m", rig.alignment_tolerance_m, {0.0, 1.0}, "m");
  reader.number("alignment_tolerance_rad", rig.alignment_tolerance_rad, {0.0, 1.0}, "rad");
  if (const Result<void> done = reader.finish(); !done) return tl::unexpected<Error>(done.error());
  rig.alignment_known = alignment == "known";
  if (!rig.alignment_known && (rig.alignment_tolerance_m > 0.0 || rig.alignment_tolerance_rad > 0.0)) {
    return fail(ErrorCode::kBadInput, file +
                                          ": rig has an alignment tolerance but its alignment is unknown; set "
                                          "rig.alignment to \"known\" or leave the tolerance out.");
  }
  return rig;
}

Result<EffectInstance> effectFrom(const nlohmann::json& json, const std::string& file, std::size_t index,
                                  const field::Excitation& excitation) {
  const std::string path = "effects[" + std::to_string(index) + "]";
  effects::ObjectReader reader(json, file, path);
  EffectInstance instance;
  reader.text("id", instance.id);
  const nlohmann::json& given = objectOf(reader, "parameters");
  if (const Result<void> done = reader.finish(); !done) return tl::unexpected<Error>(done.error());
  const auto located = [&](const Error& error) { return fail(error.code, file + ": " + path + ": " + error.message); };
  const Result<const effects::Effect*> effect = effects::findEffect(instance.id);
  if (!effect) return located(effect.error());
  Result<nlohmann::json> parameters = effects::resolveEffectParameters(**effect, given);
  if (!parameters) return located(parameters.error());
  if (const auto made = (*effect)->make(*parameters, excitation); !made) return located(made.error());
  instance.parameters = std::move(*parameters);
  return instance;
}

}  // namespace

field::Excitation excitationOf(const TrackerModel& tracker) {
  return {tracker.excitation == "pulsed_dc", tracker.carrier_hz, tracker.sampling_delay_s};
}

Result<Scene> sceneFromJson(const nlohmann::json& json, const std::string& name) {
  if (const Result<void> schema = checkSchema(json, name); !schema) return tl::unexpected<Error>(schema.error());
  effects::ObjectReader reader(json, name, "");
  Scene scene;
  reader.value("schema");
  reader.text("name", scene.name);
  const nlohmann::json& tracker_json = objectOf(reader, "tracker");
  const nlohmann::json& transmitter_json = objectOf(reader, "transmitter");
  const nlohmann::json& rig_json = objectOf(reader, "rig");
  const nlohmann::json* effects_json = reader.list("effects");
  if (const Result<void> done = reader.finish(); !done) return tl::unexpected<Error>(done.error());

  const Result<TrackerModel> tracker = trackerFrom(tracker_json, name);
  if (!tracker) return tl::unexpected<Error>(tracker.error());
  const Result<Pose> transmitter = transmitterFrom(transmitter_json, name);
  if (!transmitter) return tl::unexpected<Error>(transmitter.error());
  const Result<RigModel> rig = rigFrom(rig_json, name);
  if (!rig) return tl::unexpected<Error>(rig.error());
  scene.tracker = *tracker;
  scene.reference_from_tracker = *transmitter;
  scene.rig = *rig;
  for (std::size_t i = 0; effects_json != nullptr && i < effects_json->size(); ++i) {
    Result<EffectInstance> effect = effectFrom((*effects_json)[i], name, i, excitationOf(scene.tracker));
    if (!effect) return tl::unexpected<Error>(effect.error());
    scene.effects.push_back(std::move(*effect));
  }
  return scene;
}

Result<Scene> readScene(const std::filesystem::path& path) {
  const Result<std::string> text = readFile(path);
  if (!text) return tl::unexpected<Error>(text.error());
  const std::string name = path.filename().string();
  const Result<nlohmann::json> json = parseJson(*text, name, JsonComments::kSkipped);
  if (!json) return tl::unexpected<Error>(json.error());
  return sceneFromJson(*json, name);
}

nlohmann::json toJson(const Scene& scene) {
  const TrackerModel& t = scene.tracker;
  const RigModel& r = scene.rig;
  const Eigen::Vector3d& p_m = scene.reference_from_tracker.position_m;
  const Eigen::Quaterniond q = canonical(scene.reference_from_tracker.orientation);
  nlohmann::json effects = nlohmann::json::array();
  for (const EffectInstance& effect : scene.effects) {
    effects.push_back(
        {{"id", effect.id}, {"parameters", effect.parameters.is_null() ? emptyObject() : effect.parameters}});
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
          {"transmitter",
           {{"position_m", {p_m.x(), p_m.y(), p_m.z()}}, {"orientation_wxyz", {q.w(), q.x(), q.y(), q.z()}}}},
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
