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
  void followsTheTrackersClock();
  void isNotMovedByABusyComputer();
  void noticesAJump();
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

void SampleClockTest::followsTheTrackersClock() {
  // A crystal that is 200 ppm fast, started long ago; bytes arrive 3 to 19 ms after the reading, four at once.
  constexpr double kFast = 1.0002;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> delay_s(0.003, 0.019);
  UnitClock clock;
  double last_s = 0.0, arrival_s = 0.0;
  for (int i = 0; i < 240 * 600; ++i) {
    const double made_s = i / 240.0;
    if (i % 4 == 0) arrival_s = std::max(arrival_s, made_s + 3.0 / 240.0 + delay_s(random));
    const double stamped_s = clock.stamp(arrival_s, 5000.0 + made_s * kFast);
    QVERIFY(!clock.jumped());
    QVERIFY(i == 0 || stamped_s > last_s);
    // Never later than it came, and within the delays of when it was made.
    if (i > 240) FT_VERIFY_MATCH(near(stamped_s - made_s, 0.015, 0.015));
    last_s = stamped_s;
  }
}

void SampleClockTest::isNotMovedByABusyComputer() {
  UnitClock clock;
  for (int i = 0; i < 2400; ++i) {
    const double made_s = i / 240.0;
    // For one second nobody reads.
    const double arrival_s = made_s > 5.0 && made_s < 6.0 ? 6.0 : made_s;
    FT_VERIFY_MATCH(near(clock.stamp(arrival_s, made_s), made_s, 0.006));
    QVERIFY(!clock.jumped());
  }
}

void SampleClockTest::noticesAJump() {
  UnitClock clock;
  clock.stamp(10.0, 100.0);
  clock.stamp(10.1, 100.1);
  QVERIFY(!clock.jumped());
  // Readings taken together have one stamp.
  FT_VERIFY_MATCH(near(clock.stamp(10.1, 100.1), 10.1, 1e-6));
  FT_VERIFY_MATCH(near(clock.stamp(10.2, 0.0), 10.2, 1e-9));
  QVERIFY(clock.jumped());
  FT_VERIFY_MATCH(near(clock.jump_s(), -100.2, 1e-3));
  clock.stamp(10.3, 0.1);
  QVERIFY(!clock.jumped());
  clock.stamp(10.4, 7.0);
  QVERIFY(clock.jumped());
  FT_VERIFY_MATCH(near(clock.jump_s(), 6.8, 1e-3));
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
