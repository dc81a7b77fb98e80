#include <QTest>
#include <cmath>

#include "calib/effects/rows.h"
#include "tests/calib/effects/effect_geometry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::made;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::trackedPose;

namespace {

/// So permeable that (mu_r - 1)/(mu_r + 1) is 1 to 2e-6.
constexpr double kVeryPermeable = 1e6;

nlohmann::json floorAt(double height_m, const char* material) {
  return {{"distance_m", height_m}, {"material", material}, {"relative_permeability", kVeryPermeable}};
}

nlohmann::json listOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

class MetalPlaneTest : public QObject {
  Q_OBJECT
 private slots:
  void satisfiesTheBoundaryCondition_data();
  void satisfiesTheBoundaryCondition();
  void bendsTheTrackerAsPublished_data();
  void bendsTheTrackerAsPublished();
  void isReciprocal();
  void scalesWithStrengthAndPermeability();
  void growsAsPublished();
  void sheetRecedesFromAPulsedTracker();
  void admitsItsOwnSideOnly();
  void refusesNoDirection();
};

void MetalPlaneTest::satisfiesTheBoundaryCondition_data() {
  QTest::addColumn<bool>("is_conductor");
  QTest::newRow("perfect conductor: no normal field") << true;
  QTest::newRow("very permeable: no tangential field") << false;
}

void MetalPlaneTest::satisfiesTheBoundaryCondition() {
  QFETCH(bool, is_conductor);
  RandomGeometry random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = random.direction();
    const double distance_m = random.between(0.5, 3.0);
    const auto plane = made("metal_plane", {{"toward", listOf(random.between(0.2, 9.0) * n)},
                                            {"distance_m", distance_m},
                                            {"material", is_conductor ? "conductive" : "ferromagnetic"},
                                            {"relative_permeability", kVeryPermeable}});
    const Eigen::Vector3d along_m = random.between(-2.0, 2.0) * n.unitOrthogonal();
    const Eigen::Vector3d p_m = distance_m * n + along_m;
    const Eigen::Matrix3d total = field::dipoleField(p_m, 1.0) + plane->fieldChange(p_m, 1.0, 0.0);
    const Eigen::Matrix3d normal = n * (n.transpose() * total);
    const Eigen::Matrix3d vanishing = is_conductor ? normal : Eigen::Matrix3d(total - normal);
    FT_VERIFY_MATCH(near(vanishing.norm() / total.norm(), 0.0, is_conductor ? 1e-12 : 1e-5));
    QVERIFY(total.norm() > 0.1 * field::dipoleField(p_m, 1.0).norm());
  }
}

// Transmitter and sensor both at height h, distance d apart: figures of an independent numerical study, to the
// centimetre.
void MetalPlaneTest::bendsTheTrackerAsPublished_data() {
  QTest::addColumn<double>("height_m");
  QTest::addColumn<double>("distance_m");
  QTest::addColumn<double>("conductor_cm");
  QTest::addColumn<double>("permeable_cm");
  constexpr double kDistances_m[] = {1.5, 2.0, 2.5, 3.0};
  struct Row {
    double height_m;
    double conductor_cm[4];
    double permeable_cm[4];
  };
  const Row rows[] = {{1.0, {48, 79, 99, 112}, {37, 83, 142, 209}},
                      {1.5, {19, 53, 90, 119}, {14, 38, 76, 124}},
                      {2.0, {7, 25, 57, 96}, {6, 18, 41, 74}}};
  for (const Row& row : rows) {
    for (int i = 0; i < 4; ++i) {
      QTest::addRow("height %g m, distance %g m", row.height_m, kDistances_m[i])
          << row.height_m << kDistances_m[i] << row.conductor_cm[i] << row.permeable_cm[i];
    }
  }
}

void MetalPlaneTest::bendsTheTrackerAsPublished() {
  QFETCH(double, height_m);
  QFETCH(double, distance_m);
  QFETCH(double, conductor_cm);
  QFETCH(double, permeable_cm);
  const Eigen::Vector3d p_m(distance_m, 0.0, 0.0);
  const auto error_cm = [&](const char* material) {
    return Eigen::Vector3d(100.0 *
                           (trackedPose(*made("metal_plane", floorAt(height_m, material)), p_m).position_m - p_m));
  };
  const Eigen::Vector3d conductor = error_cm("conductive");
  const Eigen::Vector3d permeable = error_cm("ferromagnetic");
  FT_VERIFY_MATCH(near(conductor.norm(), conductor_cm, 0.55));
  FT_VERIFY_MATCH(near(permeable.norm(), permeable_cm, 0.55));
  // Almost all vertical: toward the floor for a conductor, away from a permeable one.
  QVERIFY(conductor.z() < -0.9 * conductor.norm());
  QVERIFY(permeable.z() > 0.9 * permeable.norm());
}

