#include "calib/simulation/simulator.h"

#include <QTest>
#include <cmath>

#include "calib/effects/registry.h"
#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::simulation;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;
using fieldtrue::testing::sameBits;

namespace {

Pose at(double x_m, double y_m, double z_m) { return {{x_m, y_m, z_m}, Eigen::Quaterniond::Identity()}; }

TrackerSimulator simulatorOf(const Scene& scene, std::uint64_t seed = 1) {
  return std::move(TrackerSimulator::make(scene, seed).value());
}

/// Transverse position error of successive readings of a still sensor on the X axis [m].
std::vector<double> sidewaysErrors_m(TrackerSimulator& tracker, double range_m, int count) {
  std::vector<double> errors_m;
  for (int i = 0; i < count; ++i) {
    const Sample sample = tracker.measure(at(range_m, 0.0, 0.0), i / tracker.scene().tracker.rate_hz);
    errors_m.push_back(sample.tracker_from_sensor.position_m.y());
  }
  return errors_m;
}

double rms(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

double lag1(const std::vector<double>& values) {
  double products = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) products += values[i] * values[i - 1];
  return products / (rms(values) * rms(values) * static_cast<double>(values.size()));
}

}  // namespace

class SimulatorTest : public QObject {
  Q_OBJECT
 private slots:
  void reportsTheTruePoseInACleanRoom();
  void seesTheSceneFromTheTransmitter();
  void addsItsEffects();
  void scattersWithTheFourthPowerOfRange();
  void scattersFlatAcrossTheLineOfSight();
  void keepsTheCorrelationOfItsFilter();
  void forgetsWhenReset();
  void roundsToItsQuantum();
  void givesEverySensorItsOwnNoise();
  void repeatsWithItsSeed();
  void standsWithinTheAlignmentTolerance();
  void marksReadingsWithoutAPose_data();
  void marksReadingsWithoutAPose();
  void displacesTheSensorBeforeTheFieldIsTaken();
  void keepsTheClock();
  void hearsItsExcitation();
  void solvesAsItsTrackerDoes_data();
  void solvesAsItsTrackerDoes();
  void scattersBeyondTheLawOfRange();
  void roundsRotations();
  void losesItsHemisphereByVisits();
  void refusesBadScenes();
};

void SimulatorTest::reportsTheTruePoseInACleanRoom() {
  const TrackerSimulator tracker = simulatorOf(Scene{});
  RandomGeometry random(1);
  for (int i = 0; i < 500; ++i) {
    const Pose truth = random.poseInShell(0.2, 4.0);
    const Sample sample = tracker.measureExactly(truth, 1.5);
    QCOMPARE(sample.status, "");
    QCOMPARE(sample.time_s, 1.5);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, truth, 1e-9, 1e-9));
  }
}

void SimulatorTest::seesTheSceneFromTheTransmitter() {
  RandomGeometry random(2);
  Scene scene;
  scene.reference_from_tracker = random.poseInShell(1.0, 3.0);
  const Pose tracker_from_sensor = random.poseInShell(0.5, 2.0);
  const Sample sample = simulatorOf(scene).measureExactly(scene.reference_from_tracker * tracker_from_sensor, 0.0);
  FT_VERIFY_MATCH(near(sample.tracker_from_sensor, tracker_from_sensor, 1e-9, 1e-9));
}

// Put together from the parts: the couplings of both effects' fields add.
void SimulatorTest::addsItsEffects() {
  const nlohmann::json floor = {{"distance_m", 1.8}};
  const nlohmann::json body = {{"center_m", {1.0, 0.8, -0.6}}, {"radius_m", 0.15}};
  Scene scene;
  scene.effects = {{"metal_plane", floor}, {"compact_metal", body}};
  const Pose truth{{1.4, 0.2, 0.3}, RandomGeometry(3).rotation()};
  const Eigen::Vector3d& p_m = truth.position_m;
  const Eigen::Matrix3d field =
      field::dipoleField(p_m, 1.0) +
      dynamic_cast<const field::CouplingDistortion&>(*effects::makeEffect("metal_plane", floor).value())
          .fieldChange(p_m, 1.0, 0.0) +
      dynamic_cast<const field::CouplingDistortion&>(*effects::makeEffect("compact_metal", body).value())
          .fieldChange(p_m, 1.0, 0.0);
  const Pose expected = field::solvePose(field::couplings(field, truth.orientation), 1.0, p_m)->tracker_from_sensor;
  const Pose seen = simulatorOf(scene).measureExactly(truth, 0.0).tracker_from_sensor;
  FT_VERIFY_MATCH(near(seen, expected, 1e-12, 1e-12));
  QVERIFY((seen.position_m - p_m).norm() > 0.01);
}

