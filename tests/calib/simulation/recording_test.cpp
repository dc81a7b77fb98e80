#include <QTest>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/core/quantum.h"
#include "calib/core/statistics.h"
#include "calib/effects/effect_row.h"
#include "calib/effects/registry.h"
#include "calib/simulation/simulator.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::simulation;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;
using fieldtrue::testing::sameBits;

namespace {

/// Places on a line in front of the transmitter, each with the given number of visits.
std::vector<PlannedPlace> lineOfPlaces(int count, int visits, double first_m, double pitch_m) {
  std::vector<PlannedPlace> plan;
  for (int visit = 0; visit < visits; ++visit) {
    for (int node = 0; node < count; ++node) {
      PlannedPlace place;
      place.node = node;
      place.visit = visit;
      place.index = std::array<int, 3>{node, 0, 0};
      place.reference_from_sensor.position_m = {first_m + node * pitch_m, 0.2, -0.1};
      plan.push_back(place);
    }
  }
  return plan;
}

Scene floorScene() {
  Scene scene;
  scene.effects = {{"metal_plane", {{"strength", 0.5}}}};
  return scene;
}

fieldtrue::testing::Match sameSimulation(const Simulation& a, const Simulation& b) {
  if (a.samples.rows.size() != b.samples.rows.size()) return {false, "another number of samples"};
  for (std::size_t i = 0; i < a.samples.rows.size(); ++i) {
    const fieldtrue::testing::Match match =
        sameBits(a.samples.rows[i].sample.tracker_from_sensor, b.samples.rows[i].sample.tracker_from_sensor);
    if (!match.ok) return match;
  }
  for (std::size_t i = 0; i < a.table.nodes.size(); ++i) {
    const fieldtrue::testing::Match match =
        sameBits(a.table.nodes[i].tracker_from_sensor, b.table.nodes[i].tracker_from_sensor);
    if (!match.ok) return match;
  }
  return {true, "the same"};
}

}  // namespace

class RecordingTest : public QObject {
  Q_OBJECT
 private slots:
  void fillsEveryRow();
  void fillsTheMetadata();
  void doesNotDependOnTheOrderOfWork();
  void readsAsTheTrackerDoes();
  void meansConvergeAsTheirCountSays_data();
  void meansConvergeAsTheirCountSays();
  void placesTheJigWithItsTolerance();
  void turnsTheJigWithItsTolerance();
  void keepsTheQuantum();
  void passesOverSkippedPlaces();
  void namesAPlaceWithoutAPose_data();
  void namesAPlaceWithoutAPose();
  void refusesBadPlans();
  void givesEffectsTheTimeOfEachReading();
  void movesTheLayersOfTheRig();
  void meetsTheMainsAtAnotherPhaseOnEveryVisit();
  void repeatsWithEveryEffectAtOnce();
  void stopsWhenAsked();
};

void RecordingTest::fillsEveryRow() {
  std::vector<PlannedPlace> plan = lineOfPlaces(3, 2, 0.6, 0.4);
  plan[1].role = NodeRole::kValidation;
  const SimulationOptions options{7, 24, 4.0};
  const Result<Simulation> simulation = simulate(floorScene(), plan, options);
  FT_VERIFY_OK(simulation);
  QCOMPARE(simulation->table.nodes.size(), plan.size());
  QCOMPARE(simulation->samples.rows.size(), plan.size() * 24);
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const Node& node = simulation->table.nodes[i];
    QCOMPARE(node.node, plan[i].node);
    QCOMPARE(node.visit, plan[i].visit);
    QVERIFY(node.index == plan[i].index);
    QCOMPARE(node.role, plan[i].role);
    QVERIFY(node.has_orientation);
    QCOMPARE(node.n_used + node.n_rejected, 24);
    FT_VERIFY_MATCH(sameBits(node.reference_from_sensor, plan[i].reference_from_sensor));
    // 24 readings at 120 Hz take 0.2 s; before each place 4 s of travel.
    const double start_s = 4.0 + 4.2 * static_cast<double>(i);
    FT_VERIFY_MATCH(near(*node.t_start_s, start_s, 1e-9));
    FT_VERIFY_MATCH(near(*node.t_end_s, start_s + 23.0 / 120.0, 1e-9));
    const SampleRow& last = simulation->samples.rows[24 * i + 23];
    QCOMPARE(last.node, plan[i].node);
    QCOMPARE(last.visit, plan[i].visit);
    QCOMPARE(last.sample.time_s, *node.t_end_s);
  }
  std::ostringstream text;
  writeNodeTable(text, simulation->table);
  std::istringstream in(text.str());
  FT_VERIFY_OK(readNodeTable(in, "simulated"));
}

