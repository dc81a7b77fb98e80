#include "acquisition/sampling/take_sampler.h"

#include <QTest>
#include <vector>

#include "tests/acquisition/sampling/noisy_sensor.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// A sensor of the jig that stands somewhere of its own.
NoisySensor standing(int sensor, double sd_m = 1e-4) {
  NoisySensor made(sd_m, 0.0, static_cast<std::uint64_t>(sensor) + 1);
  made.sensor = sensor;
  made.place_m += Eigen::Vector3d(0.0, 0.04 * sensor, 0.0);
  return made;
}

SamplerOptions until(TakeLength::Until kind, double amount) {
  SamplerOptions options;
  options.length = {kind, amount};
  return options;
}

/// Sensors that report in turn until the take has ended. @param cycles at most so many
TakeState takeOf(TakeSampler& take, std::vector<NoisySensor>& sensors, int cycles) {
  for (int n = 0; n < cycles && take.state() == TakeState::kCollecting; ++n)
    for (NoisySensor& sensor : sensors) take.add(sensor.next());
  return take.state();
}

}  // namespace

/// A take of several sensors at once: each has its own mean, and all have what was asked for.
class TakeSamplerTest : public QObject {
  Q_OBJECT
 private slots:
  void oneSensorIsTakenAsByItself_data() {
    QTest::addColumn<QByteArray>("length");
    QTest::addColumn<double>("step_m");
    for (const char* length : {"60", "1.5s", "0.05mm"})
      for (const double step_m : {0.0, 0.004})
        QTest::addRow("%s, step of %g m", length, step_m) << QByteArray(length) << step_m;
  }
  void oneSensorIsTakenAsByItself() {
    QFETCH(QByteArray, length);
    QFETCH(double, step_m);
    SamplerOptions options;
    options.length = readTakeLength(length.toStdString()).value();
    NodeSampler alone(options);
    TakeSampler take(options);
    alone.start();
    take.start({3});
    NoisySensor sensor(3e-4, 0.5, 9);
    sensor.sensor = 3;
    sensor.path_m = [step_m = step_m](int n) { return stepAt(n, 35, step_m); };
    for (int n = 0; n < 4000 && alone.state() == TakeState::kCollecting; ++n) {
      Sample sample = sensor.next();
      if (n % 7 == 3) sample.status = "k";
      QCOMPARE(take.add(sample), alone.add(sample));
      QCOMPARE(take.collected(), alone.collected());
      QCOMPARE(take.wanted(), alone.wanted());
      QCOMPARE(take.restarts(), alone.restarts());
      QCOMPARE(take.message(), alone.message());
    }
    QCOMPARE(alone.state(), TakeState::kDone);
    QCOMPARE(alone.restarts() > 0, step_m > 0.0);
    const NodeStatistics& statistics = *take.of(3)->statistics();
    FT_VERIFY_MATCH(sameBits(statistics.mean, alone.statistics()->mean));
    QCOMPARE(statistics.covariance_m2, alone.statistics()->covariance_m2);
  }

  void everySensorHasItsOwnMean() {
    TakeSampler take;
    take.start({0, 1, 5});
    std::vector<NoisySensor> sensors{standing(0), standing(1, 1e-3), standing(5)};
    QCOMPARE(takeOf(take, sensors, 100), TakeState::kDone);
    for (const TakeSampler::OfSensor& one : take.ofSensors()) {
      QCOMPARE(one.sampler.collected(), 60);
      Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
      int n = 0;
      std::vector<std::size_t> rejected;
      for (const Rejection& rejection : one.sampler.statistics()->rejections) rejected.push_back(rejection.sample);
      for (std::size_t i = 0; i < one.sampler.samples().size(); ++i) {
        QCOMPARE(one.sampler.samples()[i].sensor, one.sensor);
        if (std::find(rejected.begin(), rejected.end(), i) != rejected.end()) continue;
        sum_m += one.sampler.samples()[i].tracker_from_sensor.position_m;
        ++n;
      }
      FT_VERIFY_MATCH(near(one.sampler.statistics()->mean.position_m, sum_m / n, 1e-12));
    }
    // The second is ten times as noisy; what that is does not rub off on the others.
    const auto sd_m = [&](int sensor) { return std::sqrt(take.of(sensor)->statistics()->covariance_m2.trace()); };
    QVERIFY(sd_m(1) > 5.0 * sd_m(0) && sd_m(5) < 2.0 * sd_m(0));
  }