// Transverse SD = sqrt(5)/3 sigma r^4/C; 20,000 readings give it to 0.5 %.
void SimulatorTest::scattersWithTheFourthPowerOfRange() {
  Scene scene;
  scene.tracker.coupling_noise = 1e-5;
  for (const double range_m : {0.5, 1.0, 2.0, 3.0}) {
    TrackerSimulator tracker = simulatorOf(scene);
    const double expected_m = std::sqrt(5.0) / 3.0 * 1e-5 * std::pow(range_m, 4);
    FT_VERIFY_MATCH(near(rms(sidewaysErrors_m(tracker, range_m, 20000)) / expected_m, 1.0, 0.02));
  }
}

// Least squares of nine couplings of equal SD sigma, worked by hand from the singular values: radial SD
// sigma r^4/(3 sqrt(6) C), transverse sqrt(5)/3 sigma r^4/C, so the ratio is sqrt(30); each axis of the rotation
// sqrt(3/2) sigma r^3/C in root mean square. Anywhere, in any orientation; 10,000 readings give each to 1 %.
void SimulatorTest::scattersFlatAcrossTheLineOfSight() {
  Scene scene;
  scene.tracker.coupling_noise = 1e-5;
  RandomGeometry random(8);
  for (int place = 0; place < 5; ++place) {
    const Pose truth = random.poseInShell(0.5, 2.5);
    const double range_m = truth.position_m.norm();
    const Eigen::Vector3d outward = truth.position_m / range_m;
    TrackerSimulator tracker = simulatorOf(scene);
    double radial_m2 = 0.0;
    double transverse_m2 = 0.0;
    double turn_rad2 = 0.0;
    constexpr int kReadings = 10000;
    for (int i = 0; i < kReadings; ++i) {
      const Pose seen = tracker.measure(truth, i / 120.0).tracker_from_sensor;
      const Eigen::Vector3d error_m = seen.position_m - truth.position_m;
      const double along_m = outward.dot(error_m);
      radial_m2 += along_m * along_m / kReadings;
      transverse_m2 += (error_m.squaredNorm() - along_m * along_m) / (2.0 * kReadings);
      turn_rad2 += std::pow(angleBetween_rad(seen.orientation, truth.orientation), 2) / (3.0 * kReadings);
    }
    const double sigma_m = 1e-5 * std::pow(range_m, 4);
    FT_VERIFY_MATCH(near(std::sqrt(radial_m2) / (sigma_m / (3.0 * std::sqrt(6.0))), 1.0, 0.04));
    FT_VERIFY_MATCH(near(std::sqrt(transverse_m2) / (std::sqrt(5.0) / 3.0 * sigma_m), 1.0, 0.03));
    FT_VERIFY_MATCH(near(std::sqrt(transverse_m2 / radial_m2) / std::sqrt(30.0), 1.0, 0.05));
    FT_VERIFY_MATCH(near(std::sqrt(turn_rad2) / (std::sqrt(1.5) * sigma_m / range_m), 1.0, 0.03));
  }
}

void SimulatorTest::keepsTheCorrelationOfItsFilter() {
  for (const double rho : {0.0, 0.4, 0.8}) {
    Scene scene;
    scene.tracker.correlation = rho;
    TrackerSimulator tracker = simulatorOf(scene);
    const std::vector<double> errors_m = sidewaysErrors_m(tracker, 1.0, 20000);
    FT_VERIFY_MATCH(near(lag1(errors_m), rho, 0.03));
    FT_VERIFY_MATCH(near(rms(errors_m) / (std::sqrt(5.0) / 3.0 * 2e-4), 1.0, 0.04));
  }
}

