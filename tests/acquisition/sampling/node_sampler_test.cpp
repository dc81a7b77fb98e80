#include "acquisition/sampling/node_sampler.h"

#include <QTest>
#include <cmath>
#include <optional>

#include "acquisition/sampling/shift_test.h"
#include "acquisition/sampling/stillness.h"
#include "tests/acquisition/sampling/noisy_sensor.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

class NodeSamplerTest : public QObject {
  Q_OBJECT
 private slots:
  void lengthsOfATake_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<int>("until");
    QTest::addColumn<double>("amount");
    QTest::newRow("samples") << QByteArray("60") << 0 << 60.0;
    QTest::newRow("a time") << QByteArray("2.5s") << 1 << 2.5;
    QTest::newRow("an error") << QByteArray("0.05mm") << 2 << 5e-5;
    for (const char* wrong :
         {"", "s", "-5", "0", "2.5", "100001", "1e99s", "0.01s", "601s", "0mm", "5m", "5kg", "60 s"})
      QTest::newRow(qPrintable(QString("no length: '%1'").arg(wrong))) << QByteArray(wrong) << -1 << 0.0;
  }

  void lengthsOfATake() {
    QFETCH(QByteArray, text);
    QFETCH(int, until);
    QFETCH(double, amount);
    const auto length = readTakeLength(text.toStdString());
    QCOMPARE(length.has_value(), until >= 0);
    if (!length) return;
    QCOMPARE(static_cast<int>(length->until), until);
    QVERIFY(std::abs(length->amount - amount) < 1e-12);
    QCOMPARE(textOf(*length), text.toStdString());
  }

  void aTakeByTime() {
    SamplerOptions options;
    options.length = {TakeLength::Until::kSeconds, 1.5};
    NodeSampler sampler(options);
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 4);
    int n = 0;
    while (sampler.add(sensor.next()) == TakeState::kCollecting) {
      ++n;
      if (n == 90) QVERIFY2(sampler.wanted() >= 178 && sampler.wanted() <= 184, "what 1.5 s hold at this rate");
    }
    QVERIFY(sampler.state() == TakeState::kDone);
    QCOMPARE(sampler.collected(), 181);  // 1.5 s at 120 a second, both ends.
  }

  void aTakeUntilItsMeanIsKnown_data() {
    QTest::addColumn<double>("correlation");
    QTest::addColumn<int>("expected");
    // 3-D SD 1 mm, 0.1 mm wanted: 100 independent readings, each of them worth (1 - rho)/(1 + rho).
    QTest::newRow("independent readings") << 0.0 << 100;
    QTest::newRow("a tracker that filters") << 0.8 << 900;
  }

  void aTakeUntilItsMeanIsKnown() {
    QFETCH(double, correlation);
    QFETCH(int, expected);
    SamplerOptions options;
    options.length = {TakeLength::Until::kStandardError, 1e-4};
    NodeSampler sampler(options);
    sampler.start();
    NoisySensor sensor(1e-3, correlation, 12);
    while (sampler.add(sensor.next()) == TakeState::kCollecting) {
    }
    QVERIFY(sampler.state() == TakeState::kDone);
    QVERIFY(sampler.message().empty());
    QVERIFY2(sampler.collected() > expected * 0.6 && sampler.collected() < expected * 1.6,
             qPrintable(QString::number(sampler.collected())));
    const NodeStatistics& mean = *sampler.statistics();
    QVERIFY(std::sqrt(mean.covariance_m2.trace() / mean.n_effective) <= 1e-4);
  }

  /// Ended where its error happens to look small, a take would promise what it does not hold: RMS over places of what
  /// the mean is off by, against what was asked for.
  void whatIsPromisedIsHeld_data() {
    QTest::addColumn<double>("correlation");
    for (const double correlation : {0.0, 0.8, 0.9, 0.95}) QTest::addRow("%g", correlation) << correlation;
  }
  void whatIsPromisedIsHeld() {
    QFETCH(double, correlation);
    constexpr double kWanted_m = 5e-4;
    SamplerOptions options;
    options.length = {TakeLength::Until::kStandardError, kWanted_m};
    double squares_m2 = 0.0;
    constexpr int kPlaces = 60;
    for (int place = 0; place < kPlaces; ++place) {
      NodeSampler sampler(options);
      sampler.start();
      NoisySensor sensor(1.7e-3, correlation, 100 + static_cast<std::uint64_t>(place));
      while (sampler.add(sensor.next()) == TakeState::kCollecting) {
      }
      QVERIFY(sampler.state() == TakeState::kDone);
      QVERIFY(sampler.statistics()->n_effective >= 20.0);
      squares_m2 += (sampler.statistics()->mean.position_m - sensor.place_m).squaredNorm();
    }
    // Sixty places of three axes tell an RMS to 5 %.
    const double rms_m = std::sqrt(squares_m2 / kPlaces);
    QVERIFY2(rms_m < 1.15 * kWanted_m, qPrintable(QString::number(1e3 * rms_m)));
  }

  void aMeanThatCannotBeKnownSoWell() {
    SamplerOptions options;
    options.length = {TakeLength::Until::kStandardError, 1e-6};
    NodeSampler sampler(options);
    sampler.start();
    NoisySensor sensor(1e-3, 0.0, 2);
    int n = 0;
    while (sampler.add(sensor.next()) == TakeState::kCollecting) ++n;
    QVERIFY2(sampler.state() == TakeState::kDone, "what was collected is kept, to be judged by a person");
    QCOMPARE(n, 3600);  // 30 s at 120 a second.
    // 1 mm / sqrt(3601) = 0.017 mm.
    FT_VERIFY_MATCH(testing::holdsAll(sampler.message(), {"known to 0.017 mm", "not to 0.001 mm", "after 30 s"}));
  }

  void aTakeIsHeldWhereThatIsAskedFor() {
    SamplerOptions options;
    options.length = {TakeLength::Until::kStandardError, 1e-6};
    options.holds_at_time_limit = true;
    NodeSampler sampler(options);
    sampler.start();
    NoisySensor sensor(1e-3, 0.0, 2);
    while (sampler.add(sensor.next()) == TakeState::kCollecting) {
    }
    QVERIFY(sampler.state() == TakeState::kHeld && sampler.canKeep());
    FT_VERIFY_MATCH(testing::holdsAll(sampler.message(), {"known to 0.017 mm", "not to 0.001 mm", "after 30 s"}));
    const int collected = sampler.collected();
    sampler.add(sensor.next());
    QCOMPARE(sampler.collected(), collected);
    sampler.waitLonger();
    while (sampler.add(sensor.next()) == TakeState::kCollecting) {
    }
    QVERIFY(sampler.state() == TakeState::kHeld);
    QCOMPARE(sampler.collected(), 2 * collected);
    FT_VERIFY_MATCH(testing::holdsAll(sampler.message(), {"not to 0.001 mm", "after 60 s"}));
    sampler.keep();
    QVERIFY(sampler.state() == TakeState::kDone && !sampler.message().empty());
  }

  /// Moved since motion was looked for last, it is no take, whatever it has.
  void whatMovedAtTheEndCannotBeKept_data() {
    QTest::addColumn<int>("when");
    QTest::newRow("rests") << 1000;
    for (const int when : {18, 20, 23, 25}) QTest::addRow("moves with reading %d", when) << when;
  }
  void whatMovedAtTheEndCannotBeKept() {
    QFETCH(int, when);
    SamplerOptions options;
    options.holds_at_time_limit = true;
    NodeSampler sampler(options);
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 4);
    sensor.path_m = [when](int n) { return stepAt(n, when, 0.05); };
    // Twenty-nine readings in its 30 s: with the thirtieth motion would be looked for.
    for (int n = 0; n < 29; ++n) {
      Sample sample = sensor.next();
      sample.time_s = n * options.time_limit_s / 28.0;
      sampler.add(sample);
    }
    QVERIFY(sampler.state() == TakeState::kHeld);
    QCOMPARE(sampler.collected(), 29);
    QCOMPARE(sampler.canKeep(), when == 1000);
    QCOMPARE(testing::holdsAll(sampler.message(), {"moved", "mm at the end", "let the sensor rest"}).ok, when != 1000);
  }

  /// A take of 1.5 s that had half a second of good readings when its time was over, and a person who answers a minute
  /// later.
  void aPauseIsNoTimeOfATake() {
    SamplerOptions options;
    options.length = {TakeLength::Until::kSeconds, 1.5};
    options.holds_at_time_limit = true;
    NodeSampler sampler(options);
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 4);
    const auto next = [&](double later_s, bool is_good) {
      Sample sample = sensor.next();
      sample.time_s += later_s;
      if (!is_good) sample.status = "k";
      return sample;
    };
    while (sampler.state() == TakeState::kCollecting) {
      const Sample sample = next(0.0, true);
      if (sample.time_s > 31.0)
        sampler.add(sample);
      else
        sampler.passTime(sample.time_s);
    }
    QVERIFY(sampler.state() == TakeState::kHeld && sampler.canKeep());
    QCOMPARE(sampler.collected(), 60);
    sampler.waitLonger();
    while (sampler.add(next(60.0, true)) == TakeState::kCollecting) {
    }
    QVERIFY(sampler.state() == TakeState::kDone);
    QVERIFY2(sampler.collected() >= 180, qPrintable(QString::number(sampler.collected())));
  }

  void sixtyGoodSamplesAreAveraged() {
    NodeSampler sampler;
    QVERIFY(sampler.state() == TakeState::kIdle);
    NoisySensor sensor(1e-4, 0.0, 1);
    QVERIFY(sampler.add(sensor.next()) == TakeState::kIdle);
    sampler.start();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int n = 0; n < 60; ++n) {
      QVERIFY(sampler.state() == TakeState::kCollecting);
      QCOMPARE(sampler.collected(), n);
      const Sample sample = sensor.next();
      sum += sample.tracker_from_sensor.position_m;
      sampler.add(sample);
    }
    QVERIFY(sampler.state() == TakeState::kDone);
    QCOMPARE(sampler.samples().size(), std::size_t{60});
    QVERIFY(sampler.statistics());
    if (sampler.statistics()->n_used == 60) {
      QVERIFY(testing::near(sampler.statistics()->mean.position_m, sum / 60.0, 1e-12));
    }
    QVERIFY(testing::near(sampler.statistics()->mean.position_m, sensor.place_m, 1e-4));
    QVERIFY(sampler.add(sensor.next()) == TakeState::kDone);
    QCOMPARE(sampler.samples().size(), std::size_t{60});
  }

  void errorSamplesAreKeptButNeverAveraged() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 2);
    int n_bad = 0;
    for (int n = 0; sampler.state() == TakeState::kCollecting && n < 1000; ++n) {
      Sample sample = sensor.next();
      if (n % 3 == 0) {
        sample.status = "k";
        sample.tracker_from_sensor.position_m = {50.0, 50.0, 50.0};
        ++n_bad;
      } else if (n % 7 == 1) {
        sample.tracker_from_sensor.position_m.x() = std::nan("");
        ++n_bad;
      }
      sampler.add(sample);
    }
    QVERIFY(sampler.state() == TakeState::kDone);
    QCOMPARE(sampler.collected(), 60);
    QCOMPARE(sampler.samples().size(), std::size_t(60 + n_bad));
    QVERIFY(sampler.statistics()->n_used <= 60 && sampler.statistics()->n_used > 50);
    QVERIFY(testing::near(sampler.statistics()->mean.position_m, sensor.place_m, 1e-4));
    QCOMPARE(sampler.restarts(), 0);
  }

  void motionStartsOver_data() {
    QTest::addColumn<double>("sd_m");
    QTest::addColumn<double>("correlation");
    QTest::addColumn<int>("when");
    QTest::newRow("no noise") << 0.0 << 0.0 << 30;
    QTest::newRow("low noise") << 5e-5 << 0.0 << 30;
    QTest::newRow("low noise, correlated") << 5e-5 << 0.9 << 30;
    QTest::newRow("half a millimetre, correlated") << 5e-4 << 0.8 << 30;
    QTest::newRow("a millimetre") << 1e-3 << 0.0 << 30;
    QTest::newRow("0.7 mm, correlated") << 7e-4 << 0.5 << 30;
    QTest::newRow("in mid-block") << 5e-5 << 0.0 << 25;
    QTest::newRow("late") << 5e-5 << 0.5 << 48;
  }
  void motionStartsOver() {
    QFETCH(double, sd_m);
    QFETCH(double, correlation);
    QFETCH(int, when);
    int caught = 0;
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
      NodeSampler sampler;
      sampler.start();
      NoisySensor sensor(sd_m, correlation, seed);
      sensor.path_m = [when](int n) { return stepAt(n, when, 0.005); };
      while (sampler.state() == TakeState::kCollecting) sampler.add(sensor.next());
      QVERIFY(sampler.state() == TakeState::kDone);
      const Eigen::Vector3d moved_to_m = sensor.place_m + stepAt(when, when, 0.005);
      const bool clean = (sampler.statistics()->mean.position_m - moved_to_m).norm() < 1e-4 + 2.0 * sd_m;
      caught += sampler.restarts() == 1 && clean && sampler.samples().size() == 60;
    }
    QVERIFY2(caught >= 49, qPrintable(QString("%1 of 50 takes that moved 5 mm started over").arg(caught)));
  }

  void reasonNamesTheMotion() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(0.0, 0.0, 1);
    sensor.path_m = [](int n) { return stepAt(n, 30, 0.005); };
    while (sampler.restarts() == 0) sampler.add(sensor.next());
    QCOMPARE(sampler.message(), std::string("retaking: moved 5.0 mm"));
    QCOMPARE(sampler.collected(), 0);
  }

  void turningStartsOver() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 3);
    for (int n = 0; n < 200 && sampler.state() == TakeState::kCollecting; ++n) {
      Sample sample = sensor.next();
      if (n >= 30) sample.tracker_from_sensor.orientation = rotationFromVector({0, 0, 0.05});
      sampler.add(sample);
    }
    QCOMPARE(sampler.restarts(), 1);
    // 0.05 rad is 2.86 degrees.
    QCOMPARE(sampler.statistics()->mean.orientation.z() > 0.02, true);
  }

  void slowDriftStartsOver() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 4);
    sensor.path_m = [](int n) { return Eigen::Vector3d(0, 0, std::min(n, 90) / 60.0 * 0.004); };
    while (sampler.state() == TakeState::kCollecting) sampler.add(sensor.next());
    QVERIFY(sampler.restarts() >= 1);
    QVERIFY(sampler.state() == TakeState::kDone);
  }

  /// A jig lifted by 3 cm and set down again within a second comes back to where it was: a curve, not a shift.
  void liftingStartsOver() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 10);
    sensor.path_m = [](int n) {
      const double s = std::min(n / 120.0, 1.0);
      return Eigen::Vector3d(0, 0, 0.03 * 4 * s * (1 - s));
    };
    while (sampler.state() == TakeState::kCollecting) sampler.add(sensor.next());
    QVERIFY(sampler.restarts() >= 1);
    FT_VERIFY_MATCH(testing::near(sampler.statistics()->mean.position_m, sensor.place_m, 5e-4));
    StillnessDetector detector;
    NoisySensor lifted(1e-4, 0.0, 11);
    lifted.path_m = sensor.path_m;
    for (int n = 0; n < 120; ++n) {
      detector.add(lifted.next());
      QVERIFY2(!detector.still(), qPrintable(QString("still at reading %1").arg(n)));
    }
  }

  /// No false restart in 1,000 takes bounds the rate below 0.3 % with 95 % confidence (rule of three).
  void restingSensorNeverStartsOver_data() {
    QTest::addColumn<double>("sd_m");
    QTest::addColumn<double>("correlation");
    QTest::newRow("0.05 mm, 0.9") << 5e-5 << 0.9;
    QTest::newRow("0.5 mm, 0.5") << 5e-4 << 0.5;
    QTest::newRow("3 mm, white") << 3e-3 << 0.0;
    QTest::newRow("3 mm, 0.5") << 3e-3 << 0.5;
    QTest::newRow("3 mm, 0.8") << 3e-3 << 0.8;
    QTest::newRow("8 mm, 0.8") << 8e-3 << 0.8;
  }
  void restingSensorNeverStartsOver() {
    QFETCH(double, sd_m);
    QFETCH(double, correlation);
    int restarts = 0;
    for (std::uint64_t take = 0; take < 1000; ++take) {
      NodeSampler sampler;
      sampler.start();
      NoisySensor sensor(sd_m, correlation, 1000 + take);
      while (sampler.state() == TakeState::kCollecting) sampler.add(sensor.next());
      restarts += sampler.restarts();
    }
    QCOMPARE(restarts, 0);
  }

  void wildReadingsAreNoMotion() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 5);
    sensor.path_m = [](int n) { return n % 20 == 7 ? Eigen::Vector3d(0.05, 0, 0) : Eigen::Vector3d::Zero(); };
    while (sampler.state() == TakeState::kCollecting) sampler.add(sensor.next());
    QCOMPARE(sampler.restarts(), 0);
    QCOMPARE(sampler.statistics()->n_used, std::size_t{57});
    QVERIFY(testing::near(sampler.statistics()->mean.position_m, sensor.place_m, 1e-4));
  }

  void timeLimitFailsWithItsReason_data() {
    QTest::addColumn<QString>("what");
    QTest::addColumn<QStringList>("words");
    QTest::newRow("no signal") << "status" << QStringList{"within 30 s", "0 of 60 good samples", "reports error k"};
    QTest::newRow("never still") << "motion" << QStringList{"started over", "moved", "let the sensor rest"};
  }
  void timeLimitFailsWithItsReason() {
    QFETCH(QString, what);
    QFETCH(QStringList, words);
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 6);
    if (what == "motion") sensor.path_m = [](int n) { return stepAt(n % 40, 20, 0.02); };
    double elapsed_s = 0.0;
    while (sampler.state() == TakeState::kCollecting) {
      Sample sample = sensor.next();
      if (what == "status") sample.status = "k";
      elapsed_s = sample.time_s;
      sampler.add(sample);
    }
    QVERIFY(sampler.state() == TakeState::kFailed);
    QVERIFY(std::abs(elapsed_s - 30.0) < 2.0 / kNoisySensor_hz);
    for (const QString& word : words) {
      QVERIFY2(QString::fromStdString(sampler.message()).contains(word), sampler.message().c_str());
    }
    QVERIFY(!sampler.statistics());
  }

  void startAndCancelDropEverything() {
    NodeSampler sampler;
    sampler.start();
    NoisySensor sensor(1e-4, 0.0, 7);
    for (int n = 0; n < 25; ++n) sampler.add(sensor.next());
    sampler.cancel();
    QVERIFY(sampler.state() == TakeState::kIdle);
    QCOMPARE(sampler.collected(), 0);
    QVERIFY(sampler.samples().empty());
  }

  void stillnessIsSaidInWords_data() {
    QTest::addColumn<double>("sd_m");
    QTest::addColumn<double>("speed_m_s");
    QTest::addColumn<bool>("still");
    QTest::newRow("resting") << 1e-4 << 0.0 << true;
    QTest::newRow("resting, noisy") << 3e-3 << 0.0 << true;
    QTest::newRow("20 mm/s") << 1e-4 << 0.02 << false;
    QTest::newRow("4 mm/s") << 1e-5 << 0.004 << false;
    QTest::newRow("carried") << 1e-3 << 0.5 << false;
  }
  void stillnessIsSaidInWords() {
    QFETCH(double, sd_m);
    QFETCH(double, speed_m_s);
    QFETCH(bool, still);
    StillnessDetector detector;
    QVERIFY(!detector.still());
    QCOMPARE(detector.reason(), std::string("waiting for the tracker"));
    NoisySensor sensor(sd_m, 0.0, 8);
    sensor.path_m = [speed_m_s](int n) { return Eigen::Vector3d(0, speed_m_s * n / kNoisySensor_hz, 0); };
    for (int n = 0; n < 10; ++n) detector.add(sensor.next());
    QVERIFY2(!detector.still(), "too short to tell");
    for (int n = 0; n < 110; ++n) detector.add(sensor.next());
    QVERIFY2(detector.still() == still, detector.reason().c_str());
    if (still) {
      QCOMPARE(detector.reason(), std::string("still"));
      // 60 readings: the SD of an SD over 180 degrees of freedom is 5 %.
      QVERIFY(std::abs(detector.spread_m() / sd_m - 1.0) < 0.25);
    } else {
      QVERIFY(std::abs(detector.speed_m_s() / speed_m_s - 1.0) < 0.1);
      const QString words = QString("hold still: moving %1 mm/s").arg(std::lround(detector.speed_m_s() * 1e3));
      QCOMPARE(QString::fromStdString(detector.reason()), words);
    }
  }

  void slowTrackersAreSeenToRestToo_data() {
    QTest::addColumn<double>("rate_hz");
    for (const double rate_hz : {1.5, 2.0, 5.0, 8.0, 10.0, 25.0}) QTest::addRow("%g Hz", rate_hz) << rate_hz;
  }
  void slowTrackersAreSeenToRestToo() {
    QFETCH(double, rate_hz);
    StillnessDetector detector;
    NoisySensor sensor(1e-4, 0.0, 8);
    const int carried = 20, resting = 20;
    sensor.path_m = [&](int n) { return Eigen::Vector3d(0, 0.3 * std::min(n, carried) / rate_hz, 0); };
    std::optional<int> still_after;
    for (int n = 0; n < carried + resting; ++n) {
      Sample sample = sensor.next();
      sample.time_s = n / rate_hz;
      detector.add(sample);
      if (n <= carried) QVERIFY2(!detector.still(), qPrintable(QString::number(n)));
      if (detector.still() && !still_after) still_after = n - carried;
    }
    QVERIFY2(detector.still(), detector.reason().c_str());
    QVERIFY2(*still_after <= std::max(6.0, std::ceil(0.5 * rate_hz) + 1.0), qPrintable(QString::number(*still_after)));
  }

  /// Between the places it is not the place, however slowly it is carried: each row is ten carries of 10 s.
  void whatIsCarriedIsNeverAtRest_data() {
    QTest::addColumn<double>("rate_hz");
    QTest::addColumn<double>("speed_m_s");
    QTest::addColumn<double>("tremor_m");
    for (const double rate_hz : {7.5, 30.0, 120.0, 240.0}) {
      QTest::addRow("%g Hz, 5 cm/s", rate_hz) << rate_hz << 0.05 << 0.0;
      QTest::addRow("%g Hz, 2 cm/s", rate_hz) << rate_hz << 0.02 << 0.0;
    }
    for (const double rate_hz : {30.0, 120.0, 240.0})
      QTest::addRow("%g Hz, 5 cm/s, trembling", rate_hz) << rate_hz << 0.05 << 2e-3;
  }
  void whatIsCarriedIsNeverAtRest() {
    QFETCH(double, rate_hz);
    QFETCH(double, speed_m_s);
    QFETCH(double, tremor_m);
    int judged_still = 0;
    for (std::uint64_t run = 0; run < 10; ++run) {
      StillnessDetector detector;
      NoisySensor sensor(3e-4, 0.0, 40 + run);
      sensor.path_m = [&](int n) {
        const double time_s = n / rate_hz, turn = 2.0 * M_PI * 8.0 * time_s;
        return Eigen::Vector3d(tremor_m * std::sin(turn), speed_m_s * time_s, tremor_m * std::cos(1.1 * turn));
      };
      for (int n = 0; n < 10.0 * rate_hz; ++n) {
        Sample sample = sensor.next();
        sample.time_s = n / rate_hz;
        detector.add(sample);
        if (n % std::max(1, static_cast<int>(rate_hz / 30.0)) == 0) judged_still += detector.still() ? 1 : 0;
      }
    }
    QCOMPARE(judged_still, 0);
  }

  void aGapIsNoSlowTracker() {
    StillnessDetector detector;
    NoisySensor sensor(1e-4, 0.0, 8);
    for (int n = 0; n < 120; ++n) detector.add(sensor.next());
    QVERIFY(detector.still());
    for (int n = 0; n < 40; ++n) {
      Sample sample = sensor.next();
      sample.time_s += 0.7;
      detector.add(sample);
      QVERIFY2(!detector.still(), "what was before the gap says nothing of now");
    }
  }

  void lostSignalIsSaid() {
    StillnessDetector detector;
    NoisySensor sensor(1e-4, 0.0, 9);
    for (int n = 0; n < 120; ++n) detector.add(sensor.next());
    for (int n = 0; n < 60; ++n) {
      Sample sample = sensor.next();
      sample.status = "k";
      detector.add(sample);
    }
    QVERIFY(!detector.still());
    QCOMPARE(detector.reason(), std::string("no signal: the tracker reports error k"));
  }

  void suspicionIsSaidInWords_data() {
    QTest::addColumn<int>("rejected");
    QTest::addColumn<int>("restarts");
    QTest::addColumn<double>("spread_m");
    QTest::addColumn<QString>("expected");
    QTest::newRow("fine") << 6 << 0 << 1e-3 << "";
    QTest::newRow("rejected") << 7 << 0 << 1e-3 << "7 of 60 samples left out";
    QTest::newRow("moved") << 0 << 2 << 1e-3 << "moved twice while sampling";
    QTest::newRow("noisy") << 0 << 0 << 9e-3 << "SD 9 mm where its neighbours lead one to expect 1 mm";
    QTest::newRow("both") << 30 << 1 << 1e-3 << "30 of 60 samples left out; moved once while sampling";
  }
  void suspicionIsSaidInWords() {
    QFETCH(int, rejected);
    QFETCH(int, restarts);
    QFETCH(double, spread_m);
    QFETCH(QString, expected);
    NodeStatistics statistics;
    statistics.mean.position_m = {1.0, 0.0, 0.0};
    statistics.covariance_m2 = Eigen::Matrix3d::Identity() * spread_m * spread_m / 3.0;
    statistics.n_used = std::size_t(60 - rejected);
    statistics.rejections.resize(std::size_t(rejected));
    // Two neighbours at the same range, one at half of it: 1 mm there means 16 mm here, the median stays 1 mm.
    const std::vector<NeighbourTake> neighbours{{1e-3, 1.0}, {1e-3, 1.0}, {1e-3, 0.5}};
    QCOMPARE(QString::fromStdString(suspicionOf(statistics, restarts, neighbours)), expected);
    statistics.mean.position_m = {2.0, 0.0, 0.0};
    QVERIFY2(suspicionOf(statistics, restarts, neighbours).find("SD") == std::string::npos,
             "16 mm are to be expected at twice the range");
  }
};

FIELDTRUE_TEST(NodeSamplerTest)
#include "node_sampler_test.moc"
