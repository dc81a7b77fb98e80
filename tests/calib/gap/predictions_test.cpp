#include <QTest>
#include <algorithm>
#include <cmath>

#include "calib/geometry/geometry.h"
#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

/// What a report foretells of taking a cause away, held against a recording that is made without it.
using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

/// The scene with all effects but one.
CalibrationTable recordedWithout(const std::string& effect, simulation::Scene scene,
                                 const std::vector<PlannedPlace>& plan, std::uint64_t seed) {
  std::erase_if(scene.effects, [&](const auto& one) { return one.id == effect; });
  return recordedIn(scene, plan, seed);
}

/// How far a place's reading is from its true position once the rig is aligned to all readings, by a rigid fit alone.
double gapAt_mm(const CalibrationTable& table, int node) {
  std::vector<Eigen::Vector3d> true_m, read_m;
  for (const Node& row : table.nodes) {
    true_m.push_back(row.reference_from_sensor.position_m);
    read_m.push_back(row.tracker_from_sensor.position_m);
  }
  const Pose aligned = fitRigid(true_m, read_m).value();
  const auto row = std::find_if(table.nodes.begin(), table.nodes.end(), [&](const Node& n) { return n.node == node; });
  return 1e3 * (aligned * row->reference_from_sensor.position_m - row->tracker_from_sensor.position_m).norm();
}

}  // namespace

class PredictionsTest : public QObject {
  Q_OBJECT
 private slots:
  void theyComeTrue_data() {
    QTest::addColumn<QString>("effect");
    QTest::addColumn<QString>("parameters");
    QTest::addColumn<QString>("stays");
    const QString body = R"({"center_m": [1.5, -0.5, -0.3], "radius_m": 0.1})";
    const QString floor = R"({"distance_m": 1.0})";
    QTest::newRow("a body") << "compact_metal" << body << "";
    QTest::newRow("a floor that bends strongly") << "metal_plane" << floor << "";
    QTest::newRow("a body beside a rig of a wrong scale")
        << "compact_metal" << body << R"({"scale": [0.02, 0.02, 0.02]})";
  }
  void theyComeTrue() {
    QFETCH(QString, effect);
    QFETCH(QString, parameters);
    QFETCH(QString, stays);
    simulation::Scene actual = gapScene();
    const std::string id = effect.toStdString();
    actual.effects.push_back({id, nlohmann::json::parse(parameters.toStdString())});
    if (!stays.isEmpty()) actual.effects.push_back({"grid_scale", nlohmann::json::parse(stays.toStdString())});
    const auto plan = gapPlan();
    const auto report = diagnose(recordedIn(actual, plan), nullptr, nullptr);
    FT_VERIFY_OK(report);
    int told = 0;
    for (const Prediction& prediction : report->predictions) {
      if (prediction.effect != id) continue;
      ++told;
      for (const std::uint64_t seed : {2U, 3U, 4U}) {
        const double then_mm = gapAt_mm(recordedWithout(id, actual, plan, seed), prediction.node);
        const std::string seen = report->text + " " + std::to_string(prediction.now_mm) + " to " +
                                 std::to_string(prediction.then_mm) + " +- " + std::to_string(prediction.then_sd_mm) +
                                 ", came to " + std::to_string(then_mm);
        QVERIFY2(std::abs(then_mm - prediction.then_mm) < 3.0 * prediction.then_sd_mm, seen.c_str());
      }
      QVERIFY(prediction.then_sd_mm < 0.3 * prediction.now_mm);
      QVERIFY(prediction.now_mm - prediction.then_mm > prediction.then_sd_mm);
    }
    QVERIFY2(told > 0, report->text.c_str());
  }
};

FIELDTRUE_TEST(PredictionsTest)
#include "predictions_test.moc"