void SimulatorTest::forgetsWhenReset() {
  Scene scene;
  scene.tracker.correlation = 0.99;
  TrackerSimulator tracker = simulatorOf(scene);
  std::vector<double> errors_m;
  for (int i = 0; i < 5000; ++i) {
    errors_m.push_back(sidewaysErrors_m(tracker, 1.0, 1).front());
    tracker.resetFilter(0);
  }
  FT_VERIFY_MATCH(near(lag1(errors_m), 0.0, 0.06));
}

void SimulatorTest::roundsToItsQuantum() {
  Scene scene;
  scene.tracker.quantum_m = 1e-3;
  TrackerSimulator tracker = simulatorOf(scene);
  const Pose truth = at(1.51234, -0.40017, 0.30049);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d steps = tracker.measure(truth, i / 120.0).tracker_from_sensor.position_m / 1e-3;
    FT_VERIFY_MATCH(near((steps.array() - steps.array().round()).matrix().norm(), 0.0, 1e-9));
  }
  FT_VERIFY_MATCH(near(tracker.measureExactly(truth, 0.0).tracker_from_sensor.position_m, truth.position_m, 1e-9));
}

void SimulatorTest::givesEverySensorItsOwnNoise() {
  TrackerSimulator both = simulatorOf(Scene{});
  TrackerSimulator alone = simulatorOf(Scene{});
  double products = 0.0;
  double squares = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const Sample first = both.measure(at(1.0, 0.0, 0.0), i / 120.0, 0);
    const Sample second = both.measure(at(1.0, 0.0, 0.0), i / 120.0, 1);
    QCOMPARE(second.sensor, 1);
    products += first.tracker_from_sensor.position_m.y() * second.tracker_from_sensor.position_m.y();
    squares += first.tracker_from_sensor.position_m.y() * first.tracker_from_sensor.position_m.y();
    FT_VERIFY_MATCH(
        sameBits(first.tracker_from_sensor, alone.measure(at(1.0, 0.0, 0.0), i / 120.0, 0).tracker_from_sensor));
  }
  FT_VERIFY_MATCH(near(products / squares, 0.0, 0.06));
}

void SimulatorTest::repeatsWithItsSeed() {
  const auto first = [](std::uint64_t seed) {
    TrackerSimulator tracker = simulatorOf(Scene{}, seed);
    return tracker.measure(at(1.0, 0.5, 0.0), 0.0).tracker_from_sensor;
  };
  FT_VERIFY_MATCH(sameBits(first(3), first(3)));
  QVERIFY(first(3).position_m != first(4).position_m);
}

// The transmitter of each seed stands elsewhere, by the tolerance in each axis; 400 seeds give the SD to 2 %.
void SimulatorTest::standsWithinTheAlignmentTolerance() {
  Scene scene;
  scene.rig.alignment_known = true;
  scene.rig.alignment_tolerance_m = 0.01;
  scene.rig.alignment_tolerance_rad = 0.0;
  double squares_m2 = 0.0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    const Sample sample = simulatorOf(scene, seed).measureExactly(at(1.0, 0.0, 0.0), 0.0);
    squares_m2 += (sample.tracker_from_sensor.position_m - Eigen::Vector3d(1.0, 0.0, 0.0)).squaredNorm() / 1200.0;
  }
  FT_VERIFY_MATCH(near(std::sqrt(squares_m2), 0.01, 0.0009));
}

void SimulatorTest::marksReadingsWithoutAPose_data() {
  QTest::addColumn<double>("x_m");
  QTest::addColumn<double>("z_m");
  QTest::addColumn<QString>("status");
  QTest::newRow("good") << 1.0 << 0.0 << "";
  QTest::newRow("too near") << 0.05 << 0.0 << "j";
  QTest::newRow("in the transmitter") << 0.0 << 0.0 << "j";
  QTest::newRow("too far") << 20.0 << 0.0 << "k";
  QTest::newRow("below the floor") << 1.0 << -2.5 << "k";
}

void SimulatorTest::marksReadingsWithoutAPose() {
  QFETCH(double, x_m);
  QFETCH(double, z_m);
  QFETCH(QString, status);
  Scene scene;
  scene.effects = {{"metal_plane", {{"distance_m", 2.0}, {"strength", 0.0}}}};
  TrackerSimulator tracker = simulatorOf(scene);
  QCOMPARE(QString::fromStdString(tracker.measure(at(x_m, 0.0, z_m), 0.0).status), status);
  QCOMPARE(QString::fromStdString(tracker.measureExactly(at(x_m, 0.0, z_m), 0.0).status), status);
}

