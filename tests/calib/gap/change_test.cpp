#include "calib/gap/change.h"

#include <QTest>
#include <algorithm>
#include <memory>
#include <random>

#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

constexpr const char* kCarriedIn = R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})";
constexpr const char* kFloorThen =
    R"({"toward": [0, 0, -1], "distance_m": 1.3, "material": "conductive", "strength": 0.5})";

/// The plan moved by half a pitch or so: none of its places was there before.
std::vector<PlannedPlace> otherPlaces() {
  std::vector<PlannedPlace> plan = gapPlan();
  for (PlannedPlace& place : plan) {
    place.node += 1000;
    place.reference_from_sensor.position_m += Eigen::Vector3d(0.09, -0.07, 0.06);
  }
  return plan;
}

simulation::Scene roomWith(std::initializer_list<simulation::EffectInstance> effects) {
  simulation::Scene scene = gapScene();
  scene.effects.assign(effects);
  return scene;
}

Result<GapReport> since(const CalibrationTable& before, const CalibrationTable& now) {
  DiagnosisOptions options;
  options.against = std::make_shared<CalibrationTable>(before);
  return diagnose(now, nullptr, nullptr, options);
}

simulation::EffectInstance effect(const char* id, const char* parameters) {
  return {id, nlohmann::json::parse(parameters)};
}

}  // namespace

class ChangeTest : public QObject {
  Q_OBJECT
 private slots:
  /// A room with a floor of metal and a leaning rig, recorded twice: both are wrong in both, so nothing changed,
  /// whether the places are the same or others.
  void whatWasWrongBeforeIsNoChange() {
    const simulation::Scene room = roomWith({effect("metal_plane", kFloorThen)});
    const CalibrationTable before = recordedIn(room, gapPlan(), 1);
    for (const auto& plan : {gapPlan(), otherPlaces()}) {
      const auto report = since(before, recordedIn(room, plan, 2));
      FT_VERIFY_OK(report);
      QVERIFY(report->against.has_value());
      QVERIFY2(!report->against->changed, report->text.c_str());
      QVERIFY(report->verdict == GapVerdict::kNoGap);
      QVERIFY(report->selected.empty());
      QVERIFY(report->against->effect.empty() && !report->against->location_m);
      QVERIFY(report->text.find("Nothing changed") == 0);
    }
  }

  /// A body carried into a room that already has a floor: named and placed, at the same places and at others.
  void whatCameInIsNamed() {
    const CalibrationTable before = recordedIn(roomWith({effect("metal_plane", kFloorThen)}), gapPlan(), 1);
    const simulation::Scene after = roomWith({effect("metal_plane", kFloorThen), effect("compact_metal", kCarriedIn)});
    for (const auto& plan : {gapPlan(), otherPlaces()}) {
      const auto report = since(before, recordedIn(after, plan, 2));
      FT_VERIFY_OK(report);
      QVERIFY2(report->against->changed && report->against->p_value < 0.01, report->text.c_str());
      QCOMPARE(report->against->effect, std::string("compact_metal"));
      FT_VERIFY_MATCH(near(*report->against->location_m, {1.3, 0.5, 0.3}, 0.15));
      QVERIFY(report->against->rms_mm > 0.5);
    }
  }

  /// The same body carried out of a room that holds nothing else: what the earlier recording alone shows is no noise of
  /// its own, and stood where it stood.
  void whatWentIsNamed() {
    const simulation::Scene before = roomWith({effect("compact_metal", kCarriedIn)});
    for (const auto& plan : {gapPlan(), otherPlaces()}) {
      const auto report = since(recordedIn(before, gapPlan(), 1), recordedIn(roomWith({}), plan, 2));
      FT_VERIFY_OK(report);
      QVERIFY2(report->against->changed && report->against->p_value < 0.01, report->text.c_str());
      QVERIFY2(report->text.find("something is gone") != std::string::npos, report->text.c_str());
      QCOMPARE(report->against->effect, std::string("compact_metal"));
      FT_VERIFY_MATCH(near(*report->against->location_m, {1.3, 0.5, 0.3}, 0.15));
    }
  }

