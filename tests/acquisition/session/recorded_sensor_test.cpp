#include <QObject>
#include <QTest>

#include "acquisition/session/acquisition_tracker.h"
#include "acquisition/session/recorded_sensors.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

namespace {

using Numbers = std::vector<int>;

/// Sensors that report in turn, beginning anywhere; times count the readings.
std::vector<Sample> recordedOf(TrackerLink& link, const Numbers& sensors, bool takes_newcomers = true) {
  std::vector<Sample> recorded;
  double time_s = link.now_s.value_or(-1.0);
  for (const int sensor : sensors) {
    Sample sample;
    sample.sensor = sensor;
    sample.time_s = ++time_s;
    for (const Sample& one : link.recorded(sample, takes_newcomers)) recorded.push_back(one);
  }
  return recorded;
}

}  // namespace

/// Every sensor that reports is recorded, unless others are asked for; none of the readings is lost while it is found
/// out which ones report.
class RecordedSensorTest : public QObject {
  Q_OBJECT
 private slots:
  void everyOneThatReports_data() {
    QTest::addColumn<QList<int>>("sensors");
    QTest::addColumn<QList<int>>("recorded");
    QTest::newRow("the lowest first") << QList<int>{0, 1, 0, 1, 0, 1, 0, 1} << QList<int>{0, 1};
    QTest::newRow("the other first") << QList<int>{1, 0, 1, 0, 1, 0, 1, 0} << QList<int>{0, 1};
    QTest::newRow("its first reading lost") << QList<int>{1, 1, 0, 1, 0, 1, 0, 0} << QList<int>{0, 1};
    QTest::newRow("three") << QList<int>{7, 2, 4, 7, 2, 4, 7, 2, 4} << QList<int>{2, 4, 7};
    QTest::newRow("one alone") << QList<int>{0, 0, 0, 0} << QList<int>{0};
  }
  void everyOneThatReports() {
    QFETCH(QList<int>, sensors);
    QFETCH(QList<int>, recorded);
    QObject receiver;
    TrackerLink link(&receiver);
    const std::vector<Sample> samples = recordedOf(link, {sensors.begin(), sensors.end()});
    QCOMPARE(link.sensors, Numbers(recorded.begin(), recorded.end()));
    QCOMPARE(static_cast<qsizetype>(samples.size()), sensors.size());
    for (std::size_t i = 0; i < samples.size(); ++i) QCOMPARE(samples[i].time_s, static_cast<double>(i));
  }

  void onlyThoseAskedFor() {
    QObject receiver;
    TrackerLink link(&receiver);
    link.sensors = {2, 0};
    QCOMPARE(recordedOf(link, {0, 1, 2, 0, 1, 2, 0, 1, 2}, false).size(), std::size_t{6});
    QCOMPARE(link.sensors, Numbers({2, 0}));
    QCOMPARE(link.reporting(), Numbers({0, 1, 2}));
    Sample sample;
    sample.sensor = 2;
    QVERIFY2(link.leads(sample), "the first that was named");
  }

  void oneThatBeginsLateJoinsBehindTheOthers() {
    QObject receiver;
    TrackerLink link(&receiver);
    recordedOf(link, {1, 1, 1});
    QCOMPARE(link.sensors, Numbers({1}));
    QCOMPARE(recordedOf(link, {1, 0, 1, 0, 1, 0, 1, 0}).size(), std::size_t{6});
    QCOMPARE(link.sensors, Numbers({1, 0}));
    recordedOf(link, {5, 5, 5, 5}, false);
    QCOMPARE(link.sensors, Numbers({1, 0}));
  }

  void theyStayWhenTheStreamBeginsAnew() {
    QObject receiver;
    TrackerLink link(&receiver);
    recordedOf(link, {2, 3, 2, 3, 2, 3});
    QCOMPARE(link.sensors, Numbers({2, 3}));
    link.beginStream();
    QCOMPARE(recordedOf(link, {1, 2, 1, 2}).size(), std::size_t{2});
    QCOMPARE(link.sensors, Numbers({2, 3}));
  }

  void whoSendsNothingIsMissing() {
    QObject receiver;
    TrackerLink link(&receiver);
    link.sensors = {1, 2};
    recordedOf(link, Numbers(29, 0), false);
    QVERIFY2(link.missingSensors().empty(), "too early to tell");
    QVERIFY(recordedOf(link, {0}, false).empty());
    QCOMPARE(link.missingSensors(), Numbers({1, 2}));
    recordedOf(link, {2}, false);
    QCOMPARE(link.missingSensors(), Numbers({1}));
    link.beginStream();
    recordedOf(link, Numbers(40, 1), false);
    QCOMPARE(link.missingSensors(), Numbers({2}));
  }

  void whoStopsIsSilent() {
    QObject receiver;
    TrackerLink link(&receiver);
    recordedOf(link, {0, 1, 0, 1, 0, 1});
    QVERIFY(link.silentSensors().empty());
    recordedOf(link, {0});
    QVERIFY2(link.silentSensors().empty(), "a second ago");
    recordedOf(link, {0});
    QCOMPARE(link.silentSensors(), Numbers({1}));
    recordedOf(link, {1});
    QVERIFY(link.silentSensors().empty());
  }

  void oneAloneIsNeverSilent() {
    QObject receiver;
    TrackerLink link(&receiver);
    QVERIFY(link.silentSensors().empty());
    recordedOf(link, Numbers(100, 0));
    QVERIFY(link.silentSensors().empty());
  }

  void choicesAreRead_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QList<int>>("sensors");
    QTest::addColumn<QByteArray>("refused");
    const auto row = [](const char* text, const QList<int>& sensors, const char* refused = "") {
      QTest::addRow("'%s'", text) << QByteArray(text) << sensors << QByteArray(refused);
    };
    row("", {});
    row("all", {});
    row("0", {0});
    row("12", {12});
    row("0+2", {0, 2});
    row("2+0+15", {2, 0, 15});
    for (const char* wrong : {"-1", "1001", "one", "0+", "+0", "0++1", "0,1", "0 1", "1.5", "all+0", "99999999999"})
      row(wrong, {}, "names no sensors");
    row("3+3", {}, "names sensor 3 twice");
  }
  void choicesAreRead() {
    QFETCH(QByteArray, text);
    QFETCH(QList<int>, sensors);
    QFETCH(QByteArray, refused);
    const auto read = readSensors(text.toStdString());
    QCOMPARE(read.has_value(), refused.isEmpty());
    if (!read) {
      FT_VERIFY_MATCH(testing::holdsAll(read.error().message, {refused, "'" + text + "'"}));
      return;
    }
    QCOMPARE(*read, Numbers(sensors.begin(), sensors.end()));
    QCOMPARE(readSensors(textOf(*read)).value(), *read);
  }
};

FIELDTRUE_TEST(RecordedSensorTest)
#include "recorded_sensor_test.moc"
