#include <QTest>
#include <cmath>
#include <numbers>

#include "calib/effects/registry.h"
#include "calib/field/dipole_field.h"
#include "calib/field/metal_response.h"
#include "calib/field/pose_solver.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

// What is reported of metal near alternating-current and pulsed direct-current trackers: Nixon, McCallum, Fright and
// Price 1998, Presence 7 204, as told by Kindratenko 2000, Virtual Reality 5 169, section 2.2. The reports give no
// sampling delay; the ones used here are stated with each test.

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::near;

namespace {

const field::Excitation kFastrak{false, 10016.0, 0.0};

field::Excitation flock(double delay_s) { return {true, 0.0, delay_s}; }

/// Position error of a tracker at the origin by one effect [m].
double error_m(const std::string& id, const nlohmann::json& parameters, const field::Excitation& excitation,
               const Eigen::Vector3d& p_m) {
  const auto effect = makeEffect(id, parameters, excitation);
  field::SensorSetting setting;
  setting.tracker_from_sensor.position_m = p_m;
  const Eigen::Matrix3d field = field::dipoleField(p_m, 1.0) + effect.value()->at(setting).field_per_m3;
  return (field::solvePose(field, 1.0, p_m)->tracker_from_sensor.position_m - p_m).norm();
}

/// A square plate 0.4 m below the middle of a path of 0.6 m, level or turned by half a right angle.
double plateError_m(double side_m, bool is_level, nlohmann::json metal, const field::Excitation& excitation) {
  metal["center_m"] = {0.3, 0.0, -0.4};
  metal["normal"] = is_level ? nlohmann::json{0.0, 0.0, 1.0} : nlohmann::json{1.0, 0.0, 1.0};
  metal["side"] = {0.0, 1.0, 0.0};
  metal["length_m"] = side_m;
  metal["width_m"] = side_m;
  return error_m("finite_plate", metal, excitation, {0.6, 0.0, 0.0});
}

/// Growth of the error per doubling of the size, as a power, about a size.
template <typename Error>
double power(const Error& error, double side_m) {
  return std::log2(error(side_m * std::numbers::sqrt2) / error(side_m / std::numbers::sqrt2));
}

}  // namespace

class PublishedMetalTest : public QObject {
  Q_OBJECT
 private slots:
  void alternatingCurrentSeesEveryMetal_data();
  void alternatingCurrentSeesEveryMetal();
  void pulsedDirectCurrentSeesCopperLongest();
  void steelIsConductorToOneAndMagnetToTheOther();
  void ferriteIsAMagnetToBoth();
  void aluminiumDisappearsFromPulsedTrackers_data();
  void aluminiumDisappearsFromPulsedTrackers();
  void conductingPlateGrowsAsSizeCubed();
  void thinSteelPlateGrowsAsSizeSquaredAtRest();
  void caveErrorsHaveThePublishedSize();
};

void PublishedMetalTest::alternatingCurrentSeesEveryMetal_data() {
  QTest::addColumn<double>("conductivity_s_per_m");
  QTest::newRow("copper") << 5.8e7;
  QTest::newRow("aluminium") << 3.5e7;
  QTest::newRow("brass") << 1.6e7;
  QTest::newRow("stainless steel") << 1.4e6;
}

// 25 mm cubes, as spheres of their volume: half of the perfect conductor's answer or more.
void PublishedMetalTest::alternatingCurrentSeesEveryMetal() {
  QFETCH(double, conductivity_s_per_m);
  const double radius_m = 0.025 * std::cbrt(3.0 / (4.0 * std::numbers::pi));
  QVERIFY(field::sphereSusceptibility(radius_m, field::Metal{conductivity_s_per_m, 1.0}, kFastrak) < -0.75);
}

// 25 mm cubes 3 ms after the edge: copper is left with a tenth of what an AC tracker sees of it, aluminium with a third
// of copper's, brass and stainless steel with nothing that could be measured.
void PublishedMetalTest::pulsedDirectCurrentSeesCopperLongest() {
  const double radius_m = 0.025 * std::cbrt(3.0 / (4.0 * std::numbers::pi));
  const auto left = [&](double conductivity_s_per_m) {
    return std::abs(field::sphereSusceptibility(radius_m, field::Metal{conductivity_s_per_m, 1.0}, flock(3e-3)) / 1.5);
  };
  QVERIFY(left(5.8e7) > 0.1);
  QVERIFY(left(3.5e7) < 0.4 * left(5.8e7));
  QVERIFY(left(1.6e7) < 0.002);
  QVERIFY(left(1.4e6) < 1e-6);
}

// A steel ball of 10 cm and a plate of 2 mm: opposite errors of the two trackers.
void PublishedMetalTest::steelIsConductorToOneAndMagnetToTheOther() {
  const nlohmann::json steel{{"material", "ferromagnetic"},
                             {"relative_permeability", 100.0},
                             {"conductivity_s_per_m", 6e6},
                             {"radius_m", 0.1},
                             {"center_m", {0.8, 0.0, -0.5}}};
  const Eigen::Vector3d p_m(1.0, 0.0, 0.0);
  const auto change = [&](const field::Excitation& excitation) {
    field::SensorSetting setting;
    setting.tracker_from_sensor.position_m = p_m;
    return Eigen::Matrix3d(makeEffect("compact_metal", steel, excitation).value()->at(setting).field_per_m3);
  };
  const Eigen::Matrix3d alternating = change(kFastrak);
  const Eigen::Matrix3d pulsed = change(flock(3e-3));
  QVERIFY(alternating.cwiseProduct(pulsed).sum() < -0.99 * alternating.norm() * pulsed.norm());
}

