#include "calib/runtime/runtime_calibration.h"

#include <cmath>
#include <set>
#include <utility>

#include "calib/calibration/calibration_envelope.h"
#include "calib/core/json_reader.h"
#include "calib/core/json_text.h"
#include "calib/correctors/baked/baked_position.h"
#include "calib/runtime/baked_orientation.h"

namespace fieldtrue::runtime {

using calibration::Evaluator;

RuntimeCalibration RuntimeCalibration::fromJson(const JsonReader& content) {
  calibration::checkEnvelope(content);
  RuntimeCalibration made(Evaluator(calibration::evaluatorPartsFrom(content)));
  const JsonReader nodes = content["table"]["nodes"];
  for (const JsonReader& node : nodes.entries())
    made.places_m_.emplace_back(node["sensor"].integer(), node["tracker_from_sensor"].pose().position_m);
  if (const auto seen = content.find("orientations_seen"))
    made.orientations_seen_ = seen->list([](const JsonReader& q) { return q.quaternion(); });
  if (const auto setup = content.find("setup"))
    for (const SetupFact& fact : setupFacts())
      if (const auto value = setup->find(std::string(fact.key)); value && !value->isNull())
        static_cast<void>(state(made.setup_, fact.key, value->text()));
  for (const auto& [key, value] : made.setup_) made.facts_[std::string(kSetupPrefix).append(key)] = value;
  made.facts_["method"] = content["position"]["method"].text();
  made.facts_["orientation_method"] = content["orientation"]["method"].text();
  for (const char* key : {"software", "direction"})
    if (const auto value = content.find(key)) made.facts_[key] = value->text();
  made.prepare();
  return made;
}

Result<RuntimeCalibration> RuntimeCalibration::fromText(const std::string& text, const std::string& name) {
  return parseJson(text, name).and_then([&](const nlohmann::json& content) {
    return readJson<RuntimeCalibration>(content, name, fromJson);
  });
}

void RuntimeCalibration::prepare() const {
  std::set<int> prepared;
  for (const auto& [sensor, p_m] : places_m_) {
    if (prepared.contains(sensor) || !evaluator_.covers(p_m, sensor)) continue;
    static_cast<void>(evaluator_.correctPosition_m(p_m, sensor));
    static_cast<void>(evaluator_.uncertainty_m(p_m, sensor));
    static_cast<void>(evaluator_.uncertaintyAt_m({p_m, Eigen::Quaterniond::Identity()}, sensor));
    prepared.insert(sensor);
  }
}

Result<RuntimeCalibration> RuntimeCalibration::ofSensor(int sensor) const {
  FT_TRY(auto parts, evaluator_.partsOf(sensor));
  RuntimeCalibration one = *this;
  if (!evaluator_.parts().by_sensor.empty())
    std::erase_if(one.places_m_, [&](const auto& place) { return place.first != sensor; });
  one.evaluator_ = Evaluator(std::move(parts));
  return one;
}

Result<RuntimeCalibration> RuntimeCalibration::baked(double max_deviation_m, double max_angle_rad) const {
  if (!(max_deviation_m > 0.0 && std::isfinite(max_deviation_m) && max_angle_rad > 0.0 && std::isfinite(max_angle_rad)))
    return fail(ErrorCode::kBadInput, "Baking needs a largest deviation and a largest angle above 0");
  Evaluator::Parts parts = evaluator_.parts();
  const auto bake = [&](calibration::Correction& correction, std::optional<int> sensor) -> Result<void> {
    std::vector<Eigen::Vector3d> places_m;
    for (const auto& [of, p_m] : places_m_)
      if (!sensor || of == *sensor) places_m.push_back(p_m);
    if (!correction.is_baked) {
      FT_TRY(correction.position, correctors::bakePosition(*correction.position, correction.region, places_m,
                                                           orientations_seen_, max_deviation_m, {}));
      correction.is_baked = true;
    }
    FT_TRY(correction.orientation, bakeOrientation(correction.orientation, correction.region, places_m, max_angle_rad));
    return {};
  };
  for (auto& [sensor, correction] : parts.by_sensor) FT_TRY_VOID(bake(correction, sensor));
  if (parts.by_sensor.empty())
    FT_TRY_VOID(bake(parts, std::nullopt));
  else
    static_cast<calibration::Correction&>(parts) = parts.by_sensor.begin()->second;
  RuntimeCalibration made = *this;
  made.evaluator_ = Evaluator(std::move(parts));
  return made;
}

const std::string* RuntimeCalibration::fact(const std::string& key) const {
  const auto found = facts_.find(key);
  return found == facts_.end() ? nullptr : &found->second;
}

}  // namespace fieldtrue::runtime
