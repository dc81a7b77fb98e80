#include "calib/runtime/runtime_calibration.h"

#include <cmath>
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
    made.places_m_.push_back(node["tracker_from_sensor"].pose().position_m);
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
  for (const Eigen::Vector3d& p_m : places_m_) {
    if (!evaluator_.reaches(p_m)) continue;
    static_cast<void>(evaluator_.correctPosition_m(p_m));
    static_cast<void>(evaluator_.uncertainty_m(p_m));
    static_cast<void>(evaluator_.uncertaintyAt_m({p_m, Eigen::Quaterniond::Identity()}));
    return;
  }
}

Result<RuntimeCalibration> RuntimeCalibration::baked(double max_deviation_m, double max_angle_rad) const {
  if (!(max_deviation_m > 0.0 && std::isfinite(max_deviation_m) && max_angle_rad > 0.0 && std::isfinite(max_angle_rad)))
    return fail(ErrorCode::kBadInput, "Baking needs a largest deviation and a largest angle above 0");
  Evaluator::Parts parts = evaluator_.parts();
  if (!parts.is_baked) {
    FT_TRY(parts.position,
           correctors::bakePosition(*parts.position, parts.region, places_m_, orientations_seen_, max_deviation_m, {}));
    parts.is_baked = true;
  }
  FT_TRY(parts.orientation, bakeOrientation(parts.orientation, parts.region, places_m_, max_angle_rad));
  RuntimeCalibration made = *this;
  made.evaluator_ = Evaluator(std::move(parts));
  return made;
}

const std::string* RuntimeCalibration::fact(const std::string& key) const {
  const auto found = facts_.find(key);
  return found == facts_.end() ? nullptr : &found->second;
}

}  // namespace fieldtrue::runtime