  void itIsDoneWhenTheLastOneIs() {
    TakeSampler take;
    take.start({0, 1});
    NoisySensor often = standing(0), seldom = standing(1);
    for (int n = 0; n < 240; ++n) {
      QCOMPARE(take.state(), n < 237 ? TakeState::kCollecting : TakeState::kDone);
      take.add(often.next());
      Sample sample = seldom.next();
      if (n % 4 == 0) take.add(sample);
      QCOMPARE(take.collected(), std::min(take.of(0)->collected(), take.of(1)->collected()));
    }
    QCOMPARE(take.of(0)->collected(), 60);
    QCOMPARE(take.of(1)->collected(), 60);
  }

  void byTimeAndByErrorEachHasItsOwn() {
    std::vector<NoisySensor> sensors{standing(0, 1e-4), standing(1, 4e-4)};
    TakeSampler timed(until(TakeLength::Until::kSeconds, 1.0));
    timed.start({0, 1});
    QCOMPARE(takeOf(timed, sensors, 1000), TakeState::kDone);
    for (const TakeSampler::OfSensor& one : timed.ofSensors()) QCOMPARE(one.sampler.collected(), 121);
    TakeSampler known(until(TakeLength::Until::kStandardError, 5e-5));
    known.start({0, 1});
    QCOMPARE(takeOf(known, sensors, 1000), TakeState::kDone);
    // (4e-4 / 5e-5)^2 = 64 independent readings of the noisy one; the fewest that tell of the other.
    QCOMPARE(known.of(0)->collected(), 30);
    QVERIFY2(known.of(1)->collected() > 40 && known.of(1)->collected() < 100,
             qPrintable(QString::number(known.of(1)->collected())));
  }

  void motionThatOneSeesStartsAllOver_data() {
    QTest::addColumn<bool>("first_moves");
    QTest::addColumn<bool>("second_moves");
    QTest::newRow("both") << true << true;
    QTest::newRow("the one that has enough") << true << false;
    QTest::newRow("the one that has not") << false << true;
  }
  void motionThatOneSeesStartsAllOver() {
    QFETCH(bool, first_moves);
    QFETCH(bool, second_moves);
    TakeSampler take;
    take.start({0, 1});
    // Sensor 0 has its 60 readings; sensor 1, which misses every other one, has 40 when the jig is knocked, by which
    // one of them may stand where it was, for the jig may turn about it.
    NoisySensor first = standing(0), second = standing(1);
    const auto knock = [](int n) { return stepAt(n, 80, 0.003); };
    if (first_moves) first.path_m = knock;
    if (second_moves) second.path_m = knock;
    for (int n = 0; n < 1000 && take.state() == TakeState::kCollecting; ++n) {
      take.add(first.next());
      const Sample sample = second.next();
      if (n % 2 == 0) take.add(sample);
      if (n == 79) QCOMPARE(take.of(0)->state(), TakeState::kDone);
    }
    QCOMPARE(take.state(), TakeState::kDone);
    for (const TakeSampler::OfSensor& one : take.ofSensors()) {
      QCOMPARE(one.sampler.restarts(), 1);
      QVERIFY(!one.sampler.abandoned().empty());
      for (const Sample& sample : one.sampler.samples()) QVERIFY(sample.time_s > 79.0 / kNoisySensor_hz);
    }
  }

  void whatIsWatchedEntersNoMean() {
    TakeSampler take;
    NodeSampler alone;
    take.start({0, 1});
    alone.start();
    NoisySensor often = standing(0), seldom = standing(1);
    for (int n = 0; take.state() == TakeState::kCollecting; ++n) {
      const Sample sample = often.next(), other = seldom.next();
      take.add(sample);
      if (alone.state() == TakeState::kCollecting) alone.add(sample);
      if (n % 8 == 0) take.add(other);
    }
    QCOMPARE(take.state(), TakeState::kDone);
    const NodeSampler& watching = *take.of(0);
    // The 60th of the other one comes with the 473rd reading.
    QCOMPARE(watching.watched().size(), std::size_t{473 - 60});
    QCOMPARE(watching.restarts(), 0);
    QCOMPARE(watching.samples().size(), std::size_t{60});
    FT_VERIFY_MATCH(sameBits(watching.statistics()->mean, alone.statistics()->mean));
    QCOMPARE(watching.statistics()->covariance_m2, alone.statistics()->covariance_m2);
  }