// A sensor off its mark in front of a floor is read like one that is there.
void SimulatorTest::displacesTheSensorBeforeTheFieldIsTaken() {
  const EffectInstance floor{"metal_plane", {{"distance_m", 1.2}}};
  const Pose mount{{0.05, -0.02, 0.03}, rotationFromVector({0.2, 0.1, -0.3})};
  Scene off;
  off.effects = {floor, {"sensor_offset", {{"offset_m", {0.05, -0.02, 0.03}}, {"turn_rad", {0.2, 0.1, -0.3}}}}};
  Scene there;
  there.effects = {floor};
  RandomGeometry random(5);
  for (int i = 0; i < 20; ++i) {
    const Pose stated{{1.0 + 0.02 * i, 0.3, -0.2}, random.rotation()};
    const Pose seen = simulatorOf(off).measureExactly(stated, 0.0).tracker_from_sensor;
    FT_VERIFY_MATCH(
        near(seen, simulatorOf(there).measureExactly(stated * mount, 0.0).tracker_from_sensor, 1e-10, 1e-10));
  }
}

// 3e-6 a second: after 10,000 s 3 % more signal, p (1.03)^(-1/3).
void SimulatorTest::keepsTheClock() {
  Scene scene;
  scene.effects = {{"gain_drift", {{"slope_per_s", 3e-6}}}};
  const TrackerSimulator tracker = simulatorOf(scene);
  const Pose truth = at(1.2, -0.4, 0.3);
  FT_VERIFY_MATCH(near(tracker.measureExactly(truth, 0.0).tracker_from_sensor, truth, 1e-9, 1e-9));
  const Eigen::Vector3d expected_m = truth.position_m / std::cbrt(1.03);
  FT_VERIFY_MATCH(near(tracker.measureExactly(truth, 1e4).tracker_from_sensor.position_m, expected_m, 1e-9));
}

// Steel keeps a 10 kHz field out and draws a steady one in: the errors point to opposite sides.
void SimulatorTest::hearsItsExcitation() {
  Scene ac;
  ac.effects = {{"compact_metal",
                 {{"center_m", {1.5, 0.0, -0.5}},
                  {"material", "ferromagnetic"},
                  {"relative_permeability", 100.0},
                  {"conductivity_s_per_m", 6e6}}}};
  Scene steady = ac;
  steady.tracker.excitation = "pulsed_dc";
  steady.tracker.sampling_delay_s = 0.5;
  const Pose truth = at(1.5, 0.0, 0.0);
  const auto error_m = [&](const Scene& scene) {
    return Eigen::Vector3d(simulatorOf(scene).measureExactly(truth, 0.0).tracker_from_sensor.position_m -
                           truth.position_m);
  };
  QVERIFY(error_m(steady).norm() > 1e-3 && error_m(ac).norm() > 1e-3);
  QVERIFY(error_m(steady).normalized().dot(error_m(ac).normalized()) < -0.9);
}

void SimulatorTest::solvesAsItsTrackerDoes_data() {
  QTest::addColumn<QString>("solver");
  for (const char* solver : {"closed_form", "least_squares", "damped"}) QTest::newRow(solver) << QString(solver);
}

// In the open every solver reports the truth; beside metal the iterated one ends where the direct one does and the
// damped one nearer to the place the sensor came from.
void SimulatorTest::solvesAsItsTrackerDoes() {
  QFETCH(QString, solver);
  Scene scene;
  scene.tracker.solver = solver.toStdString();
  RandomGeometry random(6);
  for (int i = 0; i < 50; ++i) {
    const Pose truth = random.poseInShell(0.3, 3.0);
    FT_VERIFY_MATCH(near(simulatorOf(scene).measureExactly(truth, 0.0).tracker_from_sensor, truth, 1e-6, 1e-6));
  }
  scene.effects = {{"metal_plane", {{"distance_m", 1.0}, {"strength", 0.5}}}};
  Scene direct = scene;
  direct.tracker.solver = "closed_form";
  const Pose truth = at(1.4, 0.2, 0.1);
  const Pose seen = simulatorOf(scene).measureExactly(truth, 0.0).tracker_from_sensor;
  const Pose expected = simulatorOf(direct).measureExactly(truth, 0.0).tracker_from_sensor;
  if (solver == "damped") {
    QVERIFY((seen.position_m - truth.position_m).norm() < 0.99 * (expected.position_m - truth.position_m).norm());
  } else {
    FT_VERIFY_MATCH(near(seen, expected, 1e-6, 1e-6));
  }
}

