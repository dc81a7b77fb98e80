#include <QTest>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "calib/effects/effect_row.h"
#include "calib/effects/registry.h"
#include "tests/calib/effects/fit_designs.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::fourTurns;
using fieldtrue::testing::gridDesign;
using fieldtrue::testing::near;
using fieldtrue::testing::OwnedDesign;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::scatteredDesign;

namespace {

/// The designs every way of fitting must stand.
OwnedDesign designOf(const QString& name) {
  if (name == "grid") return gridDesign({Eigen::Quaterniond::Identity()}, false, false);
  if (name == "grid, four turns, times") return gridDesign(fourTurns(), true, true);
  if (name == "scattered, positions only") {
    OwnedDesign positions = scatteredDesign(true, false);
    positions.design.has_orientation = false;
    return positions;
  }
  OwnedDesign scattered = scatteredDesign(true, true);
  scattered.design.excitation = {true, 0.0, 0.002};
  return scattered;
}

using Ways = std::vector<std::unique_ptr<EffectFit>>;

std::vector<Eigen::VectorXd> allowedStarts(const EffectFit& way) {
  std::vector<Eigen::VectorXd> allowed;
  for (const Eigen::VectorXd& start : way.starts()) {
    if (way.allows(start)) allowed.push_back(start);
  }
  return allowed;
}

/// Filled with what must be overwritten.
std::vector<field::EffectResponse> emptyResponses(std::size_t count) {
  field::EffectResponse nan;
  nan.shift_m.setConstant(std::numeric_limits<double>::quiet_NaN());
  nan.turn_rad.setConstant(std::numeric_limits<double>::quiet_NaN());
  nan.field_per_m3.setConstant(std::numeric_limits<double>::quiet_NaN());
  return std::vector<field::EffectResponse>(count, nan);
}

bool isFinite(const field::EffectResponse& response) {
  return response.shift_m.allFinite() && response.turn_rad.allFinite() && response.field_per_m3.allFinite();
}

/// All 15 numbers of a response.
Eigen::Matrix<double, 15, 1> numbers(const field::EffectResponse& response) {
  Eigen::Matrix<double, 15, 1> all;
  all << response.shift_m, response.turn_rad, response.field_per_m3.reshaped();
  return all;
}

/// Plausible values, no two of them alike.
Eigen::VectorXd somePlausible(const std::vector<FitParameter>& parameters, RandomGeometry& random) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const double share = random.between(0.55, 0.9);
    values[static_cast<Eigen::Index>(i)] = parameters[i].low + share * (parameters[i].high - parameters[i].low);
  }
  return values;
}

std::vector<std::string> namesOf(const FittedEffect& fitted) {
  std::vector<std::string> names;
  for (const FittedParameter& value : fitted.values) names.push_back(value.name + " [" + value.unit + "]");
  return names;
}

}  // namespace

class EffectFitContractTest : public QObject {
  Q_OBJECT
 private slots:
  void fitsEveryEffectThatMeansShow();
  void boundsHold_data() { rows(); }
  void boundsHold();
  void respondsEverywhereItMayStart_data() { rows(); }
  void respondsEverywhereItMayStart();
  void makesTheSceneThatItFitted_data() { rows(); }
  void makesTheSceneThatItFitted();
  void namesWhatItFittedAlways_data() { rows(); }
  void namesWhatItFittedAlways();
  void leavesOutWhatADesignCannotShow();

 private:
  static void rows();
};

void EffectFitContractTest::rows() {
  QTest::addColumn<const Effect*>("effect");
  QTest::addColumn<QString>("design_name");
  for (const Effect& effect : effects::effects()) {
    if (effect.fits == nullptr) continue;
    for (const char* design : {"grid", "grid, four turns, times", "scattered", "scattered, positions only"}) {
      QTest::addRow("%s, %s", effect.id.c_str(), design) << &effect << QString(design);
    }
  }
}

// What only the raw readings show has no way of fitting; everything else has one on the richest design.
void EffectFitContractTest::fitsEveryEffectThatMeansShow() {
  const std::set<std::string> shown_by_samples{"mains_interference", "range_noise", "correlated_samples",
                                               "quantization", "hemisphere_flip"};
  const OwnedDesign rich = designOf("grid, four turns, times");
  for (const Effect& effect : effects::effects()) {
    QCOMPARE(effect.fits == nullptr, shown_by_samples.contains(effect.id));
    if (effect.fits != nullptr) QVERIFY2(!effect.fits(rich.design).empty(), effect.id.c_str());
  }
}

void EffectFitContractTest::boundsHold() {
  QFETCH(const Effect*, effect);
  QFETCH(QString, design_name);
  const OwnedDesign owned = designOf(design_name);
  std::set<std::string> names;
  for (const auto& way : effect->fits(owned.design)) {
    QVERIFY2(names.insert(way->name()).second, way->name().c_str());
    QVERIFY(!way->linear().empty());
    const std::vector<FitParameter> searched = way->searched();
    for (const auto& parameters : {searched, way->linear()}) {
      for (const FitParameter& parameter : parameters) {
        QVERIFY2(parameter.low < parameter.high, parameter.name.c_str());
        QVERIFY2(std::isfinite(parameter.low) && std::isfinite(parameter.high), parameter.name.c_str());
        for (const char* unit : {"m", "s", "rad", "m3"}) {
          const std::string plain = parameter.unit == "m^3" ? "m3" : parameter.unit;
          if (plain == unit) QVERIFY2(parameter.name.ends_with("_" + plain), parameter.name.c_str());
        }
      }
    }
    QVERIFY(!way->starts().empty() && way->starts().size() <= 1000);
    QVERIFY2(!allowedStarts(*way).empty(), way->name().c_str());
    for (const Eigen::VectorXd& start : way->starts()) {
      QCOMPARE(start.size(), static_cast<Eigen::Index>(searched.size()));
      for (std::size_t i = 0; i < searched.size(); ++i) {
        const double value = start[static_cast<Eigen::Index>(i)];
        QVERIFY2(value >= searched[i].low && value <= searched[i].high, searched[i].name.c_str());
      }
    }
  }
}