  /// What no smooth field is may still be none of placing.
  void whatScattersIsNotNothing() {
    const CalibrationTable before = recordedIn(gapScene(), gapPlan(), 1);
    CalibrationTable now = recordedIn(gapScene(), gapPlan(), 2);
    const auto quiet = since(before, now);
    FT_VERIFY_OK(quiet);
    QVERIFY2(!quiet->against->changed && quiet->verdict == GapVerdict::kNoGap, quiet->text.c_str());
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal_m(0.0, 0.03);
    for (Node& node : now.nodes)
      for (double& coordinate : node.tracker_from_sensor.position_m) coordinate += normal_m(generator);
    const auto report = since(before, now);
    FT_VERIFY_OK(report);
    QVERIFY2(report->against->changed && report->verdict == GapVerdict::kUnexplained, report->text.c_str());
    QVERIFY(report->against->p_value < 1e-3);
  }

  /// A sphere 9 cm from a corner of the grid takes that place off by half a metre, and the next ones by centimetres:
  /// carried there, or away.
  void whatBendsACornerIsAChange_data() {
    QTest::addColumn<bool>("is_gone");
    QTest::newRow("came") << false;
    QTest::newRow("went") << true;
  }
  void whatBendsACornerIsAChange() {
    QFETCH(bool, is_gone);
    simulation::Scene scene;
    scene.rig.tolerance_m = 0.0005;
    std::vector<PlannedPlace> plan = gapPlan({.counts = {5, 5, 4}, .pitch_m = 0.15});
    for (PlannedPlace& place : plan) place.reference_from_sensor.position_m += Eigen::Vector3d(0.3, -0.3, -0.2);
    const CalibrationTable without = recordedIn(scene, plan, 3);
    scene.effects = {effect("compact_metal", R"({"center_m": [0.95, 0.35, 0.3], "radius_m": 0.08})")};
    const CalibrationTable with = recordedIn(scene, plan, 4);
    const auto report = is_gone ? since(with, without) : since(without, with);
    FT_VERIFY_OK(report);
    QVERIFY2(report->against->changed && report->verdict != GapVerdict::kNoGap, report->text.c_str());
    QCOMPARE(report->against->effect, std::string("compact_metal"));
    QCOMPARE(report->text.find("Something is gone") == 0, is_gone);
    FT_VERIFY_MATCH(near(*report->against->location_m, {0.95, 0.35, 0.3}, 0.1));
  }

  /// The rig set down 4 cm beside and turned by 3 degrees: a finding, and no change of the field.
  void aRigSetDownAnewIsNoChange() {
    const simulation::Scene room = roomWith({effect("metal_plane", kFloorThen)});
    const CalibrationTable before = recordedIn(room, gapPlan(), 1);
    simulation::Scene moved = room;
    moved.reference_from_tracker =
        Pose{{0.04, 0.0, 0.0}, rotationFromVector({0.0, 0.0, 0.052})} * room.reference_from_tracker;
    CalibrationTable now = recordedIn(moved, gapPlan(), 2);
    const auto report = since(before, now);
    FT_VERIFY_OK(report);
    QVERIFY2(!report->against->changed, report->text.c_str());
    QVERIFY(std::any_of(report->findings.begin(), report->findings.end(), [](const recording::GapFinding& finding) {
      return finding.text.find("The whole rig stands") == 0;
    }));
  }

  void tellsWhereNothingWasKnown() {
    const CalibrationTable before = recordedIn(gapScene(), gapPlan(), 1);
    std::vector<PlannedPlace> far = otherPlaces();
    for (PlannedPlace& place : far) place.reference_from_sensor.position_m.x() += 1.5;
    const auto report = since(before, recordedIn(gapScene(), far, 2));
    QVERIFY(!report && report.error().code == ErrorCode::kTooFewNodes);
    QVERIFY(report.error().message.find("The earlier recording tells the field at") == 0);
  }
};

FIELDTRUE_TEST(ChangeTest)
#include "change_test.moc"