// Ferrite conducts a millionth of what steel does: permeable at the carrier as at rest.
void PublishedMetalTest::ferriteIsAMagnetToBoth() {
  const field::Metal ferrite{1.0, 1000.0};
  const double at_rest = 3.0 * 999.0 / 1002.0;
  FT_VERIFY_MATCH(near(field::sphereSusceptibility(0.02, ferrite, kFastrak), at_rest, 0.01));
  FT_VERIFY_MATCH(near(field::sphereSusceptibility(0.02, ferrite, flock(3e-3)), at_rest, 0.01));
}

void PublishedMetalTest::aluminiumDisappearsFromPulsedTrackers_data() {
  QTest::addColumn<double>("thickness_m");
  QTest::addColumn<double>("gone_s");
  QTest::newRow("foil, 0.02 mm") << 2e-5 << 0.13e-3;
  QTest::newRow("0.1 mm") << 1e-4 << 0.7e-3;
  QTest::newRow("0.5 mm") << 5e-4 << 3.2e-3;
  QTest::newRow("1 mm") << 1e-3 << 6.2e-3;
  QTest::newRow("2 mm") << 2e-3 << 12e-3;
  QTest::newRow("5 mm") << 5e-3 << 30e-3;
}

// A plate 0.3 m wide keeps its currents for tau = mu_0 sigma d side / 10.25 (lowest mode of a square sheet), 1.3 ms per
// millimetre of aluminium; below a hundredth of what an AC tracker sees it is lost in noise, which is after about
// 4.7 tau. A pulsed tracker that waits 3 ms is blind to half a millimetre of it, and sees two thirds of 5 mm.
void PublishedMetalTest::aluminiumDisappearsFromPulsedTrackers() {
  QFETCH(double, thickness_m);
  QFETCH(double, gone_s);
  const nlohmann::json aluminium{{"conductivity_s_per_m", 3.5e7}, {"thickness_m", thickness_m}};
  const double alternating_m = plateError_m(0.3, true, aluminium, kFastrak);
  const auto left = [&](double delay_s) { return plateError_m(0.3, true, aluminium, flock(delay_s)) / alternating_m; };
  FT_VERIFY_MATCH(near(gone_s / (4.7 * field::kMu0_h_per_m * 3.5e7 * thickness_m * 0.3 / 10.25), 1.0, 0.5));
  QVERIFY2(left(gone_s) < 0.01, qPrintable(QString::number(left(gone_s))));
  QVERIFY2(left(0.25 * gone_s) > 0.05, qPrintable(QString::number(left(0.25 * gone_s))));
}

// The third power holds while the plate is small against its distance, 0.4 m here; from half of that on the field is no
// longer even over it, at twice the distance the error grows as the size and from five times it is a floor's.
void PublishedMetalTest::conductingPlateGrowsAsSizeCubed() {
  const auto error = [](double side_m) { return plateError_m(side_m, true, nlohmann::json::object(), kFastrak); };
  for (const double side_m : {0.04, 0.07, 0.1}) FT_VERIFY_MATCH(near(power(error, side_m), 3.0, 0.05));
  FT_VERIFY_MATCH(near(power(error, 0.2), 2.9, 0.1));
  QVERIFY(power(error, 0.8) < 2.0);
  QVERIFY(std::abs(power(error, 2.2)) < 0.5);
}

// At rest half a millimetre of steel, mu_r 100, has (mu_r - 1) d = 5 cm. Plates far wider are too thin to shield
// themselves: moment per area, the second power. Where (mu_r - 1) d is far more than the
// side the plate's own field sets the limit, as on the conductor: the third power.
void PublishedMetalTest::thinSteelPlateGrowsAsSizeSquaredAtRest() {
  const auto errorOf = [](double mu_r) {
    return [mu_r](double side_m) {
      return plateError_m(side_m, false,
                          {{"material", "ferromagnetic"}, {"relative_permeability", mu_r}, {"thickness_m", 5e-4}},
                          flock(0.1));
    };
  };
  const auto error = errorOf(100.0);
  for (const double side_m : {0.25, 0.35, 0.45}) FT_VERIFY_MATCH(near(power(error, side_m), 2.0, 0.15));
  QVERIFY(power(error, 0.05) > 2.3 && power(error, 0.05) < 2.8);
  FT_VERIFY_MATCH(near(power(errorOf(1e5), 0.05), 3.0, 0.1));
}

// In CAVEs errors of up to 4 feet and 40 % are reported near the largest range (Ghazisaedy et al. 1995). A solid steel
// floor a metre below does that, at either tracker.
void PublishedMetalTest::caveErrorsHaveThePublishedSize() {
  constexpr double kFoot_m = 0.3048;
  const nlohmann::json floor{{"distance_m", 1.0},
                             {"material", "ferromagnetic"},
                             {"relative_permeability", 100.0},
                             {"conductivity_s_per_m", 6e6}};
  for (const field::Excitation& excitation : {kFastrak, flock(2e-3)}) {
    const double at_range_m = error_m("metal_plane", floor, excitation, {3.0, 0.0, 0.0});
    QVERIFY(at_range_m > 3.0 * kFoot_m && at_range_m < 4.5 * kFoot_m);
    FT_VERIFY_MATCH(near(at_range_m / 3.0, 0.40, 0.05));
    QVERIFY(error_m("metal_plane", floor, excitation, {1.0, 0.0, 0.0}) < 0.2);
  }
}

FIELDTRUE_TEST(PublishedMetalTest)
#include "published_metal_test.moc"