// Seen from the sensor at p the plane is nearer by p.n and the transmitter stands at -p.
void MetalPlaneTest::isReciprocal() {
  RandomGeometry random(2);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d n = random.direction();
    const Eigen::Vector3d p_m = random.between(0.5, 1.5) * random.direction();
    const auto plane = [&](double distance_m) {
      return made("metal_plane", {{"toward", listOf(n)}, {"distance_m", distance_m}});
    };
    const Eigen::Matrix3d forward = plane(2.0)->fieldChange(p_m, 1.0, 0.0);
    const Eigen::Matrix3d backward = plane(2.0 - n.dot(p_m))->fieldChange(-p_m, 1.0, 0.0);
    FT_VERIFY_MATCH(near((forward - backward.transpose()).norm() / forward.norm(), 0.0, 1e-12));
  }
}

void MetalPlaneTest::scalesWithStrengthAndPermeability() {
  const Eigen::Vector3d p_m(1.2, 0.3, -0.4);
  const auto change = [&](const nlohmann::json& parameters) {
    return made("metal_plane", parameters)->fieldChange(p_m, 1.0, 0.0);
  };
  const Eigen::Matrix3d ideal = change(nlohmann::json::object());
  FT_VERIFY_MATCH(near((change({{"strength", 0.3}}) - 0.3 * ideal).norm(), 0.0, 1e-15));
  // (mu_r - 1)/(mu_r + 1) is 1/2 at 3 and 0 at 1, and the image is turned round.
  const auto permeable = [&](double mu_r) {
    return change({{"material", "ferromagnetic"}, {"relative_permeability", mu_r}});
  };
  FT_VERIFY_MATCH(near((permeable(3.0) + 0.5 * ideal).norm(), 0.0, 1e-15));
  FT_VERIFY_MATCH(near(permeable(1.0).norm(), 0.0, 1e-15));
}

// Weak-distortion scaling of an independent study: error ~ d^4.9 h^-3.9.
void MetalPlaneTest::growsAsPublished() {
  const auto error_m = [](double height_m, double distance_m) {
    const Eigen::Vector3d p_m(distance_m, 0.0, 0.0);
    return (trackedPose(*made("metal_plane", floorAt(height_m, "conductive")), p_m).position_m - p_m).norm();
  };
  FT_VERIFY_MATCH(near(std::log2(error_m(3.0, 1.4) / error_m(3.0, 0.7)), 4.9, 0.15));
  FT_VERIFY_MATCH(near(std::log2(error_m(2.5, 1.0) / error_m(5.0, 1.0)), -std::log2(std::pow(0.5, 3.9)), 0.15));
}

// Maxwell's receding image (Saslow 1992): 2 ms after the edge 1 mm of aluminium reflects as a perfect conductor whose
// image is 9 cm deeper, that is, which itself is 4.5 cm farther; 20 um of foil reflect next to nothing.
void MetalPlaneTest::sheetRecedesFromAPulsedTracker() {
  field::SensorSetting setting;
  setting.tracker_from_sensor.position_m = {1.2, 0.3, 0.2};
  const auto change = [&](const nlohmann::json& parameters, const field::Excitation& excitation) {
    return Eigen::Matrix3d(makeEffect("metal_plane", parameters, excitation).value()->at(setting).field_per_m3);
  };
  const field::Excitation pulsed{true, 0.0, 2e-3};
  const nlohmann::json sheet{{"distance_m", 1.0}, {"conductivity_s_per_m", 3.5e7}, {"thickness_m", 1e-3}};
  const nlohmann::json foil{{"distance_m", 1.0}, {"conductivity_s_per_m", 3.5e7}, {"thickness_m", 20e-6}};
  const Eigen::Matrix3d farther = change({{"distance_m", 1.0 + 0.5 * 0.09095}}, {});
  FT_VERIFY_MATCH(near((change(sheet, pulsed) - farther).norm() / farther.norm(), 0.0, 0.005));
  const Eigen::Matrix3d near_by = change({{"distance_m", 1.0}}, {});
  QVERIFY(change(foil, pulsed).norm() < 0.05 * near_by.norm());
  FT_VERIFY_MATCH(near((change(sheet, {}) - near_by).norm() / near_by.norm(), 0.0, 0.005));
  QVERIFY(!makeEffect("metal_plane", {{"thickness_m", 1e-3}}).has_value());
}

void MetalPlaneTest::admitsItsOwnSideOnly() {
  const auto plane = made("metal_plane", {{"toward", {0.0, 0.0, -3.0}}, {"distance_m", 1.5}});
  QVERIFY(plane->admits({2.0, 0.0, -1.49}));
  QVERIFY(!plane->admits({2.0, 0.0, -1.51}));
}

void MetalPlaneTest::refusesNoDirection() {
  const auto plane = makeEffect("metal_plane", {{"toward", {0.0, 0.0, 0.0}}});
  QVERIFY(!plane.has_value());
  FT_VERIFY_MATCH(testing::holdsAll(plane.error().message, {"metal_plane", "toward", "(0, 0, 0)"}));
}

FIELDTRUE_TEST(MetalPlaneTest)
#include "metal_plane_test.moc"
