#include <QObject>
#include <QTest>

#include "acquisition/session/acquisition_tracker.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

namespace {

/// Sensors that report in turn, beginning anywhere; times count the readings.
std::vector<Sample> recordedOf(TrackerLink& link, const std::vector<int>& sensors) {
  std::vector<Sample> recorded;
  double time_s = 0.0;
  for (const int sensor : sensors) {
    Sample sample;
    sample.sensor = sensor;
    sample.time_s = time_s++;
    for (const Sample& one : link.recorded(sample)) recorded.push_back(one);
  }
  return recorded;
}

}  // namespace

/// Of several sensors one is recorded: always the same, and none of its readings is lost while it is found out.
class RecordedSensorTest : public QObject {
  Q_OBJECT
 private slots:
  void isTheLowestWhoeverReportsFirst_data() {
    QTest::addColumn<QList<int>>("sensors");
    QTest::newRow("the lowest first") << QList<int>{0, 1, 0, 1, 0, 1, 0, 1};
    QTest::newRow("the other first") << QList<int>{1, 0, 1, 0, 1, 0, 1, 0};
    QTest::newRow("its first reading lost") << QList<int>{1, 1, 0, 1, 0, 1, 0, 0};
    QTest::newRow("one alone") << QList<int>{0, 0, 0, 0};
  }
  void isTheLowestWhoeverReportsFirst() {
    QFETCH(QList<int>, sensors);
    QObject receiver;
    TrackerLink link(&receiver);
    const std::vector<Sample> recorded = recordedOf(link, {sensors.begin(), sensors.end()});
    QCOMPARE(link.sensor, std::optional(0));
    QCOMPARE(static_cast<qsizetype>(recorded.size()), sensors.count(0));
    for (std::size_t i = 1; i < recorded.size(); ++i) QVERIFY(recorded[i].time_s > recorded[i - 1].time_s);
  }

  void staysWhenTheStreamBeginsAnew() {
    QObject receiver;
    TrackerLink link(&receiver);
    recordedOf(link, {2, 3, 2, 3, 2, 3});
    QCOMPARE(link.sensor, std::optional(2));
    link.beginStream();
    QCOMPARE(recordedOf(link, {1, 2, 1, 2}).size(), std::size_t{2});
    QCOMPARE(link.sensor, std::optional(2));
  }

  void isMissedOnce() {
    QObject receiver;
    TrackerLink link(&receiver);
    link.sensor = 1;
    recordedOf(link, std::vector<int>(29, 0));
    QVERIFY(!link.findsItMissing());
    QVERIFY(recordedOf(link, {0}).empty());
    QVERIFY(link.findsItMissing());
    QVERIFY(!link.findsItMissing());
    link.beginStream();
    recordedOf(link, std::vector<int>(40, 1));
    QVERIFY(!link.findsItMissing());
  }
};

FIELDTRUE_TEST(RecordedSensorTest)
#include "recorded_sensor_test.moc"
