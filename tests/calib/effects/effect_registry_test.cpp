#include <QTest>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "calib/effects/effect_listing.h"
#include "calib/effects/effect_row.h"
#include "calib/effects/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

namespace {

nlohmann::json defaultsOf(const Effect& effect) {
  return resolveEffectParameters(effect, nlohmann::json::object()).value();
}

std::unique_ptr<field::PhysicalEffect> madeByDefault(const Effect& effect) {
  return std::move(makeEffect(effect.id, nlohmann::json::object()).value());
}

/// Places in the open, away from the effect's metal at its defaults.
std::vector<Eigen::Vector3d> openPlaces_m(const field::PhysicalEffect& effect) {
  RandomGeometry random(1);
  std::vector<Eigen::Vector3d> places_m;
  while (places_m.size() < 50) {
    const Eigen::Vector3d p_m = random.pointInCube_m(1.4);
    if (p_m.norm() > 0.4 && (p_m - Eigen::Vector3d(1.0, 0.0, -1.0)).norm() > 0.4 && effect.admits(p_m)) {
      places_m.push_back(p_m);
    }
  }
  return places_m;
}

/// Derivative of the field change along an axis.
Eigen::Matrix3d slope(const field::CouplingDistortion& distortion, const Eigen::Vector3d& p_m, int axis) {
  constexpr double kStep_m = 1e-4;
  const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
  return (distortion.fieldChange(p_m + step_m, 1.0, 0.0) - distortion.fieldChange(p_m - step_m, 1.0, 0.0)) /
         (2.0 * kStep_m);
}

}  // namespace

class EffectRegistryTest : public QObject {
  Q_OBJECT
 private slots:
  void describesEveryParameter_data() { rows(); }
  void describesEveryParameter();
  void resolvesToTheSameTwice_data() { rows(); }
  void resolvesToTheSameTwice();
  void isFiniteLinearAndRepeatable_data() { rows(); }
  void isFiniteLinearAndRepeatable();
  void makesAFieldWithoutSourcesInTheRoom_data();
  void makesAFieldWithoutSourcesInTheRoom();
  void refusesEveryParameterOfAnotherShape_data() { rows(); }
  void refusesEveryParameterOfAnotherShape();
  void refusesEveryParameterOutOfRange_data() { rows(); }
  void refusesEveryParameterOutOfRange();
  void listsHowEachIsFound_data() { rows(); }
  void listsHowEachIsFound();
  void namesWhatIsKnown();
  void acceptsAMatrixEitherWay();

 private:
  static void rows();
};

void EffectRegistryTest::rows() {
  QTest::addColumn<const Effect*>("effect");
  for (const Effect& effect : effects::effects()) QTest::newRow(effect.id.c_str()) << &effect;
}

void EffectRegistryTest::describesEveryParameter() {
  QFETCH(const Effect*, effect);
  QVERIFY(!effect->label.empty() && !effect->source.empty() && effect->make != nullptr);
  const std::set<std::string> shapes{"scalar", "vector3", "matrix3", "text", "list"};
  const nlohmann::json json = toJson(std::span<const Effect>(effect, 1)).at(0);
  QCOMPARE(json.at("parameters").size(), effect->parameters.size());
  for (std::size_t i = 0; i < effect->parameters.size(); ++i) {
    const Setting& parameter = effect->parameters[i];
    QVERIFY2(shapes.contains(json.at("parameters")[i].at("shape").get<std::string>()), parameter.key.c_str());
    QVERIFY2(parameter.help.ends_with("."), parameter.key.c_str());
    QVERIFY2(parameter.unit != "m" || parameter.key.ends_with("_m"), parameter.key.c_str());
    QVERIFY2(parameter.unit != "m^3" || parameter.key.ends_with("_m3"), parameter.key.c_str());
    QVERIFY2(parameter.unit != "rad" || parameter.key.ends_with("_rad"), parameter.key.c_str());
    QVERIFY2(parameter.unit != "s" || parameter.key.ends_with("_s"), parameter.key.c_str());
    if (parameter.hasPlausibleRange()) {
      QVERIFY2(parameter.plausible_min >= parameter.min && parameter.plausible_max <= parameter.max,
               parameter.key.c_str());
    }
    for (const char* key :
         {"name", "unit", "shape", "default", "min", "max", "plausible_min", "plausible_max", "help", "choices"}) {
      QVERIFY2(json.at("parameters")[i].contains(key), key);
    }
  }
}