  /// A resting sensor that watches for 10 s is never taken to move: none in 30 such bounds it below 10 %.
  void whoWatchesForLongSeesNoMotionInNoise() {
    for (std::uint64_t run = 0; run < 30; ++run) {
      NodeSampler sampler;
      sampler.start();
      NoisySensor sensor(3e-3, 0.8, 2000 + run);
      while (sampler.state() == TakeState::kCollecting) sampler.add(sensor.next());
      for (int n = 0; n < 10 * kNoisySensor_hz; ++n) sampler.watch(sensor.next());
      QCOMPARE(sampler.restarts(), 0);
    }
  }

  void aSilentSensorEndsTheTake_data() {
    QTest::addColumn<int>("silent");
    QTest::addColumn<int>("readings");
    QTest::newRow("the leading one, in the middle") << 0 << 20;
    QTest::newRow("another, in the middle") << 1 << 20;
    QTest::newRow("another, from the start") << 1 << 0;
  }
  void aSilentSensorEndsTheTake() {
    QFETCH(int, silent);
    QFETCH(int, readings);
    TakeSampler take;
    take.start({0, 1});
    std::vector<NoisySensor> sensors{standing(0), standing(1)};
    double ended_s = 0.0;
    for (int n = 0; n < 10000 && take.state() == TakeState::kCollecting; ++n) {
      for (NoisySensor& sensor : sensors) {
        const Sample sample = sensor.next();
        if (sensor.sensor != silent || n < readings) take.add(sample);
        ended_s = sample.time_s;
      }
    }
    QCOMPARE(take.state(), TakeState::kFailed);
    QVERIFY2(std::abs(ended_s - 30.0) < 0.1, qPrintable(QString::number(ended_s)));
    FT_VERIFY_MATCH(holdsAll(take.message(), {"sensor " + QByteArray::number(silent) + ": silent",
                                              QByteArray::number(readings) + " of 60 good samples"}));
    QVERIFY2(take.message().find("sensor " + std::to_string(1 - silent)) == std::string::npos, take.message().c_str());
  }

  void oneThatIsMarkedIsNamed() {
    TakeSampler take;
    take.start({0, 1});
    std::vector<NoisySensor> sensors{standing(0), standing(1)};
    for (int n = 0; n < 10000 && take.state() == TakeState::kCollecting; ++n) {
      take.add(sensors[0].next());
      Sample sample = sensors[1].next();
      sample.status = "out of range";
      take.add(sample);
    }
    QCOMPARE(take.state(), TakeState::kFailed);
    FT_VERIFY_MATCH(holdsAll(take.message(), {"sensor 1: not finished", "0 of 60", "out of range"}));
  }

  void othersArePassedOver() {
    TakeSampler take;
    take.start({1});
    std::vector<NoisySensor> sensors{standing(0), standing(1)};
    QCOMPARE(takeOf(take, sensors, 100), TakeState::kDone);
    QCOMPARE(take.ofSensors().size(), std::size_t{1});
    QVERIFY(!take.of(0));
  }

  void itWaitsForItsSensors() {
    TakeSampler take(until(TakeLength::Until::kSamples, 25));
    QCOMPARE(take.state(), TakeState::kIdle);
    QCOMPARE(take.wanted(), 25);
    take.start({});
    QCOMPARE(take.state(), TakeState::kCollecting);
    QCOMPARE(take.wanted(), 25);
    take.start({0});
    std::vector<NoisySensor> sensors{standing(0)};
    QCOMPARE(takeOf(take, sensors, 100), TakeState::kDone);
    take.cancel();
    QCOMPARE(take.state(), TakeState::kIdle);
    QVERIFY(take.ofSensors().empty());
  }
};

FIELDTRUE_TEST(TakeSamplerTest)
#include "take_sampler_test.moc"