void RecordingTest::fillsTheMetadata() {
  Scene scene;
  scene.tracker.quantum_m = 1e-4;
  scene.rig = {"pegboard", 0.002, 0.0, true, 0.003, 0.0};
  const TableMetadata known = simulate(scene, lineOfPlaces(1, 1, 1.0, 0.1), {})->table.metadata;
  QCOMPARE(known.frame, "jig");
  QCOMPARE(known.tracker.value(), scene.tracker.name);
  QCOMPARE(known.rig.value(), "pegboard");
  QCOMPARE(known.excitation.value(), "ac");
  QCOMPARE(known.carrier_hz.value(), 10016.0);
  QCOMPARE(known.rate_hz.value(), 120.0);
  QCOMPARE(known.quantum_m.value(), 1e-4);
  QCOMPARE(known.jig_tolerance_m.value(), 0.002);
  QVERIFY(!known.jig_tolerance_rad.has_value());
  QVERIFY(known.alignment_known);
  QCOMPARE(known.alignment_tolerance_m.value(), 0.003);
  QVERIFY(!known.alignment_tolerance_rad.has_value());

  scene.rig = {"wooden stand", 0.001, 0.003, false, 0.0, 0.0};
  std::ostringstream text;
  writeNodeTable(text, simulate(scene, lineOfPlaces(1, 1, 1.0, 0.1), {})->table);
  std::istringstream in(text.str());
  const auto stated = readNodeTable(in, "simulated");
  FT_VERIFY_OK(stated);
  QCOMPARE(stated->table.metadata.jig_tolerance_m.value(), 0.001);
  QCOMPARE(stated->table.metadata.jig_tolerance_rad.value(), 0.003);

  Scene pulsed;
  pulsed.tracker.excitation = "pulsed_dc";
  const Simulation plain = simulate(pulsed, lineOfPlaces(1, 1, 1.0, 0.1), {}).value();
  QVERIFY(!plain.table.metadata.carrier_hz && !plain.table.metadata.quantum_m && !plain.table.metadata.jig_tolerance_m);
  QVERIFY(!plain.table.metadata.alignment_known);
  QCOMPARE(plain.samples.metadata.excitation.value(), "pulsed_dc");
}

void RecordingTest::doesNotDependOnTheOrderOfWork() {
  Scene scene = floorScene();
  scene.tracker.correlation = 0.95;
  scene.rig.tolerance_m = 0.002;
  const std::vector<PlannedPlace> plan = lineOfPlaces(6, 2, 0.6, 0.2);
  RunControl backwards;
  backwards.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    for (std::size_t i = count; i > 0; --i) body(i - 1);
  };
  const Simulation first = simulate(scene, plan, {}).value();
  FT_VERIFY_MATCH(sameSimulation(first, simulate(scene, plan, {}, backwards).value()));
  SimulationOptions other;
  other.seed = 2;
  QVERIFY(!sameSimulation(first, simulate(scene, plan, other).value()).ok);
}