void EffectRegistryTest::resolvesToTheSameTwice() {
  QFETCH(const Effect*, effect);
  const nlohmann::json once = defaultsOf(*effect);
  QCOMPARE(once.size(), effect->parameters.size());
  QVERIFY(resolveEffectParameters(*effect, once).value() == once);
  QVERIFY(resolveEffectParameters(*effect, nullptr).value() == once);
  QVERIFY(nlohmann::json::parse(once.dump()) == once);
}

void EffectRegistryTest::isFiniteLinearAndRepeatable() {
  QFETCH(const Effect*, effect);
  const auto first = madeByDefault(*effect);
  const auto again = madeByDefault(*effect);
  const auto* distortion = dynamic_cast<const field::CouplingDistortion*>(first.get());
  for (const Eigen::Vector3d& p_m : openPlaces_m(*first)) {
    const field::SensorSetting setting{{p_m, rotationFromVector(p_m)}, {}, std::nullopt, 100.0};
    const field::EffectResponse response = first->at(setting);
    const field::EffectResponse repeated = again->at(setting);
    QVERIFY(response.field_per_m3.allFinite() && response.shift_m.allFinite() && response.turn_rad.allFinite());
    QVERIFY(response.field_per_m3 == repeated.field_per_m3 && response.shift_m == repeated.shift_m);
    QVERIFY(first->interference_per_m3(0.3).allFinite());
    if (distortion == nullptr) continue;
    const Eigen::Matrix3d change = distortion->fieldChange(p_m, 1.0, 100.0);
    QVERIFY(change == response.field_per_m3);
    const Eigen::Matrix3d stronger = distortion->fieldChange(p_m, 2.5, 100.0);
    FT_VERIFY_MATCH(near((stronger - 2.5 * change).norm(), 0.0, 1e-12 * change.norm()));
  }
}

void EffectRegistryTest::makesAFieldWithoutSourcesInTheRoom_data() {
  QTest::addColumn<const Effect*>("effect");
  for (const Effect& effect : effects::effects()) {
    const bool is_of_the_room = dynamic_cast<const field::CouplingDistortion*>(madeByDefault(effect).get()) != nullptr;
    if (is_of_the_room) QTest::newRow(effect.id.c_str()) << &effect;
  }
}

// There is no current where the sensor is: the extra field of each transmitter coil has neither divergence nor curl
// there.
void EffectRegistryTest::makesAFieldWithoutSourcesInTheRoom() {
  QFETCH(const Effect*, effect);
  const auto made = madeByDefault(*effect);
  const auto* distortion = dynamic_cast<const field::CouplingDistortion*>(made.get());
  QVERIFY(distortion != nullptr);
  for (const Eigen::Vector3d& p_m : openPlaces_m(*distortion)) {
    const Eigen::Matrix3d d[3] = {slope(*distortion, p_m, 0), slope(*distortion, p_m, 1), slope(*distortion, p_m, 2)};
    const double size = d[0].norm() + d[1].norm() + d[2].norm();
    QVERIFY(size > 0.0);
    const Eigen::RowVector3d divergence = d[0].row(0) + d[1].row(1) + d[2].row(2);
    FT_VERIFY_MATCH(near(divergence.norm() / size, 0.0, 1e-5));
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      FT_VERIFY_MATCH(near((d[a].row(b) - d[b].row(a)).norm() / size, 0.0, 1e-5));
    }
  }
}

void EffectRegistryTest::refusesEveryParameterOfAnotherShape() {
  QFETCH(const Effect*, effect);
  for (const Setting& parameter : effect->parameters) {
    const nlohmann::json wrong = parameter.type == SettingType::kChoice ? nlohmann::json(3) : nlohmann::json("long");
    for (const nlohmann::json& value : {wrong, nlohmann::json::array({1.0, 2.0}), nlohmann::json(true)}) {
      if (parameter.type == SettingType::kNumbers && value.is_array()) continue;
      const auto resolved = resolveEffectParameters(*effect, {{parameter.key, value}});
      QVERIFY2(!resolved.has_value(), parameter.key.c_str());
      QCOMPARE(resolved.error().code, ErrorCode::kBadInput);
      FT_VERIFY_MATCH(holdsAll(resolved.error().message, {effect->id.c_str(), parameter.key.c_str(), "must be"}));
    }
  }
}

