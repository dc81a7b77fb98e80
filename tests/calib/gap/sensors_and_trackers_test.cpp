#include <QTest>
#include <algorithm>
#include <random>
#include <vector>

#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

constexpr const char* kBody = R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})";

Pose mountOf(int sensor) {
  return sensor == 0 ? Pose{} : Pose{{0.08, -0.05, 0.02}, rotationFromVector({0.4, 1.1, -0.7})};
}

/// The same places recorded by two sensors on one jig, the second off the mount and turned.
CalibrationTable recordedByTwo(simulation::Scene scene, const Pose& second = mountOf(1),
                               SampleTable* samples = nullptr) {
  CalibrationTable both;
  for (const int sensor : {0, 1}) {
    scene.mount_from_sensor = sensor == 0 ? Pose{} : second;
    SampleTable own_samples;
    const CalibrationTable own = recordedIn(scene, gapPlan(), 1 + static_cast<std::uint64_t>(sensor),
                                            samples != nullptr ? &own_samples : nullptr);
    for (SampleRow row : own_samples.rows) {
      row.sample.sensor = sensor;
      samples->rows.push_back(row);
    }
    both.metadata = own.metadata;
    for (Node node : own.nodes) {
      node.sensor = sensor;
      both.nodes.push_back(node);
    }
  }
  return both;
}

}  // namespace

