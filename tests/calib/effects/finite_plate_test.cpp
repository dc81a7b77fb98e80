#include <QTest>
#include <cmath>

#include "calib/effects/compact_metal.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"
#include "tests/calib/effects/effect_geometry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::made;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

namespace {

double apart(const field::CouplingDistortion& seen, const field::CouplingDistortion& expected,
             const Eigen::Vector3d& p_m) {
  const Eigen::Matrix3d wanted = expected.fieldChange(p_m, 1.0, 0.0);
  return (seen.fieldChange(p_m, 1.0, 0.0) - wanted).norm() / wanted.norm();
}

}  // namespace

class FinitePlateTest : public QObject {
  Q_OBJECT
 private slots:
  void smallPlateIsItsPolarizability_data();
  void smallPlateIsItsPolarizability();
  void isReciprocal_data();
  void isReciprocal();
  void wideFloorNearsThePlane();
  void doesNotCareWhichSideIsUp();
  void realMetalAnswersByCarrierAndDelay();
  void leavesNoRoomInTheSheet();
  void refusesWhatMakesNoSense();
};

void FinitePlateTest::smallPlateIsItsPolarizability_data() {
  QTest::addColumn<QString>("material");
  QTest::newRow("conductor: only the field normal to it") << "conductive";
  QTest::newRow("ferromagnet: only the field along it") << "ferromagnetic";
}

// Seen from 20 sides away a square is its polarizability: -4 (0.1137 side^3) normal to it, 4 (0.2598 side^3) along it
// (De Meulenaere and Van Bladel 1977, IEEE Trans. AP-25 198, by Babinet's principle).
void FinitePlateTest::smallPlateIsItsPolarizability() {
  QFETCH(QString, material);
  RandomGeometry random(1);
  for (int i = 0; i < 30; ++i) {
    const double side_m = 0.1;
    const Eigen::Vector3d n = random.direction();
    const Eigen::Vector3d center_m = random.between(2.0, 3.0) * random.direction();
    const Eigen::Vector3d p_m = center_m + random.between(2.0, 3.0) * random.direction();
    const auto plate = made("finite_plate", {{"center_m", effects::listOf(center_m)},
                                             {"normal", effects::listOf(n)},
                                             {"side", effects::listOf(n.unitOrthogonal())},
                                             {"length_m", side_m},
                                             {"width_m", side_m},
                                             {"material", material.toStdString()}});
    const Eigen::Matrix3d along = Eigen::Matrix3d::Identity() - n * n.transpose();
    const double side_m3 = std::pow(side_m, 3);
    const Eigen::Matrix3d A = material == "conductive" ? Eigen::Matrix3d(-4.0 * 0.1137 * side_m3 * n * n.transpose())
                                                       : Eigen::Matrix3d(4.0 * 0.2598 * side_m3 * along);
    FT_VERIFY_MATCH(near(apart(*plate, *makeCompactMetal(center_m, A, 0.0), p_m), 0.0, 0.025));
  }
}

void FinitePlateTest::isReciprocal_data() { smallPlateIsItsPolarizability_data(); }

// Transmitter and sensor exchanged, the couplings are the transpose, however near the plate is.
void FinitePlateTest::isReciprocal() {
  QFETCH(QString, material);
  RandomGeometry random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d n = random.direction();
    const Eigen::Vector3d center_m = random.between(0.5, 1.0) * n;
    const Eigen::Vector3d p_m = random.between(0.5, 1.0) * n.unitOrthogonal() - 0.3 * n;
    const auto plateAt = [&](const Eigen::Vector3d& at_m) {
      return made("finite_plate", {{"center_m", effects::listOf(at_m)},
                                   {"normal", effects::listOf(n)},
                                   {"side", effects::listOf(n.unitOrthogonal())},
                                   {"length_m", 0.8},
                                   {"width_m", 0.5},
                                   {"material", material.toStdString()}});
    };
    const Eigen::Matrix3d forward = plateAt(center_m)->fieldChange(p_m, 1.0, 0.0);
    const Eigen::Matrix3d backward = plateAt(center_m - p_m)->fieldChange(-p_m, 1.0, 0.0);
    FT_VERIFY_MATCH(near((forward - backward.transpose()).norm() / forward.norm(), 0.0, 1e-9));
  }
}