// The SD of the couplings 3 times as large at 1 m and growing as r: positions scatter as 3 r^5.
void SimulatorTest::scattersBeyondTheLawOfRange() {
  Scene scene;
  scene.tracker.coupling_noise = 1e-5;
  scene.effects = {{"range_noise", {{"factor", 3.0}, {"power", 1.0}}}};
  for (const double range_m : {0.5, 1.0, 2.0}) {
    TrackerSimulator tracker = simulatorOf(scene);
    const double expected_m = 3.0 * std::sqrt(5.0) / 3.0 * 1e-5 * std::pow(range_m, 5);
    FT_VERIFY_MATCH(near(rms(sidewaysErrors_m(tracker, range_m, 20000)) / expected_m, 1.0, 0.02));
  }
}

void SimulatorTest::roundsRotations() {
  Scene scene;
  scene.effects = {{"quantization", {{"quantum_m", 2e-3}, {"quantum_rad", 0.01}}}};
  TrackerSimulator tracker = simulatorOf(scene);
  const Pose truth{{1.2, 0.1, -0.3}, rotationFromVector({0.312, -0.127, 0.455})};
  for (int i = 0; i < 50; ++i) {
    const Pose seen = tracker.measure(truth, i / 120.0).tracker_from_sensor;
    const Eigen::Array3d turns = rotationVector_rad(seen.orientation).array() / 0.01;
    const Eigen::Array3d steps = seen.position_m.array() / 2e-3;
    FT_VERIFY_MATCH(near((turns - turns.round()).matrix().norm(), 0.0, 1e-9));
    FT_VERIFY_MATCH(near((steps - steps.round()).matrix().norm(), 0.0, 1e-9));
    FT_VERIFY_MATCH(near(seen.position_m, truth.position_m, 4e-3));
  }
}

// Away and back again 2,000 times: three visits in ten are reported at -p with the right orientation, all readings of a
// visit alike. The SD of that share is 1 %.
void SimulatorTest::losesItsHemisphereByVisits() {
  Scene scene;
  scene.tracker.coupling_noise = 0.0;
  scene.effects = {{"hemisphere_flip", {{"probability", 0.3}}}};
  TrackerSimulator tracker = simulatorOf(scene);
  int flips = 0;
  for (int visit = 0; visit < 2000; ++visit) {
    const Pose truth = at(1.0 + 0.2 * (visit % 2), 0.3, -0.1);
    const Pose first = tracker.measure(truth, visit).tracker_from_sensor;
    const Pose second = tracker.measure(truth, visit + 0.01).tracker_from_sensor;
    const bool is_flipped = first.position_m.x() < 0.0;
    const Pose expected{is_flipped ? Eigen::Vector3d(-truth.position_m) : truth.position_m, truth.orientation};
    FT_VERIFY_MATCH(near(first, expected, 1e-9, 1e-9));
    FT_VERIFY_MATCH(near(second, expected, 1e-9, 1e-9));
    flips += is_flipped ? 1 : 0;
  }
  FT_VERIFY_MATCH(near(flips / 2000.0, 0.3, 0.035));
}

void SimulatorTest::refusesBadScenes() {
  Scene unsolved;
  unsolved.tracker.solver = "newton";
  FT_VERIFY_MATCH(holdsAll(TrackerSimulator::make(unsolved, 1).error().message, {"newton", "closed_form"}));
  Scene scene;
  scene.name = "attic";
  scene.effects = {{"metal_plane", {}}, {"metal_roof", {}}};
  FT_VERIFY_MATCH(holdsAll(TrackerSimulator::make(scene, 1).error().message, {"attic", "effect 2", "metal_roof"}));
}

FIELDTRUE_TEST(SimulatorTest)
#include "simulator_test.moc"