// With an exact jig the recording is what one tracker reads at these times, its noise carried on from place to place.
void RecordingTest::readsAsTheTrackerDoes() {
  Scene scene = floorScene();
  scene.tracker.correlation = 0.9;
  const SimulationOptions options{5, 10, 0.05};
  const Simulation simulation = simulate(scene, lineOfPlaces(4, 1, 0.6, 0.3), options).value();
  TrackerSimulator tracker = std::move(TrackerSimulator::make(scene, options.seed).value());
  for (std::size_t i = 0; i < simulation.samples.rows.size(); ++i) {
    const Sample& sample = simulation.samples.rows[i].sample;
    const Pose& truth = simulation.table.nodes[i / 10].reference_from_sensor;
    FT_VERIFY_MATCH(sameBits(sample.tracker_from_sensor, tracker.measure(truth, sample.time_s).tracker_from_sensor));
  }
}

void RecordingTest::meansConvergeAsTheirCountSays_data() {
  QTest::addColumn<double>("correlation");
  QTest::newRow("independent readings") << 0.0;
  QTest::newRow("filtered readings") << 0.5;
}

// The spread of 300 visits' means is what each of them claims: single-sample covariance / n_effective. The SD of 900
// components is known to 2.4 %; the estimate of the autocorrelation from 240 readings is low by about 4/n.
void RecordingTest::meansConvergeAsTheirCountSays() {
  QFETCH(double, correlation);
  Scene scene;
  scene.tracker.correlation = correlation;
  SimulationOptions options;
  options.samples_per_node = 240;
  const Simulation simulation = simulate(scene, lineOfPlaces(1, 300, 1.5, 0.1), options).value();
  double spread_m2 = 0.0;
  double claimed_m2 = 0.0;
  double n_effective = 0.0;
  for (const Node& node : simulation.table.nodes) {
    const Eigen::Vector3d error_m = node.tracker_from_sensor.position_m - node.reference_from_sensor.position_m;
    spread_m2 += error_m.squaredNorm();
    claimed_m2 += node.covariance_m2->trace() / node.n_effective;
    n_effective += node.n_effective / 300.0;
  }
  FT_VERIFY_MATCH(near(std::sqrt(spread_m2 / claimed_m2), 1.0, 0.12));
  // n (1 - rho)/(1 + rho): 240, or 80.
  const double expected = 240.0 * (1.0 - correlation) / (1.0 + correlation);
  FT_VERIFY_MATCH(near(n_effective / expected, 1.0, 0.1));
}

void RecordingTest::placesTheJigWithItsTolerance() {
  Scene scene;
  scene.tracker.coupling_noise = 0.0;
  scene.rig.tolerance_m = 0.005;
  SimulationOptions options;
  options.samples_per_node = 1;
  const Simulation simulation = simulate(scene, lineOfPlaces(1, 1000, 1.0, 0.1), options).value();
  double squares_m2 = 0.0;
  for (const Node& node : simulation.table.nodes) {
    squares_m2 += (node.tracker_from_sensor.position_m - node.reference_from_sensor.position_m).squaredNorm();
  }
  FT_VERIFY_MATCH(near(std::sqrt(squares_m2 / 3000.0), 0.005, 0.0003));
}

void RecordingTest::turnsTheJigWithItsTolerance() {
  Scene scene;
  scene.tracker.coupling_noise = 0.0;
  scene.rig.tolerance_rad = 0.01;
  SimulationOptions options;
  options.samples_per_node = 1;
  const Simulation simulation = simulate(scene, lineOfPlaces(1, 1000, 1.0, 0.1), options).value();
  double squares_rad2 = 0.0;
  for (const Node& node : simulation.table.nodes) {
    squares_rad2 +=
        std::pow(angleBetween_rad(node.tracker_from_sensor.orientation, node.reference_from_sensor.orientation), 2);
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, node.reference_from_sensor.position_m, 1e-9));
  }
  FT_VERIFY_MATCH(near(std::sqrt(squares_rad2 / 3000.0), 0.01, 0.0006));
}

void RecordingTest::keepsTheQuantum() {
  Scene scene;
  scene.tracker.quantum_m = 2.5e-4;
  const Simulation simulation = simulate(scene, lineOfPlaces(3, 1, 1.5, 0.2), {}).value();
  std::vector<double> values_m;
  for (const SampleRow& row : simulation.samples.rows) {
    for (int axis = 0; axis < 3; ++axis) values_m.push_back(row.sample.tracker_from_sensor.position_m[axis]);
  }
  const std::optional<double> found_m = findQuantum_m(values_m);
  QVERIFY(found_m.has_value());
  FT_VERIFY_MATCH(near(*found_m, 2.5e-4, 1e-9));
}

