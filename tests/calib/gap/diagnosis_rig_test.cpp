#include <QTest>

#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

/// What is wrong with the tracker's coils, the rig or the time, withheld from the diagnosis and strong, is named.
class DiagnosisRigTest : public QObject {
  Q_OBJECT
 private slots:
  void namesWhatWasWithheld_data() {
    QTest::addColumn<QByteArray>("effect");
    QTest::addColumn<QByteArray>("parameters");
    QTest::addColumn<bool>("turned");
    QTest::newRow("transmitter's gains") << QByteArray("coil_gain")
                                         << QByteArray(R"({"transmitter_gain": [0.02, -0.015, 0.01]})") << true;
    QTest::newRow("sensor's gains") << QByteArray("coil_gain")
                                    << QByteArray(R"({"receiver_gain": [0.02, -0.015, 0.01]})") << true;
    QTest::newRow("skew coils") << QByteArray("coil_nonorthogonality")
                                << QByteArray(R"({"transmitter_rad": [0.02, -0.015, 0.01]})") << true;
    QTest::newRow("finite coils") << QByteArray("finite_coil") << QByteArray("{}") << true;
    QTest::newRow("gain") << QByteArray("global_gain") << QByteArray(R"({"gain": 0.06})") << false;
    QTest::newRow("scales") << QByteArray("grid_scale") << QByteArray(R"({"scale": [0.02, -0.015, 0.01]})") << false;
    QTest::newRow("layers") << QByteArray("jig_layer_offset")
                            << QByteArray(
                                   R"({"axis": "z", "heights_m": [0.0, 0.2, 0.4], "offsets_m": [0.0, 0.012, -0.008]})")
                            << false;
    QTest::newRow("leaning rig") << QByteArray("jig_tilt") << QByteArray(R"({"shear_rad": [0.02, -0.015, 0.0]})")
                                 << false;
    QTest::newRow("drift") << QByteArray("gain_drift") << QByteArray(R"({"slope_per_s": 2e-4})") << false;
  }
  void namesWhatWasWithheld() {
    QFETCH(QByteArray, effect);
    QFETCH(QByteArray, parameters);
    QFETCH(bool, turned);
    GapPlan plan;
    plan.counts = turned ? std::array<int, 3>{3, 3, 3} : std::array<int, 3>{5, 4, 3};
    if (turned) plan.orientations = threeTurns();
    const Withheld made = withheldFrom(effect.toStdString(), parameters.toStdString(), plan);
    const auto report = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, effect.toStdString()));
  }

  /// A gain that rises, falls below where it was and rises again follows no formula; its course is told.
  void followsADriftThatWanders() {
    const std::vector<PlannedPlace> plan = gapPlan({.counts = {6, 5, 4}});
    simulation::Scene scene = gapScene();
    const double end_s = recordedIn(scene, plan).nodes.back().t_end_s.value();
    const std::vector<double> shares{0.0, 0.3, 0.6, 1.0}, gains{0.0, 0.05, -0.03, 0.04};
    nlohmann::json parameters{{"course_gains", gains}};
    for (const double share : shares) parameters["course_times_s"].push_back(share * end_s);
    scene.effects.push_back({"gain_drift", parameters});
    const auto report = diagnose(recordedIn(scene, plan, 2), nullptr, nullptr);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, "gain_drift"));
    QVERIFY2(report->remaining.fraction < 0.05, report->text.c_str());
    const nlohmann::json found = report->selected.front().scene_parameters;
    const auto times_s = found.at("course_times_s").get<std::vector<double>>();
    QVERIFY(times_s.size() > 4);
    for (std::size_t k = 0; k < times_s.size(); ++k) {
      const double share = times_s[k] / end_s;
      const std::size_t s = share < shares[1] ? 0 : share < shares[2] ? 1 : 2;
      const double gain = gains[s] + (gains[s + 1] - gains[s]) * (share - shares[s]) / (shares[s + 1] - shares[s]);
      // 1 mm of placing at 0.9 m is a third of a percent of gain; a stretch has fifteen rows, and rounds the corners.
      FT_VERIFY_MATCH(near(found.at("course_gains").at(k).get<double>(), gain, 0.008));
    }
  }

  /// Where the rig states the transmitter's place, what contradicts it is a finding.
  void namesWhatContradictsAStatedAlignment_data() {
    QTest::addColumn<QByteArray>("effect");
    QTest::addColumn<QByteArray>("parameters");
    QTest::newRow("transmitter") << QByteArray("transmitter_misalignment")
                                 << QByteArray(R"({"shift_m": [0.02, -0.01, 0.015], "turn_rad": [0.02, 0.03, -0.02]})");
    QTest::newRow("sensor") << QByteArray("sensor_offset")
                            << QByteArray(R"({"offset_m": [0.02, -0.01, 0.015], "turn_rad": [0.02, 0.03, -0.02]})");
  }
  void namesWhatContradictsAStatedAlignment() {
    QFETCH(QByteArray, effect);
    QFETCH(QByteArray, parameters);
    simulation::Scene believed = gapScene();
    believed.rig.alignment_known = true;
    believed.rig.alignment_tolerance_m = 0.001;
    believed.rig.alignment_tolerance_rad = 0.002;
    GapPlan plan;
    plan.counts = {3, 3, 3};
    plan.orientations = threeTurns();
    const Withheld made = withheldFrom(effect.toStdString(), parameters.toStdString(), plan, believed);
    const auto report = diagnose(made.table, nullptr, &made.believed);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, effect.toStdString()));
  }

  /// A tracker that reads 2 % long and a rig that is 2 % short are one and the same to positions and orientations.
  void saysWhatCannotBeTold() {
    const Withheld made = withheldFrom("global_gain", R"({"gain": 0.06})");
    const auto report = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(!report->selected.empty());
    const std::vector<std::string>& same = report->selected.front().equivalents;
    QVERIFY(std::count(same.begin(), same.end(), "global_gain") == 1 &&
            std::count(same.begin(), same.end(), "grid_scale") == 1);
    FT_VERIFY_MATCH(holdsAll(report->text, {"cannot tell"}));
  }
};

FIELDTRUE_TEST(DiagnosisRigTest)
#include "diagnosis_rig_test.moc"