// A plate six times as wide as it is far answers nearly as a plane, and nearer to it the wider it is.
void FinitePlateTest::wideFloorNearsThePlane() {
  const Eigen::Vector3d p_m(0.5, 0.2, 0.1);
  const auto plane = made("metal_plane", {{"distance_m", 1.0}});
  const auto missing = [&](double side_m) {
    return apart(*made("finite_plate", {{"center_m", {0.25, 0.0, -1.0}}, {"length_m", side_m}, {"width_m", side_m}}),
                 *plane, p_m);
  };
  QVERIFY(missing(6.0) < 0.1);
  QVERIFY(missing(3.0) < 0.4);
  QVERIFY(missing(6.0) < missing(3.0) && missing(3.0) < missing(1.5));
}

void FinitePlateTest::doesNotCareWhichSideIsUp() {
  const Eigen::Vector3d p_m(1.2, 0.3, -0.2);
  for (const char* material : {"conductive", "ferromagnetic"}) {
    nlohmann::json parameters = {{"material", material}};
    const auto up = made("finite_plate", parameters);
    parameters["normal"] = {0.0, 0.0, -2.0};
    FT_VERIFY_MATCH(near(apart(*made("finite_plate", parameters), *up, p_m), 0.0, 1e-12));
    parameters["side"] = {0.0, 3.0, 0.5};
    FT_VERIFY_MATCH(near(apart(*made("finite_plate", parameters), *up, p_m), 0.0, 1e-12));
  }
}

// 2 mm of aluminium are many skin depths at 10 kHz; the slowest current of a square decays at 10.25 / (mu_0 sigma d
// side) (lowest mode of a thin square sheet), 0.19 ms in a foil of 0.1 mm and 0.6 m: gone after 2 ms.
void FinitePlateTest::realMetalAnswersByCarrierAndDelay() {
  const Eigen::Vector3d p_m(1.2, 0.3, -0.2);
  const auto plateOf = [&](double thickness_m, const field::Excitation& excitation) {
    return makeEffect("finite_plate", {{"conductivity_s_per_m", 3.5e7}, {"thickness_m", thickness_m}}, excitation);
  };
  const auto change = [&](const Result<std::unique_ptr<field::PhysicalEffect>>& plate) {
    field::SensorSetting setting;
    setting.tracker_from_sensor.position_m = p_m;
    return Eigen::Matrix3d((*plate)->at(setting).field_per_m3);
  };
  const double ideal = made("finite_plate", nlohmann::json::object())->fieldChange(p_m, 1.0, 0.0).norm();
  FT_VERIFY_MATCH(near(change(plateOf(2e-3, {})).norm() / ideal, 1.0, 0.01));
  const double foil = change(plateOf(1e-4, {true, 0.0, 2e-3})).norm() / ideal;
  QVERIFY2(foil < 1e-3, qPrintable(QString::number(foil)));
  const double plate = change(plateOf(5e-3, {true, 0.0, 2e-3})).norm() / ideal;
  QVERIFY2(plate > 0.5, qPrintable(QString::number(plate)));
}

void FinitePlateTest::leavesNoRoomInTheSheet() {
  const auto plate = made("finite_plate", nlohmann::json::object());
  QVERIFY(!plate->admits({1.2, 0.2, -1.001}));
  QVERIFY(plate->admits({1.2, 0.2, -0.98}));
  QVERIFY(plate->admits({1.4, 0.2, -1.0}));
}

void FinitePlateTest::refusesWhatMakesNoSense() {
  const auto messageOf = [](const nlohmann::json& parameters) {
    const auto plate = makeEffect("finite_plate", parameters);
    return plate ? std::string() : plate.error().message;
  };
  FT_VERIFY_MATCH(holdsAll(messageOf({{"normal", {0.0, 0.0, 0.0}}}), {"finite_plate", "normal", "(0, 0, 0)"}));
  FT_VERIFY_MATCH(holdsAll(messageOf({{"side", {0.0, 0.0, 1.0}}}), {"finite_plate", "side", "parallel"}));
  FT_VERIFY_MATCH(holdsAll(messageOf({{"conductivity_s_per_m", 3.5e7}}), {"finite_plate", "thickness_m"}));
  FT_VERIFY_MATCH(holdsAll(messageOf({{"center_m", {0.1, 0.0, 0.0}}}), {"finite_plate", "transmitter"}));
}

FIELDTRUE_TEST(FinitePlateTest)
#include "finite_plate_test.moc"
