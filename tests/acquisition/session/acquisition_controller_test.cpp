#include "acquisition/session/acquisition_controller.h"

#include <QElapsedTimer>
#include <QTest>
#include <nlohmann/json.hpp>
#include <random>

#include "acquisition/plan/place_state.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;
using testing::kRate_hz;
using testing::planOf;

namespace {

const Eigen::Vector3d kElsewhere_m{0.0, 0.36, 0.48};  ///< 0.6 m long.

}  // namespace

class AcquisitionControllerTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void wholePlanByHand() { wholePlan(false); }
  void wholePlanAutomatically() { wholePlan(true); }

  void tablesEqualAnIndependentAverage() {
    Bench bench(folder_.newPath(), planOf({2, 2, 2}));
    while (bench.n_finished == 0) bench.takeHere();
    bench.readTables();
    QCOMPARE(bench.table.nodes.size(), std::size_t{8});
    for (const Node& node : bench.table.nodes) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int n = 0;
      for (const SampleRow& row : bench.samples.rows) {
        if (row.node != node.node) continue;
        sum += row.sample.tracker_from_sensor.position_m;
        ++n;
      }
      QCOMPARE(n, 60);
      QCOMPARE(node.n_used, 60);
      FT_VERIFY_MATCH(testing::near(node.tracker_from_sensor.position_m, sum / n, 1e-12));
      const Pose expected = inverse(bench.tracker->reference_from_tracker) * node.reference_from_sensor;
      FT_VERIFY_MATCH(testing::near(node.tracker_from_sensor, expected, 1e-4, 1e-6));
    }
  }

  void aStandIsNeverTakenTwice() {
    Bench bench(folder_.newPath());
    bench.controller.setAutomatic(true);
    bench.tracker->carryTo(bench.placePose(0));
    bench.tracker->stand(20.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.controller.status().reason, QString("move the sensor here; or press space"));
    bench.tracker->true_pose.position_m.x() += 0.003;
    bench.tracker->stand(5.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
    const Pose lifted{bench.tracker->true_pose.position_m + Eigen::Vector3d(0, 0, 0.03),
                      Eigen::Quaterniond::Identity()};
    bench.tracker->carryTo(lifted, 0.3);
    bench.tracker->carryTo(bench.placePose(1));
    bench.tracker->stand(3.0);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
  }

  void aSensorFoundStandingWaits() {
    Bench bench(folder_.newPath());
    bench.tracker->true_pose = bench.placePose(0);
    bench.controller.setAutomatic(true);
    bench.tracker->stand(2.5);
    QVERIFY(bench.stored.empty());
    bench.tracker->stand(2.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
  }

  void knownFrameTakesOnlyNearThePlace() {
    Bench bench(folder_.newPath(), planOf({2, 2, 3}));
    bench.controller.setAutomatic(true);
    for (int i = 0; i < 6; ++i) {
      bench.tracker->carryTo(bench.placePose(*bench.controller.status().current));
      bench.tracker->stand(2.0);
    }
    QCOMPARE(bench.stored.size(), std::size_t{6});
    const AcquisitionStatus status = bench.controller.status();
    QVERIFY(status.reference_known);
    FT_VERIFY_MATCH(testing::near(status.reference_from_tracker, bench.tracker->reference_from_tracker, 1e-3, 1e-2));
    Pose wrong = bench.placePose(*status.current);
    wrong.position_m += Eigen::Vector3d(0.25, 0.0, 0.0);
    bench.tracker->carryTo(wrong);
    bench.tracker->stand(10.0);
    QCOMPARE(bench.stored.size(), std::size_t{6});
    QCOMPARE(bench.controller.status().reason, QString("still, but not at the place: move it here; or press space"));
    bench.tracker->carryTo(bench.placePose(*status.current));
    bench.tracker->stand(1.5);
    QCOMPARE(bench.stored.size(), std::size_t{7});
  }

  void aSensorElsewhereIsRefusedOnceAndThenMarked() {
    Bench bench(folder_.newPath());
    for (int i = 0; i < 6; ++i) bench.takeHere();
    const std::size_t place = *bench.controller.status().current;
    Pose wrong = bench.placePose(place);
    wrong.position_m += kElsewhere_m;
    bench.tracker->carryTo(wrong);
    bench.tracker->stand(0.5);
    bench.controller.take();
    bench.tracker->stand(0.6);
    AcquisitionStatus status = bench.controller.status();
    QCOMPARE(bench.refused, std::vector<int>{static_cast<int>(place)});
    QCOMPARE(bench.stored.size(), std::size_t{6});
    QVERIFY(status.refused && status.away && status.distance_known && std::abs(*status.distance_m - 0.6) < 0.01);

    bench.controller.take();
    bench.tracker->stand(0.6);
    status = bench.controller.status();
    QCOMPARE(bench.refused.size(), std::size_t{1});
    QCOMPARE(bench.stored.size(), std::size_t{7});
    QCOMPARE(bench.suspicions.back(), QString("taken away from its place, as asked"));
    QCOMPARE(status.recorded->misfits.size(), std::size_t{1});
    QVERIFY(status.recorded->misfits[0].place == place && std::abs(status.recorded->misfits[0].off_m - 0.6) < 0.01);
    QVERIFY(status.recorded->states[place] == PlaceState::kSuspicious);

    bench.controller.goTo(static_cast<int>(place));
    bench.takeHere();
    status = bench.controller.status();
    QVERIFY(status.recorded->misfits.empty() && status.recorded->states[place] == PlaceState::kDone);
  }

  void aRefusedTakeIsForgottenWhereTheSensorComesHome() {
    Bench bench(folder_.newPath());
    for (int i = 0; i < 6; ++i) bench.takeHere();
    const Pose right = bench.placePose(*bench.controller.status().current);
    bench.tracker->setDownAt({right.position_m + kElsewhere_m, right.orientation});
    bench.controller.take();
    QVERIFY(bench.controller.status().refused);
    bench.tracker->carryTo(right);
    QVERIFY(!bench.controller.status().refused);
    bench.controller.take();
    bench.tracker->stand(1.2);
    QCOMPARE(bench.stored.size(), std::size_t{7});
    QCOMPARE(bench.suspicions.back(), QString());
  }

  void anEarlierWrongTakeIsNamedByTheOthers() {
    Bench bench(folder_.newPath());
    for (int i = 0; i < 8; ++i) {
      Pose place = bench.placePose(*bench.controller.status().current);
      if (i == 1) place.position_m += kElsewhere_m;
      bench.tracker->setDownAt(place);
      bench.controller.take();
      bench.tracker->stand(0.51);
    }
    QVERIFY(bench.refused.empty());
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(status.recorded->misfits.size(), std::size_t{1});
    QCOMPARE(status.recorded->misfits[0].place, std::size_t{1});
    QVERIFY(std::abs(status.recorded->misfits[0].off_m - 0.6) < 0.01);
  }

  void aSessionBeginsByHand() {
    Bench bench(folder_.newPath());
    bench.controller.setAutomatic(true);
    bench.controller.openSession(folder_.newPath(), QString::fromStdString(toJson(planOf({2, 2, 2})).dump()));
    QVERIFY(!bench.controller.status().automatic);
    bench.tracker->carryTo(bench.placePose(0));
    bench.tracker->stand(5.0);
    QVERIFY(bench.stored.empty());
  }

  void retakeSkipUndoRedo() {
    Bench bench(folder_.newPath());
    for (int i = 0; i < 3; ++i) bench.takeHere();
    bench.controller.skip();
    auto status = bench.controller.status();
    QVERIFY(status.recorded->states[3] == PlaceState::kSkipped && status.current == 4u &&
            status.recorded->n_skipped == 1);

    bench.controller.goTo(1);
    status = bench.controller.status();
    QVERIFY(status.current == 1u && status.current_is_retake);
    bench.takeHere();
    QCOMPARE(bench.stored, (std::vector<int>{0, 1, 2, 1}));
    QVERIFY(bench.controller.status().current == 4u);

    bench.controller.undo();
    status = bench.controller.status();
    QVERIFY2(status.current == 1u && status.recorded->states[1] == PlaceState::kDone, "the take before is back");
    bench.controller.undo();
    QVERIFY(bench.controller.status().current == 3u &&
            bench.controller.status().recorded->states[3] == PlaceState::kPlanned);
    bench.controller.undo();
    status = bench.controller.status();
    QVERIFY(status.current == 2u && status.recorded->states[2] == PlaceState::kPlanned &&
            status.recorded->n_done == 2 && status.recorded->can_redo);
    for (int i = 0; i < 3; ++i) bench.controller.redo();
    status = bench.controller.status();
    QVERIFY(status.recorded->n_done == 3 && status.recorded->n_skipped == 1 && status.current == 4u &&
            !status.recorded->can_redo);
    for (int i = 0; i < 5; ++i) bench.controller.undo();
    QVERIFY(!bench.controller.status().recorded->can_undo && bench.controller.status().recorded->n_done == 0);
    bench.controller.undo();
    QVERIFY(bench.failures.isEmpty() && bench.take_failures.isEmpty());
    QVERIFY2((bench.tracker->guided.back().position_m - bench.placePose(0).position_m).norm() == 0.0,
             "the device hears of every change of place");
  }

  void aRetakeCanBeLeft() {
    Bench bench(folder_.newPath());
    for (int i = 0; i < 2; ++i) bench.takeHere();
    bench.controller.goTo(0);
    QVERIFY(bench.controller.status().current_is_retake);
    bench.controller.cancelTake();
    auto status = bench.controller.status();
    QVERIFY(status.current == 2u && !status.current_is_retake);
    QVERIFY(status.recorded->states[0] == PlaceState::kDone);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
    // A place that waits for its first take stays where it is; so does one whose take is stopped.
    bench.controller.goTo(5);
    bench.controller.cancelTake();
    QVERIFY(bench.controller.status().current == 5u);
    bench.controller.goTo(1);
    bench.tracker->setDownAt(bench.placePose(1));
    bench.controller.take();
    bench.tracker->stand(0.1);
    QVERIFY(bench.controller.status().take == TakeState::kCollecting);
    bench.controller.cancelTake();
    QVERIFY(bench.controller.status().current == 1u);
    bench.controller.cancelTake();
    QVERIFY(bench.controller.status().current == 2u);
  }

  void goToAndBack() {
    Bench bench(folder_.newPath());
    bench.takeHere();
    bench.controller.goTo(5);
    QVERIFY(bench.controller.status().current == 5u);
    bench.controller.goTo(-1);
    QVERIFY(bench.controller.status().current == 1u);
    bench.controller.goTo(1000);
    QVERIFY(bench.controller.status().current == 1u);
  }

  void deviceLostInMidNodeAndBack() {
    Bench bench(folder_.newPath());
    bench.takeHere();
    bench.tracker->setDownAt(bench.placePose(1));
    bench.controller.take();
    bench.tracker->stand(0.25);
    QCOMPARE(bench.controller.status().collected, 30);
    bench.tracker->lose();
    QCOMPARE(bench.take_failures.size(), 1);
    QVERIFY2(bench.take_failures[0].contains("The cable was pulled."), qPrintable(bench.take_failures[0]));
    QVERIFY(bench.take_failures[0].startsWith("B1, pipe 1: "));
    auto status = bench.controller.status();
    QVERIFY(status.attention && status.take == TakeState::kFailed && status.current == 1u &&
            status.recorded->n_done == 1);
    bench.readTables();
    QCOMPARE(bench.readingsAtPlaces(), std::size_t{60});
    bench.controller.take();
    QCOMPARE(bench.take_failures.size(), 2);
    QVERIFY(bench.take_failures[1].contains("not connected"));

    const std::size_t n_guided = bench.tracker->guided.size();
    bench.tracker->comeBack();
    QCOMPARE(bench.tracker->guided.size(), n_guided + 1);
    bench.controller.take();
    bench.tracker->stand(1.2);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
    QVERIFY2(*bench.nodes[1].t_start_s > *bench.nodes[0].t_end_s,
             "the session's clock goes on when the tracker's does not");
    QVERIFY(bench.failures.isEmpty());
  }

  void deviceLostBetweenTakesIsSaidOnce() {
    Bench bench(folder_.newPath());
    bench.tracker->lose();
    bench.tracker->lose();
    QCOMPARE(bench.device_failures, QStringList{"The cable was pulled (trying again by itself)"});
    QCOMPARE(bench.controller.status().device_text, bench.device_failures[0]);
    QCOMPARE(bench.n_back, 0);
    // The controller starts it again after a while; the fake one then runs at once.
    QTRY_COMPARE(bench.n_back, 1);
    QVERIFY(bench.controller.status().device == DeviceState::kRunning);
    QVERIFY(bench.take_failures.isEmpty());
  }

  void aLostTrackerIsNotStartedAgainWhereNobodyWantsIt() {
    Bench bench(folder_.newPath());
    bench.controller.setReconnects(false);
    bench.tracker->lose();
    QCOMPARE(bench.device_failures, QStringList{"The cable was pulled."});
    QTest::qWait(1000);
    QVERIFY(bench.controller.status().device == DeviceState::kFailed);
    QCOMPARE(bench.n_back, 0);
  }

  void movedTakeStartsOverAndIsSuspicious() {
    Bench bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.25);
    bench.tracker->true_pose.position_m.z() += 0.005;
    bench.tracker->stand(0.1);
    QVERIFY(bench.controller.status().reason.startsWith("retaking: moved "));
    QVERIFY(bench.controller.status().attention);
    bench.tracker->stand(1.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.suspicions, QStringList{"moved once while sampling"});
    QVERIFY(bench.controller.status().recorded->states[0] == PlaceState::kSuspicious);
    QCOMPARE(bench.nodes[0].n_used, 60);
  }

  void noSignalFailsInWords() {
    Bench bench(folder_.newPath());
    bench.controller.setAutomatic(true);
    bench.tracker->stand(1.0, "k");
    QCOMPARE(bench.controller.status().reason, QString("no signal: the tracker reports error k"));
    QVERIFY(bench.controller.status().attention);
    bench.tracker->stand(30.0, "k");
    QCOMPARE(bench.take_failures, QStringList{"A1, pipe 1: no signal: the tracker reports error k"});
  }

  void badSessionsAreToldAndTheOpenOneStays() {
    const QString path = folder_.newPath();
    Bench bench(path);
    bench.controller.openSession(folder_.filePath("none.fieldtrue"), {});
    QCOMPARE(bench.failures.size(), 1);
    QVERIFY(bench.failures[0].contains("no such session file"));
    bench.controller.openSession(folder_.newPath(), "{\"grid\": \"5x5@1\"}");
    QCOMPARE(bench.failures.size(), 2);
    QVERIFY(bench.failures[1].contains("expected NXxNYxNZ"));
    QCOMPARE(bench.controller.status().session->path, path);
    bench.controller.openSession(path, {});
    QCOMPARE(bench.failures.size(), 2);
    bench.controller.connectDevice("nosuch:thing", {});
    QCOMPARE(bench.device_failures.size(), 1);
    bench.controller.connectDevice("simulated", folder_.filePath("none.scene.json"));
    QCOMPARE(bench.device_failures.size(), 2);
  }

  void takingWithoutASessionIsToldKindly() {
    AcquisitionController controller;
    QStringList told;
    connect(&controller, &AcquisitionController::takeFailed, this, [&](const QString& text) { told << text; });
    controller.take();
    QVERIFY(told.size() == 1 && told[0].startsWith("There is no session"));
    controller.skip();
    controller.undo();
    controller.redo();
    controller.goTo(3);
    controller.requestTables();
    controller.closeSession();
    controller.disconnectDevice();
  }

  void statusComesAtMostThirtyTimesASecond() {
    Bench bench(folder_.newPath());
    int n_status = 0;
    connect(&bench.controller, &AcquisitionController::statusChanged, this, [&] { ++n_status; });
    QElapsedTimer timer;
    timer.start();
    while (timer.elapsed() < 1000) {
      bench.tracker->stand(0.02);
      QCoreApplication::processEvents();
    }
    const double seconds = static_cast<double>(timer.elapsed()) / 1000.0;
    QVERIFY2(n_status >= 5 && n_status <= 30.0 * seconds + 1,
             qPrintable(QString("%1 in %2 s").arg(n_status).arg(seconds)));
  }

  void aTakeThatFallsShortIsMarked() {
    Bench bench(folder_.newPath());
    bench.controller.setTakeLength({TakeLength::Until::kSeconds, 0.5});
    bench.takeHere();
    QCOMPARE(bench.nodes.at(0).n_used, 61);  // Half a second at 120 a second, both ends.
    QCOMPARE(bench.suspicions, QStringList{""});
    // Noise of 0.1 mm, evenly: an SD of 0.1 mm in 3-D, which 3600 readings tell to 1.7 um at best.
    bench.controller.setTakeLength({TakeLength::Until::kStandardError, 1e-6});
    bench.tracker->setDownAt(bench.placePose(1));
    bench.controller.take();
    bench.tracker->stand(31.0);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
    QVERIFY2(bench.suspicions[1].contains(", not to 0.001 mm, after 30 s"), qPrintable(bench.suspicions[1]));
    QVERIFY(bench.controller.status().recorded->states[1] == PlaceState::kSuspicious);
  }

  void samplesPerNodeIsASetting() {
    Bench bench(folder_.newPath());
    bench.controller.setTakeLength({TakeLength::Until::kSamples, 25});
    bench.takeHere();
    QCOMPARE(bench.nodes.at(0).n_used, 25);
    bench.controller.setTakeLength({TakeLength::Until::kSamples, 0});
    QCOMPARE(bench.failures.size(), 1);
  }

  void eachSessionKeepsTheLengthOfItsTakes() {
    const QString first = folder_.newPath(), second = folder_.newPath();
    Bench bench(first);
    TakeLength known;
    connect(&bench.controller, &AcquisitionController::takeLengthKnown, this,
            [&known](const TakeLength& length) { known = length; });
    const TakeLength half_second{TakeLength::Until::kSeconds, 0.5};
    bench.controller.setTakeLength(half_second);
    bench.controller.setTakeLength({TakeLength::Until::kSamples, 0});
    QCOMPARE(known, half_second);
    const QString plan = QString::fromStdString(toJson(planOf({2, 1, 1})).dump());
    bench.controller.openSession(second, plan);
    QCOMPARE(known, TakeLength());
    bench.takeHere();
    QCOMPARE(bench.nodes.back().n_used, 60);
    bench.controller.openSession(first, {});
    QCOMPARE(known, half_second);
    bench.takeHere();
    QCOMPARE(bench.nodes.back().n_used, 61);
    // One that cannot be made changes nothing of the session that stays open.
    bench.controller.openSession(second, plan, TakeLength{TakeLength::Until::kSamples, 5});
    bench.takeHere();
    QCOMPARE(bench.nodes.back().n_used, 61);
    bench.controller.openSession(folder_.newPath(), plan, TakeLength{TakeLength::Until::kSamples, 25});
    bench.takeHere();
    QCOMPARE(bench.nodes.back().n_used, 25);
  }

 private:
  void wholePlan(bool automatic) {
    Bench bench(folder_.newPath());
    bench.controller.setAutomatic(automatic);
    std::vector<int> expected;
    for (int place = 0; place < 18; ++place) {
      expected.push_back(place);
      QVERIFY(bench.controller.status().current == std::size_t(place));
      const Pose& asked = bench.tracker->guided.back();
      FT_VERIFY_MATCH(testing::sameBits(asked, bench.placePose(std::size_t(place))));
      if (automatic) {
        bench.tracker->carryTo(asked);
        bench.tracker->stand(2.5);
      } else {
        bench.takeHere();
      }
    }
    QCOMPARE(bench.stored, expected);
    QCOMPARE(bench.n_finished, 1);
    QVERIFY(!bench.controller.status().current);
    QCOMPARE(bench.controller.status().recorded->n_done, std::size_t{18});
    QVERIFY2(bench.failures.isEmpty() && bench.take_failures.isEmpty(), qPrintable(bench.take_failures.join(' ')));
    bench.readTables();
    QCOMPARE(bench.table.nodes.size(), std::size_t{18});
    QCOMPARE(bench.readingsAtPlaces(), std::size_t{18} * 60);
    for (const Node& node : bench.nodes) {
      QCOMPARE(node.n_used, 60);
      const Pose expected_pose = inverse(bench.tracker->reference_from_tracker) * node.reference_from_sensor;
      FT_VERIFY_MATCH(testing::near(node.tracker_from_sensor.position_m, expected_pose.position_m, 1e-4));
    }
    if (automatic) {
      bench.tracker->stand(5.0);
      QCOMPARE(bench.stored.size(), std::size_t{18});
    }
  }
};

FIELDTRUE_TEST(AcquisitionControllerTest)
#include "acquisition_controller_test.moc"