void RecordingTest::passesOverSkippedPlaces() {
  std::vector<PlannedPlace> plan = lineOfPlaces(3, 1, 0.6, 0.4);
  plan[1].role = NodeRole::kSkipped;
  const Simulation simulation = simulate(Scene{}, plan, {}).value();
  QCOMPARE(simulation.table.nodes.size(), std::size_t{2});
  QCOMPARE(simulation.table.nodes[1].node, 2);
}

void RecordingTest::namesAPlaceWithoutAPose_data() {
  QTest::addColumn<double>("x_m");
  QTest::addColumn<double>("z_m");
  QTest::addColumn<QList<QByteArray>>("fragments");
  using List = QList<QByteArray>;
  QTest::newRow("too far") << 12.0 << 0.0 << List{"P41", "visit 3", "12 m", "too weak", "9.14 m"};
  QTest::newRow("too near") << 0.05 << 0.0 << List{"P41", "0.05 m", "saturates", "0.1 m"};
  QTest::newRow("in the metal") << 0.0 << -3.0 << List{"P41", "3 m", "inside the metal", "effect 1 (metal_plane)"};
}

void RecordingTest::namesAPlaceWithoutAPose() {
  QFETCH(double, x_m);
  QFETCH(double, z_m);
  QFETCH(QList<QByteArray>, fragments);
  Scene scene;
  scene.effects = {{"metal_plane", {{"distance_m", 2.0}, {"strength", 0.0}}}};
  std::vector<PlannedPlace> plan = lineOfPlaces(2, 1, 0.6, 0.2);
  plan.push_back({41, 3, std::nullopt, {{x_m, 0.0, z_m}, Eigen::Quaterniond::Identity()}, NodeRole::kFit});
  const Result<Simulation> simulation = simulate(scene, plan, {});
  QVERIFY(!simulation.has_value());
  QCOMPARE(simulation.error().code, ErrorCode::kUnsupported);
  FT_VERIFY_MATCH(holdsAll(simulation.error().message, fragments));
}

void RecordingTest::refusesBadPlans() {
  const std::vector<PlannedPlace> good = lineOfPlaces(2, 1, 0.6, 0.2);
  FT_VERIFY_MATCH(holdsAll(simulate(Scene{}, {}, {}).error().message, {"plan holds no place"}));
  std::vector<PlannedPlace> twice = good;
  twice[1].node = twice[0].node;
  FT_VERIFY_MATCH(holdsAll(simulate(Scene{}, twice, {}).error().message, {"node 0", "visit 0", "twice"}));
  FT_VERIFY_MATCH(holdsAll(simulate(Scene{}, good, {1, 0, 5.0}).error().message, {"samples_per_node is 0"}));
  FT_VERIFY_MATCH(holdsAll(simulate(Scene{}, good, {1, 60, -1.0}).error().message, {"travel_s is -1"}));
  Scene bad;
  bad.effects = {{"metal_roof", {}}};
  QCOMPARE(simulate(bad, good, {}).error().code, ErrorCode::kBadInput);
}

// Each reading, not each place, is (1 + 1e-3 t)^(-1/3) as far away as the sensor.
void RecordingTest::givesEffectsTheTimeOfEachReading() {
  Scene scene;
  scene.tracker.coupling_noise = 0.0;
  scene.effects = {{"gain_drift", {{"slope_per_s", 1e-3}}}};
  const Simulation simulation = simulate(scene, lineOfPlaces(5, 1, 0.6, 0.3), {}).value();
  for (std::size_t i = 0; i < simulation.samples.rows.size(); ++i) {
    const Sample& sample = simulation.samples.rows[i].sample;
    const Eigen::Vector3d& truth_m = simulation.table.nodes[i / 60].reference_from_sensor.position_m;
    const Eigen::Vector3d expected_m = truth_m / std::cbrt(1.0 + 1e-3 * sample.time_s);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m, expected_m, 1e-9));
  }
}