class SensorsAndTrackersTest : public QObject {
  Q_OBJECT
 private slots:
  /// Two sensors in one table: no gap where nothing is wrong, the body named where there is one, each mounting found.
  void eachSensorHasItsMounting() {
    const auto clean = diagnose(recordedByTwo(gapScene()), nullptr, nullptr);
    FT_VERIFY_OK(clean);
    QVERIFY2(clean->verdict == GapVerdict::kNoGap, clean->text.c_str());
    QCOMPARE(clean->sensors_from_mounts.size(), std::size_t{2});
    const Pose second = inverse(clean->sensors_from_mounts.at(1));
    const Pose first = inverse(clean->sensors_from_mounts.at(0));
    QVERIFY((second.position_m - first.position_m - mountOf(1).position_m).norm() < 0.002);
    QVERIFY(angleBetween_rad(first.orientation.conjugate() * second.orientation, mountOf(1).orientation) < 0.005);
    simulation::Scene scene = gapScene();
    scene.effects.push_back({"compact_metal", nlohmann::json::parse(kBody)});
    const auto report = diagnose(recordedByTwo(scene), nullptr, nullptr);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, "compact_metal"));
    FT_VERIFY_MATCH(near(*report->selected.front().location_m, {1.3, 0.5, 0.3}, 0.08));
    QCOMPARE(report->input.rows, 160);
    QCOMPARE(report->input.places, 80);
  }

  /// The layer of a jig is where its holder is, wherever the sensor hangs from it: 11 cm below, more than half a step.
  void aSensorThatHangsLowIsOfItsHoldersLayer() {
    simulation::Scene scene = gapScene();
    const std::vector<double> offsets_m = {0.0, 0.006, -0.005, 0.004};
    scene.effects.push_back(
        {"jig_layer_offset", {{"axis", "z"}, {"heights_m", {0.0, 0.2, 0.4, 0.6}}, {"offsets_m", offsets_m}}});
    const Pose hanging{{0.0, 0.0, -0.11}, Eigen::Quaterniond::Identity()};
    const auto report = diagnose(recordedByTwo(scene, hanging), nullptr, nullptr);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, "jig_layer_offset"));
    const nlohmann::json& found = report->selected.front().scene_parameters;
    QCOMPARE(found.at("heights_m").size(), offsets_m.size());
    // Layers against each other: how high all of them stand is the alignment's.
    const auto found_m = found.at("offsets_m").get<std::vector<double>>();
    for (std::size_t k = 1; k < offsets_m.size(); ++k)
      FT_VERIFY_MATCH(near(found_m[k] - found_m[0], offsets_m[k] - offsets_m[0], 0.001));
  }

  /// Single readings of every sensor are looked at, and it is said whose they are.
  void eachSensorsReadingsAreLookedAt() {
    SampleTable samples;
    CalibrationTable both = recordedByTwo(gapScene(), mountOf(1), &samples);
    simulation::Scene humming = gapScene();
    humming.effects.push_back({"mains_interference", {{"line_hz", {50.0}}, {"amplitude_per_m3", {1e-4}}}});
    SampleTable with_hum;
    recordedByTwo(humming, mountOf(1), &with_hum);
    for (std::size_t i = 0; i < samples.rows.size(); ++i)
      if (samples.rows[i].sample.sensor == 1) samples.rows[i] = with_hum.rows[i];
    const auto report = diagnose(both, &samples, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(isTold(*report, "Sensor 1: "));
    QVERIFY(!isTold(*report, "Sensor 0: "));
  }

  /// The readings of another recording are refused before anything is diagnosed.
  void samplesOfAnotherRoomAreRefused() {
    SampleTable samples;
    recordedIn(gapScene(), gapPlan(), 1, &samples);
    for (SampleRow& row : samples.rows) row.sample.tracker_from_sensor.position_m.y() += 0.3;
    const auto report = diagnose(recordedIn(gapScene(), gapPlan()), &samples, nullptr);
    QVERIFY(!report && report.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(report.error().message, {"The samples are not those of this table", "80 of 80 places"}));
  }

  /// Of a tracker whose transmitter is no dipole nothing is claimed by the physics of dipoles: the same readings have a
  /// cause, or only a place.
  void noDipoleNoMetal() {
    Withheld made = withheldFrom("compact_metal", kBody);
    for (const char* model : {"optical", "planar_coils", "unknown"}) {
      made.table.metadata.transmitter_model = model;
      const auto report = diagnose(made.table, nullptr, nullptr);
      FT_VERIFY_OK(report);
      QVERIFY2(report->verdict == GapVerdict::kUnexplained, report->text.c_str());
      QVERIFY(report->selected.empty());
      QCOMPARE(report->candidates.front().effect, std::string(kUnnamedSmooth));
      QVERIFY(isTold(*report, std::string("transmitter_model: ") + model));
    }
    made.table.metadata.transmitter_model = "dipole";  // As the simulator states it.
    const auto dipole = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_MATCH(names(*dipole, "compact_metal"));
    QVERIFY(!isTold(*dipole, "transmitter_model"));
    made.table.metadata.transmitter_model.reset();
    const auto assumed = diagnose(made.table, nullptr, nullptr);
    QVERIFY(isTold(*assumed, "a transmitter of dipoles is assumed"));
  }

  /// What the rig does is named for any tracker.
  void theRigIsNamedForAll() {
    Withheld made = withheldFrom("grid_scale", R"({"scale": [0.03, 0.03, 0.03]})");
    made.table.metadata.transmitter_model = "optical";
    const auto report = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, "grid_scale"));
  }

  /// A body beside a corner of the grid bends a few places, which the others cannot foretell: named or not, it is a
  /// gap.
  void whatBendsACornerIsAGap_data() {
    QTest::addColumn<double>("beyond_m");
    QTest::addColumn<double>("radius_m");
    QTest::newRow("small and near") << 0.16 << 0.045;
    QTest::newRow("a little larger") << 0.16 << 0.06;
    QTest::newRow("large and farther off") << 0.2 << 0.09;
  }
  void whatBendsACornerIsAGap() {
    QFETCH(double, beyond_m);
    QFETCH(double, radius_m);
    const Eigen::Vector3d corner_m(0.8, 0.0, 0.6);
    const Eigen::Vector3d outwards = Eigen::Vector3d(1.0, -1.0, 1.0).normalized();
    const Eigen::Vector3d center_m = inverse(gapScene().reference_from_tracker) * (corner_m + beyond_m * outwards);
    const nlohmann::json body = {{"center_m", {center_m.x(), center_m.y(), center_m.z()}}, {"radius_m", radius_m}};
    const auto report = diagnose(withheldFrom("compact_metal", body.dump()).table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(report->verdict != GapVerdict::kNoGap, report->text.c_str());
  }

  void mirroredAxesAreAFinding_data() {
    QTest::addColumn<bool>("turned");
    QTest::newRow("a sign") << false;
    QTest::newRow("two exchanged") << true;
  }
  void mirroredAxesAreAFinding() {
    QFETCH(bool, turned);
    CalibrationTable table = recordedIn(gapScene(), gapPlan());
    for (Node& node : table.nodes) {
      Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
      if (turned)
        std::swap(p_m.x(), p_m.y());
      else
        p_m.z() = -p_m.z();
    }
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(isTold(*report, "mirror images"));
    QVERIFY2(report->selected.empty() && report->verdict == GapVerdict::kUnexplained, report->text.c_str());
    QVERIFY(!isTold(*report, "looks as if") && !report->source_shape);
    // Whatever is left of them, no more of it is noise than a jig gives: a finger's breadth where nothing is stated.
    QVERIFY2(report->floor_position_mm < 20.0, report->text.c_str());
    QVERIFY(!isTold(*diagnose(recordedIn(gapScene(), gapPlan()), nullptr, nullptr), "mirror images"));
  }

  void oneSensorWithMirroredAxesIsNamed() {
    CalibrationTable table = recordedIn(gapScene(), gapPlan());
    std::vector<Node> second = table.nodes;
    for (Node& node : second) {
      node.sensor = 2;
      std::swap(node.tracker_from_sensor.position_m.y(), node.tracker_from_sensor.position_m.z());
    }
    table.nodes.insert(table.nodes.end(), second.begin(), second.end());
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(isTold(*report, "positions of sensor 2 are mirror images"));
    QVERIFY2(report->selected.empty() && report->verdict == GapVerdict::kUnexplained, report->text.c_str());
  }

  /// Rows in another order are readings of other places: no cause is looked for. Without a reading of its place the RMS
  /// about the middle is left of both, so a half of them lies off by about the spread itself.
  void rowsOfOtherPlacesAreAFinding() {
    CalibrationTable table = recordedIn(gapScene(), gapPlan());
    std::vector<Pose> readings;
    for (const Node& node : table.nodes) readings.push_back(node.tracker_from_sensor);
    std::shuffle(readings.begin(), readings.end(), std::mt19937_64(4));
    for (std::size_t i = 0; i < readings.size(); ++i) table.nodes[i].tracker_from_sensor = readings[i];
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(isTold(*report, "do not belong together"));
    for (const SelectedEffect& effect : report->selected) QCOMPARE(effect.effect, std::string("range_noise"));
    QCOMPARE(report->verdict, GapVerdict::kUnexplained);
    QVERIFY(!isTold(*diagnose(recordedIn(gapScene(), gapPlan()), nullptr, nullptr), "do not belong together"));
  }

  /// A sensor on an arm longer than the grid is wide, turned at every place: far from its places, and where it should
  /// be.
  void aLongArmIsNotAstray() {
    GapPlan plan;
    plan.counts = {3, 3, 3};
    plan.orientations = threeTurns();
    CalibrationTable table = recordedIn(gapScene(), gapPlan(plan));
    for (Node& node : table.nodes)
      node.tracker_from_sensor.position_m += node.tracker_from_sensor.orientation * Eigen::Vector3d(0.4, 0.3, 0.2);
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(!isTold(*report, "do not belong together"), report->text.c_str());
  }

  /// A tolerance that is stated ten times too large is told, with what the places really keep; twice is nothing to
  /// tell.
  void aToleranceFarTooLargeIsTold() {
    CalibrationTable table = recordedIn(gapScene(), gapPlan());
    const double kept_m = gapScene().rig.tolerance_m;
    for (const double factor : {1.0, 2.0, 10.0}) {
      table.metadata.jig_tolerance_m = factor * kept_m;
      const auto report = diagnose(table, nullptr, nullptr);
      FT_VERIFY_OK(report);
      QVERIFY2(report->verdict == GapVerdict::kNoGap, report->text.c_str());
      QCOMPARE(isTold(*report, "more exact than stated"), factor > 2.0);
    }
  }

  /// Twice as far as the tolerance says is a tolerance stated too small; four times as far is no placing.
  void whatScattersFarBeyondItsToleranceIsAGap() {
    const auto scattered = [](double sd_m) {
      CalibrationTable table = recordedIn(gapScene(), gapPlan());
      std::mt19937_64 random(5);
      std::normal_distribution<double> normal(0.0, sd_m);
      for (Node& node : table.nodes)
        node.tracker_from_sensor.position_m += Eigen::Vector3d(normal(random), normal(random), normal(random));
      return diagnose(table, nullptr, nullptr);
    };
    const auto twice = scattered(0.0017);
    FT_VERIFY_OK(twice);
    QVERIFY2(twice->verdict == GapVerdict::kNoGap && isTold(*twice, "less exact than stated"), twice->text.c_str());
    const auto four = scattered(0.004);
    FT_VERIFY_OK(four);
    QVERIFY2(four->verdict == GapVerdict::kUnexplained && four->selected.empty(), four->text.c_str());
    QVERIFY(isTold(*four, "may be too small by a factor of 2.2"));
  }
};

FIELDTRUE_TEST(SensorsAndTrackersTest)
#include "sensors_and_trackers_test.moc"
