#include "acquisition/devices/sample_clock.h"

#include <QTest>
#include <random>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

class SampleClockTest : public QObject {
  Q_OBJECT
 private slots:
  void spreadsBunches_data();
  void spreadsBunches();
  void growsAlways();
  void startsAnewAfterAGap();
  void bridgesAStallOfTheReader();
  void seesTheHemisphereFlip();
  void doesNotMistakeMotionForAFlip();
};

void SampleClockTest::spreadsBunches_data() {
  QTest::addColumn<double>("true_rate_hz");
  QTest::addColumn<int>("bunch");
  QTest::newRow("one by one") << 120.0 << 1;
  QTest::newRow("bunches of 4") << 120.0 << 4;
  QTest::newRow("bunches of 4 at another rate") << 100.0 << 4;
  QTest::newRow("bunches of 10, slow") << 70.0 << 10;
}

void SampleClockTest::spreadsBunches() {
  QFETCH(double, true_rate_hz);
  QFETCH(int, bunch);
  SampleClock clock(1.0 / 120.0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> latency(0.001, 0.003);
  const double bunch_s = bunch / true_rate_hz;
  double arrival_s = 0.0;
  for (int i = 0; i < 3000; ++i) {
    if (i % bunch == 0) arrival_s = (i + bunch - 1) / true_rate_hz + latency(random);
    const auto later = static_cast<std::size_t>(bunch - 1 - i % bunch);
    const double error_s = clock.stamp(arrival_s, later) - i / true_rate_hz;
    // After settling, late by the latency and by no more than a fifth of a bunch to either side.
    if (i > 1500) {
      QVERIFY2(error_s > 0.001 - 0.2 * bunch_s && error_s < 0.003 + 0.2 * bunch_s,
               qPrintable(QString::number(error_s)));
    }
  }
  FT_VERIFY_MATCH(near(clock.period_s(), 1.0 / true_rate_hz, 0.05 / true_rate_hz));
}

void SampleClockTest::growsAlways() {
  SampleClock clock(0.01);
  double last_s = -1.0;
  for (int i = 0; i < 100; ++i) {
    const double now_s = clock.stamp(i < 50 ? 1.0 : 1.2);
    QVERIFY(now_s > last_s);
    last_s = now_s;
  }
}

void SampleClockTest::startsAnewAfterAGap() {
  SampleClock clock(0.01);
  for (int i = 0; i < 100; ++i) clock.stamp(i * 0.01);
  QCOMPARE(clock.stamp(5.0), 5.0);
}

void SampleClockTest::bridgesAStallOfTheReader() {
  SampleClock clock(0.01);
  int i = 0;
  for (; i < 100; ++i) clock.stamp(i * 0.01);
  // Nobody read for two seconds; the 200 readings made meanwhile are read at once.
  for (; i < 300; ++i) FT_VERIFY_MATCH(near(clock.stamp(2.99, static_cast<std::size_t>(299 - i)), i * 0.01, 0.005));
}

void SampleClockTest::seesTheHemisphereFlip() {
  HemisphereWatch watch;
  for (int i = 0; i < 300; ++i) {
    const bool flipped = i >= 100 && i < 200;
    const Eigen::Vector3d p(0.3 + 0.001 * i, 0.1, -0.05);
    Sample sample{i * 0.01, 0, {flipped ? Eigen::Vector3d(-p) : p, Eigen::Quaterniond::Identity()}, {}};
    watch.check(sample);
    QCOMPARE(sample.status, std::string(flipped ? "flipped" : ""));
  }
}

void SampleClockTest::doesNotMistakeMotionForAFlip() {
  HemisphereWatch watch;
  // A hand passing close by the transmitter, an error in between, and another sensor on the other side.
  for (int i = -50; i <= 50; ++i) {
    Sample sample{i * 0.01, 0, {{0.01 * i, 0.12, 0.0}, Eigen::Quaterniond::Identity()}, {}};
    Sample other{i * 0.01, 1, {{-0.01 * i, -0.12, 0.0}, Eigen::Quaterniond::Identity()}, i % 7 ? "" : "k"};
    watch.check(sample);
    watch.check(other);
    QCOMPARE(sample.status, std::string());
    QCOMPARE(other.status, std::string(i % 7 ? "" : "k"));
  }
  // Carried to the other side out of range for a second.
  for (int i = 0; i < 120; ++i) {
    Sample unseen{1.0 + i / 120.0, 0, {}, "k"};
    watch.check(unseen);
  }
  Sample later{10.0, 0, {{-0.5, -0.12, 0.0}, Eigen::Quaterniond::Identity()}, {}};
  watch.check(later);
  QCOMPARE(later.status, std::string());
}

FIELDTRUE_TEST(SampleClockTest)
#include "sample_clock_test.moc"
