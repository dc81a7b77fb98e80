#include <QFile>
#include <QTest>
#include <algorithm>
#include <set>
#include <tuple>

#include "acquisition/protocols/sample_status.h"
#include "acquisition/session/imported_session.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/acquisition/session/two_sensors.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A tracker of several sensors on one jig, each with its own place in the holder and its own noise: every take is of
/// all that are recorded.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

class SeveralSensorsTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void everyRowIsTheMeanOfItsSensor() {
    TwoSensors bench(folder_.newPath());
    for (int place = 0; place < 4; ++place) bench.takeHere();
    bench.readTables();
    QCOMPARE(bench.n_finished, 1);
    QCOMPARE(bench.table.nodes.size(), std::size_t{8});
    QCOMPARE(bench.nodes.size(), std::size_t{8});
    std::set<std::tuple<int, int, int>> keys;
    for (const Node& node : bench.table.nodes) {
      keys.insert({node.node, node.sensor, node.visit});
      Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
      double first_s = 1e9, last_s = -1e9;
      int n = 0;
      for (const SampleRow& row : bench.samples.rows) {
        if (row.node != node.node || row.visit != node.visit || row.sample.sensor != node.sensor) continue;
        sum_m += row.sample.tracker_from_sensor.position_m;
        first_s = std::min(first_s, row.sample.time_s);
        last_s = std::max(last_s, row.sample.time_s);
        ++n;
      }
      QCOMPARE(n, 60);
      QCOMPARE(node.n_used + node.n_rejected, 60);
      FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, sum_m / n, 1e-12));
      QCOMPARE(node.t_start_s.value(), first_s);
      QCOMPARE(node.t_end_s.value(), last_s);
      // The place is the rig's, whichever sensor: each has a mounting of its own, which is fitted.
      const FakeTracker::OnJig& sensor = bench.tracker->on_jig[node.sensor];
      const Pose stood = inverse(bench.tracker->reference_from_tracker) * node.reference_from_sensor;
      FT_VERIFY_MATCH(near(node.tracker_from_sensor, stood * sensor.jig_from_sensor, 2e-4, 1e-6));
      // A uniform noise's SD is its bound over sqrt(3), on each of three axes: the 3-D SD is the bound.
      const double sd_m = std::sqrt(node.covariance_m2->trace());
      QVERIFY2(sd_m > 0.7 * sensor.noise_m && sd_m < 1.3 * sensor.noise_m, qPrintable(QString::number(sd_m)));
    }
    QCOMPARE(keys.size(), std::size_t{8});
  }

  void theLeadingOneIsTheLowestAndIsShown() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->stand(0.6);
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    QCOMPARE(status.reporting, Numbers({0, 1}));
    QCOMPARE(status.live->sensor, 0);
    QVERIFY(!status.takes_settle_sensors && status.missing.empty());
    QVERIFY2(std::abs(status.rate_hz - kRate_hz) < 1.0, "of one sensor, not of all together");
    bench.controller.take();
    bench.tracker->stand(0.2);
    for (const SensorProgress& one : bench.controller.status().sensors) {
      QVERIFY(!one.silent);
      QCOMPARE(one.collected, 24);
      QCOMPARE(one.wanted, 60);
    }
  }

  void takesByItselfAreOfAll() {
    TwoSensors bench(folder_.newPath());
    bench.controller.setAutomatic(true);
    for (std::size_t place = 0; place < 4; ++place) {
      bench.tracker->carryTo(bench.placePose(place));
      bench.tracker->stand(4.5);
    }
    QCOMPARE(bench.stored, std::vector<int>({0, 1, 2, 3}));
    QCOMPARE(bench.sensorsOfTable(), Numbers({0, 1}));
    QCOMPARE(bench.table.nodes.size(), std::size_t{8});
  }

  void oneThatFallsSilentEndsTheTakeAndIsNamed() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.tracker->on_jig[1].is_plugged = false;
    bench.tracker->stand(2.5);
    AcquisitionStatus status = bench.controller.status();
    QCOMPARE(status.take, TakeState::kCollecting);
    QVERIFY(status.attention && status.sensors[1].silent && !status.sensors[0].silent);
    QCOMPARE(status.reason, QString("sensor 1 does not report: plug it in again"));
    bench.tracker->stand(28.0);
    QCOMPARE(bench.take_failures.size(), 1);
    FT_VERIFY_MATCH(holdsAll(bench.take_failures[0].toStdString(), {"A1", "sensor 1: silent", "24 of 60"}));
    QVERIFY(bench.nodes.empty());
    QCOMPARE(bench.controller.status().take, TakeState::kFailed);
    // Nothing is lost of what was read, and nothing of it counts.
    bench.readTables();
    QVERIFY(bench.table.nodes.empty());
    const auto of_second = [](const SampleRow& row) {
      return row.node < 0 && row.sample.status.starts_with("cancelled") && row.sample.sensor == 1;
    };
    QCOMPARE(std::count_if(bench.samples.rows.begin(), bench.samples.rows.end(), of_second), 24);

    // Asked for again it is refused at once, by space bar and by itself, until the sensor is back.
    bench.controller.take();
    QCOMPARE(bench.take_failures.size(), 2);
    FT_VERIFY_MATCH(holdsAll(bench.take_failures[1].toStdString(), {"sensor 1 does not report"}));
    bench.controller.setAutomatic(true);
    bench.tracker->stand(8.0);
    QVERIFY(bench.controller.status().take != TakeState::kCollecting && bench.nodes.empty());
    bench.tracker->on_jig[1].is_plugged = true;
    bench.tracker->stand(8.0);
    QCOMPARE(bench.nodes.size(), std::size_t{2});
  }

  void oneThatIsUnpluggedDoesNotReport() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->stand(0.5);
    bench.tracker->on_jig[1].is_plugged = false;
    for (int n = 0; n < 3.0 * kRate_hz; ++n) {
      bench.tracker->send(bench.tracker->true_pose);
      const double time_s = bench.controller.status().live->time_s;
      emit bench.tracker->samplesReceived({{time_s, 1, {}, kStatusUnplugged}, {time_s, 2, {}, kStatusUnplugged}});
    }
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    QCOMPARE(status.reporting, Numbers({0, 1}));
    QCOMPARE(status.reason, QString("sensor 1 does not report: plug it in again"));
  }

  void theLeadingOneMayFallSilentToo() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.tracker->on_jig[0].is_plugged = false;
    bench.tracker->stand(31.0);
    QCOMPARE(bench.take_failures.size(), 1);
    FT_VERIFY_MATCH(holdsAll(bench.take_failures[0].toStdString(), {"sensor 0: silent", "24 of 60"}));
    QVERIFY(bench.controller.status().sensors[0].silent);
  }

  void motionStartsAllOver() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.3);
    bench.tracker->true_pose.position_m.x() += 0.003;
    bench.tracker->stand(1.2);
    QCOMPARE(bench.nodes.size(), std::size_t{2});
    FT_VERIFY_MATCH(holdsAll(bench.suspicions[0].toStdString(), {"sensor 0: moved once while sampling"}));
    for (const Node& node : bench.nodes) {
      const Pose stood = inverse(bench.tracker->reference_from_tracker) * bench.tracker->true_pose;
      FT_VERIFY_MATCH(
          near(node.tracker_from_sensor, stood * bench.tracker->on_jig[node.sensor].jig_from_sensor, 2e-4, 1e-6));
    }
  }

  void oneThatHasEnoughGoesOnWatching() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->on_jig[1].every = 4;
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    // Sensor 0 has its 60 readings after half a second, sensor 1 after two.
    bench.tracker->stand(1.0);
    QCOMPARE(bench.controller.status().sensors[0].collected, 60);
    bench.tracker->on_jig[0].jig_from_sensor.position_m.x() += 0.003;
    bench.tracker->stand(1.1);
    QVERIFY2(bench.nodes.empty(), "what the sensor saw of the slip started all over");
    bench.tracker->stand(1.6);
    QCOMPARE(bench.nodes.size(), std::size_t{2});
    FT_VERIFY_MATCH(holdsAll(bench.suspicions[0].toStdString(), {"sensor 0: moved once while sampling"}));
    const Pose stood = inverse(bench.tracker->reference_from_tracker) * bench.tracker->true_pose;
    for (const Node& node : bench.nodes) {
      QCOMPARE(node.n_used + node.n_rejected, 60);
      FT_VERIFY_MATCH(
          near(node.tracker_from_sensor, stood * bench.tracker->on_jig[node.sensor].jig_from_sensor, 2e-4, 1e-6));
    }
  }

  void slowlyCarriedIsNotTakenByItself() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->rate_hz = 30.0;
    for (int sensor = 0; sensor < 4; ++sensor) {
      bench.tracker->on_jig[sensor].jig_from_sensor.position_m.y() = 0.04 * sensor;
      bench.tracker->on_jig[sensor].noise_m = 5e-4;  // Uniform: an SD of 0.3 mm along each axis.
    }
    bench.controller.setAutomatic(true);
    Pose before = bench.placePose(0);
    before.position_m.y() -= 0.2;
    bench.tracker->carryTo(before);
    bench.tracker->carryTo(bench.placePose(0), 20.0);
    QVERIFY(bench.nodes.empty() && bench.controller.status().take == TakeState::kIdle);
    // It rests 0.7 s by a window of 0.5 s, and two seconds are sampled.
    bench.tracker->stand(0.5 + 0.7 + 2.0 + 0.2);
    QCOMPARE(bench.nodes.size(), std::size_t{4});
    QCOMPARE(bench.suspicions[0], QString());
  }

  void whatIsSuspiciousIsToldOfItsSensor() {
    TwoSensors bench(folder_.newPath(), planOf({3, 2, 1}));
    for (int place = 0; place < 4; ++place) bench.takeHere();
    bench.tracker->on_jig[1].noise_m = 4e-3;
    bench.takeHere();
    QCOMPARE(bench.suspicions.size(), 5);
    for (int place = 0; place < 4; ++place) QCOMPARE(bench.suspicions[place], QString());
    FT_VERIFY_MATCH(holdsAll(bench.suspicions[4].toStdString(), {"sensor 1: SD"}));
    QVERIFY(!bench.suspicions[4].contains("sensor 0"));
  }

  void oneThatDoesNotRideOnTheJigIsTold() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->on_jig[2] = kThird;
    bench.tracker->on_jig[2].lies_in_room = true;
    for (int place = 0; place < 4; ++place) bench.takeHere();
    QCOMPARE(bench.suspicions.size(), 4);
    QCOMPARE(bench.suspicions[0], QString());
    for (int place = 1; place < 4; ++place) {
      FT_VERIFY_MATCH(holdsAll(bench.suspicions[place].toStdString(), {"sensor 2: was not carried with the jig"}));
      QVERIFY(!bench.suspicions[place].contains("sensor 1"));
    }
  }

  void retakeUndoAndSkipAreOfTheWholeTake() {
    TwoSensors bench(folder_.newPath());
    bench.takeHere();
    bench.takeHere();
    bench.readTables();
    const std::vector<Node> before = bench.table.nodes;
    QCOMPARE(before.size(), std::size_t{4});
    bench.controller.goTo(0);
    bench.tracker->carryTo(bench.placePose(0));
    bench.tracker->true_pose.position_m.z() += 0.002;
    bench.controller.take();
    bench.tracker->stand(1.2);
    bench.readTables();
    QCOMPARE(bench.table.nodes.size(), std::size_t{4});
    QCOMPARE(bench.readingsAtPlaces(), std::size_t{240});
    for (std::size_t row = 0; row < 2; ++row) {
      QCOMPARE(bench.table.nodes[row].sensor, before[row].sensor);
      QVERIFY(*bench.table.nodes[row].t_start_s > *before[row].t_end_s);
    }
    bench.controller.undo();
    bench.readTables();
    QCOMPARE(bench.table.nodes.size(), std::size_t{4});
    for (std::size_t row = 0; row < 4; ++row)
      FT_VERIFY_MATCH(sameBits(bench.table.nodes[row].tracker_from_sensor, before[row].tracker_from_sensor));
    bench.controller.goTo(0);
    bench.controller.skip();
    bench.readTables();
    for (std::size_t row = 0; row < 4; ++row) QCOMPARE(bench.table.nodes[row].role == NodeRole::kSkipped, row < 2);
    bench.controller.undo();
    bench.controller.undo();
    bench.controller.undo();
    bench.readTables();
    QVERIFY(bench.table.nodes.empty());
  }

  void aDiskThatIsFullKeepsNothingOfIt() {
    const QString path = folder_.newPath();
    auto store = SessionStore::create(path, smallPlan(), {});
    FT_VERIFY_OK(store);
    std::vector<Sample> first = samplesOf(1), second = samplesOf(2);
    for (Sample& sample : second) sample.sensor = 2;
    const std::vector<SensorTake> take{{first, averageSamples(first).value()},
                                       {second, averageSamples(second).value()}};
    FT_VERIFY_OK(store->storeTake(0, take, {}));
    const auto whole = store->sampleTable();
    FT_VERIFY_OK(store->limitSize(QFile(path).size() + 24 * 1024));
    int stored = 1;
    while (store->storeTake(static_cast<std::size_t>(stored), take, {})) ++stored;
    QVERIFY(stored < 12);
    const auto table = store->nodeTable();
    FT_VERIFY_OK(table);
    QCOMPARE(table->nodes.size(), static_cast<std::size_t>(2 * stored));
    QCOMPARE(store->sampleTable()->rows.size(), static_cast<std::size_t>(stored) * 2 * kSamples);
    QVERIFY(store->nodes(static_cast<std::size_t>(stored))->empty());
  }

  void theStoreGivesBackWhatEachRecorded() {
    const QString path = folder_.newPath();
    std::vector<Sample> first = samplesOf(1), second = samplesOf(2);
    for (Sample& sample : first) sample.sensor = 3;  // It leads though its number is the higher one.
    {
      auto store = SessionStore::create(path, smallPlan(), {});
      FT_VERIFY_OK(store->storeTake(
          4, {{first, averageSamples(first).value()}, {second, averageSamples(second).value()}}, "look"));
    }
    const auto store = SessionStore::open(path);
    FT_VERIFY_OK(store);
    const std::vector<Node> nodes = store->nodes(4).value();
    QCOMPARE(nodes.size(), std::size_t{2});
    QVERIFY(nodes[0].sensor == 3 && nodes[1].sensor == 1);
    QVERIFY(std::abs(nodes[0].tracker_from_sensor.position_m.x() - 1.0) < 1e-3);
    QVERIFY(std::abs(nodes[1].tracker_from_sensor.position_m.x() - 2.0) < 1e-3);
    std::vector<Sample> both = first;
    both.insert(both.end(), second.begin(), second.end());
    QVERIFY(sameSamples(store->samples(4).value(), both));
    QCOMPARE(store->newestSample_s()->value(), second.back().time_s);
    QCOMPARE(store->state(4).value(), PlaceState::kSuspicious);
  }

  void askedForBeforeAnythingIsRead() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->true_pose = bench.placePose(0);
    bench.controller.take();
    QCOMPARE(bench.controller.status().take, TakeState::kCollecting);
    bench.tracker->stand(1.2);
    QCOMPARE(bench.nodes.size(), std::size_t{2});
  }

  void aLostTrackerFailsTheTakeOfAll() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.tracker->lose();
    QCOMPARE(bench.take_failures.size(), 1);
    bench.tracker->comeBack();
    bench.tracker->stand(0.5);
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    bench.controller.take();
    bench.tracker->stand(0.51);
    QCOMPARE(bench.nodes.size(), std::size_t{2});
    for (const Node& node : bench.nodes) QCOMPARE(node.n_used, 60);
  }

  void anExportedTableComesBackAsItWas() {
    TwoSensors bench(folder_.newPath());
    for (int place = 0; place < 4; ++place) bench.takeHere();
    bench.readTables();
    const QString path = folder_.newPath();
    FT_VERIFY_OK(makeSession(path, bench.table, bench.samples, "two.nodes.csv"));
    const auto store = SessionStore::open(path);
    const CalibrationTable back = store->nodeTable().value();
    QCOMPARE(back.nodes.size(), bench.table.nodes.size());
    for (std::size_t i = 0; i < back.nodes.size(); ++i) {
      const Node &a = back.nodes[i], &b = bench.table.nodes[i];
      QVERIFY(a.node == b.node && a.sensor == b.sensor && a.visit == b.visit);
      FT_VERIFY_MATCH(sameBits(a.tracker_from_sensor, b.tracker_from_sensor));
    }
    QCOMPARE(store->places().size(), std::size_t{4});
    QCOMPARE(store->sampleTable()->rows.size(), bench.samples.rows.size());
  }
};

FIELDTRUE_TEST(SeveralSensorsTest)
#include "several_sensors_test.moc"