// The table keeps what the rig says; the readings come from where the layer is.
void RecordingTest::movesTheLayersOfTheRig() {
  Scene scene;
  scene.tracker.coupling_noise = 0.0;
  scene.effects = {
      {"jig_layer_offset", {{"axis", "x"}, {"heights_m", {0.6, 0.9, 1.2}}, {"offsets_m", {0.0, 0.01, -0.02}}}}};
  const Simulation simulation = simulate(scene, lineOfPlaces(3, 1, 0.6, 0.3), {}).value();
  const double expected_m[3] = {0.6, 0.91, 1.18};
  for (std::size_t i = 0; i < 3; ++i) {
    const Node& node = simulation.table.nodes[i];
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, Eigen::Vector3d(expected_m[i], 0.2, -0.1), 1e-9));
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m.x(), 0.6 + 0.3 * static_cast<double>(i), 1e-12));
  }
}

// 60 Hz read 60 times a second is a constant during a visit; from visit to visit it takes any phase, so the means of
// a coupling scatter with the SD A/sqrt(2) d. A coupling S_yx off by s turns the sensor and moves the reading; here
// only the scatter is asked for: of 400 visits none like another, their mean near the truth.
void RecordingTest::meetsTheMainsAtAnotherPhaseOnEveryVisit() {
  Scene scene;
  scene.tracker.coupling_noise = 0.0;
  scene.tracker.rate_hz = 60.0;
  scene.effects = {{"mains_interference", {{"line_hz", {60.0}}, {"amplitude_per_m3", {1e-3}}}}};
  const Simulation simulation = simulate(scene, lineOfPlaces(1, 400, 1.0, 0.3), {}).value();
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  double squares_m2 = 0.0;
  for (std::size_t i = 0; i < simulation.table.nodes.size(); ++i) {
    const Node& node = simulation.table.nodes[i];
    const Eigen::Vector3d error_m = node.tracker_from_sensor.position_m - node.reference_from_sensor.position_m;
    const Pose& first = simulation.samples.rows[60 * i].sample.tracker_from_sensor;
    FT_VERIFY_MATCH(near(simulation.samples.rows[60 * i + 59].sample.tracker_from_sensor, first, 1e-9, 1e-9));
    mean_m += error_m / 400.0;
    squares_m2 += error_m.squaredNorm() / 400.0;
  }
  QVERIFY(squares_m2 > 1e-8);
  QVERIFY(mean_m.norm() < 0.15 * std::sqrt(squares_m2));
}

void RecordingTest::repeatsWithEveryEffectAtOnce() {
  Scene scene;
  for (const effects::Effect& effect : effects::effects()) {
    scene.effects.push_back({effect.id, effects::resolveEffectParameters(effect, nullptr).value()});
  }
  const std::vector<PlannedPlace> plan = lineOfPlaces(5, 1, 0.6, 0.1);
  const Simulation once = simulate(scene, plan, {}).value();
  FT_VERIFY_MATCH(sameSimulation(once, simulate(scene, plan, {}).value()));
  for (const Node& node : once.table.nodes) QVERIFY(node.tracker_from_sensor.position_m.allFinite());
}

void RecordingTest::stopsWhenAsked() {
  std::stop_source source;
  RunControl control;
  control.stop = source.get_token();
  double last_progress = 0.0;
  control.progress = [&](double fraction) { last_progress = fraction; };
  FT_VERIFY_OK(simulate(Scene{}, lineOfPlaces(3, 1, 0.6, 0.2), {}, control));
  QCOMPARE(last_progress, 1.0);
  source.request_stop();
  QCOMPARE(simulate(Scene{}, lineOfPlaces(3, 1, 0.6, 0.2), {}, control).error().code, ErrorCode::kCancelled);
}

FIELDTRUE_TEST(RecordingTest)
#include "recording_test.moc"