void EffectRegistryTest::refusesEveryParameterOutOfRange() {
  QFETCH(const Effect*, effect);
  for (const Setting& parameter : effect->parameters) {
    std::vector<nlohmann::json> wrong;
    if (parameter.type == SettingType::kChoice) wrong.emplace_back("wood");
    if (parameter.type == SettingType::kNumber) wrong = {parameter.min - 1.0, parameter.max * 2.0 + 1.0};
    if (parameter.type == SettingType::kVector3) wrong.push_back({0.0, 0.0, std::numeric_limits<double>::infinity()});
    if (parameter.type == SettingType::kNumbers)
      wrong = {nlohmann::json::array(), nlohmann::json::array({2.0 * parameter.max + 1.0})};
    if (parameter.type == SettingType::kMatrix3) wrong.push_back({1, 0.5, 0, 0, 1, 0, 0, 0, 1});
    for (const nlohmann::json& value : wrong) {
      const auto resolved = resolveEffectParameters(*effect, {{parameter.key, value}});
      QVERIFY2(!resolved.has_value(), parameter.key.c_str());
      FT_VERIFY_MATCH(holdsAll(resolved.error().message, {effect->id.c_str(), parameter.key.c_str(), "must be"}));
    }
  }
}

void EffectRegistryTest::listsHowEachIsFound() {
  QFETCH(const Effect*, effect);
  const nlohmann::json listing = effectListing();
  const auto row = std::find_if(listing.begin(), listing.end(),
                                [&](const nlohmann::json& seen) { return seen.at("id") == effect->id; });
  QVERIFY(row != listing.end());
  QCOMPARE(row->at("parameters").size(), effect->parameters.size());
  const std::string found_in = row->at("found_in").get<std::string>();
  QCOMPARE(found_in == "places", !row->at("fits").empty());
  for (const nlohmann::json& way : row->at("fits")) {
    QVERIFY(!way.at("name").get<std::string>().empty() && !way.at("linear").empty());
    for (const char* kind : {"searched", "linear"}) {
      for (const nlohmann::json& parameter : way.at(kind)) {
        QVERIFY(parameter.at("low").get<double>() < parameter.at("high").get<double>());
      }
    }
  }
  const std::string text = effectListingText();
  QVERIFY(text.find(effect->id + "  " + effect->label) != std::string::npos);
  for (const Setting& parameter : effect->parameters) QVERIFY(text.find(parameter.help) != std::string::npos);
}

void EffectRegistryTest::namesWhatIsKnown() {
  const auto effect = findEffect("compact_mettal");
  QCOMPARE(effect.error().code, ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(effect.error().message, {"compact_mettal", "did you mean compact_metal?", "metal_plane"}));
  const auto parameter = resolveEffectParameters(*findEffect("compact_metal").value(), {{"radius_mm", 5.0}});
  FT_VERIFY_MATCH(holdsAll(parameter.error().message, {"radius_mm", "did you mean radius_m?", "center_m"}));
  const auto list = resolveEffectParameters(*findEffect("compact_metal").value(), nlohmann::json::array());
  FT_VERIFY_MATCH(holdsAll(list.error().message, {"compact_metal", "must be an object"}));
  QVERIFY(resolveEffectParameters(*findEffect("compact_metal").value(), {{"comment", "a desk"}}).has_value());
}

void EffectRegistryTest::acceptsAMatrixEitherWay() {
  const Effect& effect = *findEffect("compact_metal").value();
  const auto flat = resolveEffectParameters(effect, {{"polarizability_m3", {1, 2, 3, 2, 5, 6, 3, 6, 9}}});
  const auto rows = resolveEffectParameters(effect, {{"polarizability_m3", {{1, 2, 3}, {2, 5, 6}, {3, 6, 9}}}});
  FT_VERIFY_OK(flat);
  FT_VERIFY_OK(rows);
  QVERIFY(*flat == *rows);
  QCOMPARE(rows->at("polarizability_m3").size(), std::size_t{9});
}

FIELDTRUE_TEST(EffectRegistryTest)
#include "effect_registry_test.moc"