void EffectFitContractTest::respondsEverywhereItMayStart() {
  QFETCH(const Effect*, effect);
  QFETCH(QString, design_name);
  const OwnedDesign owned = designOf(design_name);
  for (const auto& way : effect->fits(owned.design)) {
    const std::size_t count = way->linear().size();
    for (const Eigen::VectorXd& start : allowedStarts(*way)) {
      std::vector<field::EffectResponse> responses = emptyResponses(owned.settings.size() * count);
      way->respond(owned.settings, start, responses);
      const bool all_finite = std::all_of(responses.begin(), responses.end(), isFinite);
      QVERIFY2(all_finite, (effect->id + " " + way->name()).c_str());
      for (std::size_t i = 0; i < count; ++i) {
        double size = 0.0;
        for (std::size_t row = 0; row < owned.settings.size(); ++row)
          size += numbers(responses[row * count + i]).norm();
        QVERIFY2(size > 0.0, (effect->id + " " + way->name() + " " + way->linear()[i].name).c_str());
      }
    }
  }
}

// The effect made from what describe() tells answers as the sum of the unit responses does.
void EffectFitContractTest::makesTheSceneThatItFitted() {
  QFETCH(const Effect*, effect);
  QFETCH(QString, design_name);
  const OwnedDesign owned = designOf(design_name);
  RandomGeometry random(3);
  for (const auto& way : effect->fits(owned.design)) {
    const std::size_t count = way->linear().size();
    const std::vector<Eigen::VectorXd> starts = allowedStarts(*way);
    for (const std::size_t which : {std::size_t{0}, starts.size() / 2, starts.size() - 1}) {
      const Eigen::VectorXd linear = somePlausible(way->linear(), random);
      const FittedEffect fitted = way->describe(starts[which], linear);
      const auto made = makeEffect(effect->id, fitted.parameters, owned.design.excitation);
      FT_VERIFY_OK(made);
      std::vector<field::EffectResponse> responses = emptyResponses(owned.settings.size() * count);
      way->respond(owned.settings, starts[which], responses);
      double difference = 0.0;
      double size = 0.0;
      for (std::size_t row = 0; row < owned.settings.size(); ++row) {
        Eigen::Matrix<double, 15, 1> sum = Eigen::Matrix<double, 15, 1>::Zero();
        for (std::size_t i = 0; i < count; ++i) {
          sum += linear[static_cast<Eigen::Index>(i)] * numbers(responses[row * count + i]);
        }
        difference = std::max(difference, (numbers((*made)->at(owned.settings[row])) - sum).norm());
        size = std::max(size, sum.norm());
      }
      QVERIFY2(size > 0.0 && difference <= 1e-6 * size,
               qPrintable(QString("%1: off by %2 of %3").arg(way->name().c_str()).arg(difference).arg(size)));
    }
  }
}

void EffectFitContractTest::namesWhatItFittedAlways() {
  QFETCH(const Effect*, effect);
  QFETCH(QString, design_name);
  const OwnedDesign owned = designOf(design_name);
  RandomGeometry random(4);
  for (const auto& way : effect->fits(owned.design)) {
    const std::vector<Eigen::VectorXd> starts = allowedStarts(*way);
    const std::vector<std::string> names = namesOf(way->describe(starts.front(), somePlausible(way->linear(), random)));
    QVERIFY(!names.empty());
    for (const double factor : {1.0, -1.0, 0.0, 50.0}) {
      const FittedEffect fitted = way->describe(starts.back(), factor * somePlausible(way->linear(), random));
      QVERIFY(namesOf(fitted) == names);
      QCOMPARE(fitted.doubt.empty(), fitted.is_plausible);
      for (const FittedParameter& value : fitted.values) QVERIFY2(std::isfinite(value.value), value.name.c_str());
      if (fitted.location_m) QVERIFY(fitted.location_m->allFinite());
      if (fitted.material) {
        QVERIFY((std::set<std::string>{"conductive", "ferromagnetic", "undetermined"}.contains(*fitted.material)));
      }
    }
  }
}

void EffectFitContractTest::leavesOutWhatADesignCannotShow() {
  const OwnedDesign plain = designOf("grid");
  for (const char* id : {"gain_drift", "metal_moved", "transmitter_misalignment", "sensor_offset"}) {
    QVERIFY2(findEffect(id).value()->fits(plain.design).empty(), id);
  }
  const OwnedDesign scattered = designOf("scattered");
  QVERIFY(findEffect("jig_layer_offset").value()->fits(scattered.design).empty());
  OwnedDesign blind = scatteredDesign(true, true);
  blind.design.has_orientation = false;
  QCOMPARE(findEffect("sensor_offset").value()->fits(blind.design).size(), std::size_t{1});
}

FIELDTRUE_TEST(EffectFitContractTest)
#include "effect_fit_contract_test.moc"
