#include <QTest>
#include <algorithm>

#include "acquisition/session/recorded_sensors.h"
#include "tests/acquisition/session/raw_sql.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/acquisition/session/two_sensors.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// Which sensors a session goes on with: those that took its places, whichever come late, are dead, or were not chosen.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

class SensorsGoingOnTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;
  /// A session of its own, and the stream heard in it.
  static void beginNext(TwoSensors& bench, const QString& path) {
    bench.controller.openSession(path, QString::fromStdString(toJson(planOf({2, 1, 1})).dump()));
    bench.tracker->stand(0.5);
  }

 private slots:
  void aSessionGoesOnWithItsOwnSensors() {
    const QString path = folder_.newPath();
    {
      TwoSensors bench(path);
      bench.controller.setSensors({1, 0});
      bench.tracker->on_jig[2] = kThird;
      bench.takeHere();
      QCOMPARE(bench.recorded(), Numbers({1, 0}));
      bench.controller.closeSession();
    }
    TwoSensors bench(path, {}, false, 100.0);
    bench.tracker->on_jig[2] = kThird;
    bench.takeHere();
    QCOMPARE(bench.recorded(), Numbers({1, 0}));
    QVERIFY(bench.controller.status().takes_settle_sensors);
    bench.controller.setSensors({2});
    QCOMPARE(bench.recorded(), Numbers({1, 0}));
    bench.takeHere();
    QCOMPARE(bench.sensorsOfTable(), Numbers({0, 1}));
    QCOMPARE(bench.table.nodes.size(), std::size_t{6});
    QVERIFY(bench.remarks.isEmpty());
  }

  void whichOfThemIsNotThereIsSaid() {
    const QString path = folder_.newPath();
    {
      TwoSensors bench(path);
      bench.takeHere();
      bench.controller.closeSession();
    }
    TwoSensors bench(path, {}, false, 100.0);
    bench.tracker->on_jig[1].is_plugged = false;
    bench.tracker->stand(3.0);
    QCOMPARE(bench.remarks.size(), 1);
    FT_VERIFY_MATCH(
        holdsAll(bench.remarks[0].toStdString(), {"Sensor 1 is recorded in this session", "only sensor 0"}));
    QCOMPARE(bench.controller.status().missing, Numbers({1}));
    bench.controller.take();
    FT_VERIFY_MATCH(holdsAll(bench.take_failures.value(0).toStdString(), {"sensor 1 does not report"}));
  }

  void aSessionOfOneSensorGoesOnWithIt() {
    const QString path = folder_.newPath();
    {
      Bench one(path, planOf({2, 2, 1}));
      one.takeHere();
      one.controller.closeSession();
    }
    // As an earlier version left it, which knew one sensor a take.
    runSql(path, {"DROP TABLE takes_of_others"});
    TwoSensors bench(path, {}, false, 100.0);
    bench.takeHere();
    QCOMPARE(bench.recorded(), Numbers({0}));
    QCOMPARE(bench.sensorsOfTable(), Numbers({0}));
    QCOMPARE(bench.table.nodes.size(), std::size_t{2});
  }

  void theChoiceIsKeptWithTheSession() {
    const QString path = folder_.newPath();
    {
      TwoSensors bench(path);
      bench.tracker->stand(0.5);
      bench.controller.setSensors({1});
      QCOMPARE(bench.recorded(), Numbers({1}));
      bench.controller.closeSession();
    }
    QCOMPARE(readSensors(SessionStore::open(path)->state(kSensorsState).value()).value(), Numbers({1}));
    TwoSensors bench(path, {}, false, 100.0);
    bench.tracker->stand(0.5);
    QCOMPARE(bench.recorded(), Numbers({1}));
    bench.controller.setSensors({});
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    bench.controller.setSensors({1});
    bench.takeHere();
    QCOMPARE(bench.sensorsOfTable(), Numbers({1}));
    // The next session begins as if nothing had been chosen.
    beginNext(bench, folder_.newPath());
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
  }

  void theNextSessionIsNotLedByThatOfTheOneBefore() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->stand(0.5);
    bench.controller.setSensors({1, 0});
    QCOMPARE(bench.recorded(), Numbers({1, 0}));
    beginNext(bench, folder_.newPath());
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    QCOMPARE(bench.controller.status().live->sensor, 0);
  }

  void whatIsChosenBeforeASessionIsOfIt() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->stand(0.5);
    bench.controller.closeSession();
    bench.controller.setSensors({1, 0});
    const QString path = folder_.newPath();
    beginNext(bench, path);
    QCOMPARE(bench.recorded(), Numbers({1, 0}));
    bench.controller.closeSession();
    QCOMPARE(readSensors(SessionStore::open(path)->state(kSensorsState).value()).value(), Numbers({1, 0}));
    beginNext(bench, folder_.newPath());
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
  }

  void aSensorPluggedInBeforeTheFirstTakeIsRecorded() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->stand(1.0);
    bench.tracker->on_jig[2] = kThird;
    bench.tracker->stand(0.1);
    QCOMPARE(bench.recorded(), Numbers({0, 1, 2}));
    bench.takeHere();
    QVERIFY(bench.remarks.isEmpty());
    bench.tracker->on_jig[3] = kThird;
    bench.tracker->stand(1.0);
    QCOMPARE(bench.recorded(), Numbers({0, 1, 2}));
    const QString told =
        "Sensor 3 reports and is not recorded in this session: its takes settled that sensors 0, 1 and 2 are.";
    QCOMPARE(bench.remarks, QStringList{told});
    bench.takeHere();
    QCOMPARE(bench.remarks.size(), 1);
    QCOMPARE(bench.sensorsOfTable(), Numbers({0, 1, 2}));
    QCOMPARE(bench.table.nodes.size(), std::size_t{6});
  }

  void aSensorPluggedInDuringATakeIsNot() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.1);
    bench.tracker->on_jig[2] = kThird;
    bench.tracker->stand(0.5);
    QCOMPARE(bench.nodes.size(), std::size_t{2});
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    QCOMPARE(bench.remarks.size(), 1);
    FT_VERIFY_MATCH(holdsAll(bench.remarks[0].toStdString(), {"Sensor 2 reports and is not recorded"}));
  }

  void oneThatIsLeftOutByChoiceIsNoNews() {
    TwoSensors bench(folder_.newPath());
    bench.tracker->stand(1.0);
    bench.controller.setSensors({0});
    bench.tracker->on_jig[2] = kThird;
    bench.takeHere();
    bench.takeHere();
    QVERIFY2(bench.remarks.isEmpty(), qPrintable(bench.remarks.join("\n")));
  }

  void aSessionGoesOnWithoutADeadOne() {
    const QString path = folder_.newPath();
    {
      TwoSensors bench(path);
      bench.takeHere();
      bench.tracker->on_jig[1].is_plugged = false;
      bench.tracker->stand(3.0);
      bench.controller.setSensors({0});
      QCOMPARE(bench.recorded(), Numbers({0}));
      QCOMPARE(bench.remarks, QStringList{"Sensor 1 is left out of this session from here on: what is taken now has no "
                                          "rows of it."});
      bench.takeHere();
      QCOMPARE(bench.nodes.size(), std::size_t{3});
      QVERIFY(!bench.controller.status().attention);
      bench.controller.closeSession();
    }
    const auto events = SessionStore::open(path)->events().value();
    QCOMPARE(std::count_if(events.begin(), events.end(),
                           [](const auto& event) { return event.second.starts_with("Sensor 1 is left out"); }),
             1);
    TwoSensors bench(path, {}, false, 100.0);
    QCOMPARE(bench.remarks.size(), 1);
    FT_VERIFY_MATCH(holdsAll(bench.remarks[0].toStdString(), {"Sensor 1 is left out of this session"}));
    bench.tracker->on_jig.erase(1);
    bench.takeHere();
    QCOMPARE(bench.nodes.size(), std::size_t{1});
    QCOMPARE(bench.controller.status().of_session, Numbers({0, 1}));
    bench.tracker->on_jig[1] = kSecond;
    bench.tracker->stand(0.5);
    QCOMPARE(bench.remarks.size(), 2);
    FT_VERIFY_MATCH(holdsAll(bench.remarks[1].toStdString(), {"Sensor 1 reports again and is left out"}));
    bench.controller.setSensors({1, 0});
    QCOMPARE(bench.recorded(), Numbers({0, 1}));
    bench.takeHere();
    bench.readTables();
    std::vector<std::pair<int, int>> rows;
    for (const Node& node : bench.table.nodes) rows.emplace_back(node.node, node.sensor);
    QCOMPARE(rows.size(), std::size_t{6});
    QCOMPARE(std::count_if(rows.begin(), rows.end(), [](const auto& row) { return row.second == 1; }), 2);
  }

  void whereTheLeadingOneIsDeadTheLowestLeads() {
    // So far from it that its positions cannot stand for those of the sensor that led.
    TwoSensors bench(folder_.newPath(), planOf({3, 2, 2}));
    bench.tracker->on_jig[1].jig_from_sensor.position_m = {0.0, 0.5, 0.3};
    bench.tracker->on_jig[2] = kThird;
    bench.controller.setSensors({1, 2, 0});
    for (int place = 0; place < 8; ++place) bench.takeHere();
    bench.controller.setSensors({2, 0});
    QCOMPARE(bench.recorded(), Numbers({1, 0, 2}));
    QCOMPARE(bench.remarks, QStringList{"Sensor 1 leads and reports: it cannot be left out."});
    bench.tracker->on_jig[1].is_plugged = false;
    bench.tracker->stand(3.0);
    bench.controller.setSensors({2, 0});
    QCOMPARE(bench.recorded(), Numbers({0, 2}));
    FT_VERIFY_MATCH(holdsAll(bench.remarks.value(1).toStdString(), {"Sensor 1 is left out", "Sensor 0 leads"}));
    for (int place = 8; place < 12; ++place) bench.takeHere();
    QCOMPARE(bench.n_finished, 1);
    QVERIFY(bench.refused.empty() && bench.controller.status().recorded->misfits.empty());
    QCOMPARE(bench.nodes.size(), std::size_t{8 * 3 + 4 * 2});
    for (const QString& suspicion : bench.suspicions) QCOMPARE(suspicion, QString());
  }
};

FIELDTRUE_TEST(SensorsGoingOnTest)
#include "sensors_going_on_test.moc"
