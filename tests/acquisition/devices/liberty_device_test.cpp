#include "acquisition/devices/liberty_device.h"

#include <QTest>
#include <fstream>
#include <map>

#include "acquisition/emulators/liberty_emulator.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kStanding{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};

LineBench libertyBench(const QByteArray& carrier, std::vector<Pose> poses, const EmulatorFaults& faults = {},
                       double speed = 1.0, const LibertySetup& setup = quick(LibertySetup{}),
                       const char* make = "liberty") {
  LibertyEmulatorOptions options(libertyMake(make));
  options.faults = faults;
  options.reset_silence_s = 0.1;
  auto source = std::make_unique<StandingSource>(std::move(poses), options.make->rate_hz);
  return makeLineBench<LibertyEmulator, LibertyStartup>(carrier, std::move(source), options, setup, speed);
}

LibertyEmulator& unitOf(LineBench& bench) { return dynamic_cast<LibertyEmulator&>(bench.emulator->tracker()); }

std::vector<Pose> inARow(int sensors) {
  std::vector<Pose> poses;
  for (int i = 0; i < sensors; ++i) poses.push_back({{0.3, 0.02 * i, 0.1}, Eigen::Quaterniond::Identity()});
  return poses;
}

const std::vector<FaultCase>& libertyFaults() {
  static const std::vector<FaultCase> kCases = commonFaults("Liberty", "liberty", "error k");
  return kCases;
}

const std::vector<FaultCase>& patriotFaults() {
  static const std::vector<FaultCase> kCases = commonFaults("Patriot", "patriot", "error k");
  return kCases;
}

/// Resident memory of this program [MB].
double resident_MB() {
  std::ifstream in("/proc/self/statm");
  long pages = 0, resident = 0;
  in >> pages >> resident;
  return static_cast<double>(resident) * 4096.0 / 1e6;
}

}  // namespace

class LibertyDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void streamsOverEveryCarrier_data() { addCarriers(); }
  void streamsOverEveryCarrier();
  void sixteenSensors();
  void patriotWithTwoSensors();
  void everyFaultIsTried();
  void libertyMisbehaves_data() { addFaults(libertyFaults()); }
  void libertyMisbehaves();
  void patriotMisbehaves_data() { addFaults(patriotFaults()); }
  void patriotMisbehaves();
  void settingsReachTheTracker();
  void onlyTheStationsWanted();
  void nothingPluggedIn();
  void anotherMakeAnswers();
  void resetsATrackerThatDoesNotAnswer();
  void noticesThatTheClockJumped();
  void anHourOfEightSensors();
};

void LibertyDeviceTest::streamsOverEveryCarrier() {
  QFETCH(QByteArray, carrier);
  LineBench bench = libertyBench(carrier, {kStanding});
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 480, qPrintable(probe.last_text), 10000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  for (std::size_t i = 0; i < 480; ++i) {
    const Sample& sample = probe.samples[i];
    QCOMPARE(sample.status, std::string());
    QCOMPARE(sample.sensor, 0);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kStanding, 1e-7, 2e-6));
    // Its own clock: whole milliseconds of 1/240 s, however busy this computer is.
    if (i > 0) FT_VERIFY_MATCH(near(sample.time_s - probe.samples[i - 1].time_s, 1.0 / 240.0, 0.0025));
  }
  FT_VERIFY_MATCH(near(probe.samples[479].time_s - probe.samples[0].time_s, 479.0 / 240.0, 0.05));
  const TableMetadata about = bench.device->describe();
  QCOMPARE(*about.rate_hz, 240.0);
  FT_VERIFY_MATCH(holdsAll(*about.tracker, {"Polhemus Liberty", "Fieldtrue Liberty emulator", "version 2.01"}));
  QCOMPARE(about.setup.at("tracker_kind"), std::string("liberty"));
  QCOMPARE(about.setup.at("filter"), std::string("off"));
  QCOMPARE(about.setup.at("units"), std::string("centimetres"));
  QCOMPARE(about.other.at("liberty_hemisphere_read_back"), std::string("1.00 0.00 0.00"));
  QCOMPARE(about.other.at("liberty_stations"), std::string("1"));
  bench.device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  QVERIFY(!bench.emulator->tracker().streaming());
  QCOMPARE(probe.failures, 0);
}

void LibertyDeviceTest::sixteenSensors() {
  const auto poses = inARow(16);
  LineBench bench = libertyBench("pty", poses);
  bench.device->start();
  DeviceProbe& probe = *bench.probe;
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 16 * 240, qPrintable(probe.last_text), 10000);
  for (std::size_t i = 0; i < probe.samples.size(); ++i) {
    QCOMPARE(probe.samples[i].sensor, static_cast<int>(i % 16));
    FT_VERIFY_MATCH(near(probe.samples[i].tracker_from_sensor.position_m, poses[i % 16].position_m, 1e-7));
    // Read together, stamped together.
    if (i % 16 != 0) QCOMPARE(probe.samples[i].time_s, probe.samples[i - 1].time_s);
  }
  QVERIFY(probe.last_text.contains("16 stations at 240 Hz"));
}

void LibertyDeviceTest::patriotWithTwoSensors() {
  LineBench bench = libertyBench("tcp", inARow(2), {}, 1.0, quick(LibertySetup(libertyMake("patriot"))), "patriot");
  bench.device->start();
  DeviceProbe& probe = *bench.probe;
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 120, qPrintable(probe.last_text), 10000);
  FT_VERIFY_MATCH(near(probe.samples[118].time_s - probe.samples[0].time_s, 59.0 / 60.0, 0.02));
  QVERIFY(probe.last_text.contains("Patriot, 2 stations at 60 Hz"));
}

void LibertyDeviceTest::everyFaultIsTried() {
  QCOMPARE(untried(libertyFaults(), "liberty"), std::string());
  QCOMPARE(untried(patriotFaults(), "patriot"), std::string());
}

void LibertyDeviceTest::libertyMisbehaves() {
  QFETCH(int, number);
  QFETCH(QByteArray, carrier);
  const FaultCase& now = libertyFaults()[static_cast<std::size_t>(number)];
  LineBench bench = libertyBench(carrier, {kStanding}, *parseFaults(now.fault), 20.0);
  tryFault(bench, now, kStanding, 1e-6, 1e-5);
}

void LibertyDeviceTest::patriotMisbehaves() {
  QFETCH(int, number);
  QFETCH(QByteArray, carrier);
  const FaultCase& now = patriotFaults()[static_cast<std::size_t>(number)];
  LineBench bench = libertyBench(carrier, {kStanding}, *parseFaults(now.fault), 20.0,
                                 quick(LibertySetup(libertyMake("patriot"))), "patriot");
  tryFault(bench, now, kStanding, 1e-6, 1e-5);
}

void LibertyDeviceTest::settingsReachTheTracker() {
  LibertySetup setup = quick(LibertySetup{});
  setup.hemisphere = "-z";
  setup.filter = "medium";
  const Pose below{{0.1, 0.1, -0.3}, Eigen::Quaterniond::Identity()};
  LineBench bench = libertyBench("in process", {below}, {}, 1.0, setup);
  std::vector<EmulatedOutput> none;
  unitOf(bench).receive("A1,0,0,0,0,1,0,1,0,0\rB1\r", 0.0, none);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 10, 10000);
  QCOMPARE(unitOf(bench).hemisphere(1), Eigen::Vector3d(0.0, 0.0, -1.0));
  QCOMPARE(unitOf(bench).filter('X'), (std::array{0.2, 0.2, 0.8, 0.95}));
  QCOMPARE(unitOf(bench).filter('Y'), (std::array{0.2, 0.2, 0.8, 0.95}));
  QVERIFY(unitOf(bench).isMetric());
  FT_VERIFY_MATCH(near(bench.probe->samples[0].tracker_from_sensor, below, 1e-7, 1e-6));
  QCOMPARE(bench.device->describe().other.at("liberty_hemisphere_read_back"), std::string("0.00 0.00 -1.00"));
}

void LibertyDeviceTest::onlyTheStationsWanted() {
  LibertySetup setup = quick(LibertySetup{});
  setup.stations = {2, 12};
  LineBench bench = libertyBench("in process", inARow(12), {}, 1.0, setup);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 40, 10000);
  for (const Sample& sample : bench.probe->samples) QVERIFY(sample.sensor == 1 || sample.sensor == 11);
  QCOMPARE(bench.device->describe().other.at("liberty_stations"), std::string("2+12"));
}

void LibertyDeviceTest::nothingPluggedIn() {
  LibertySetup setup = quick(LibertySetup{});
  setup.stations = {3};
  LineBench bench = libertyBench("in process", {kStanding}, {}, 1.0, setup);
  bench.device->start();
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"Liberty", "no receiver", "station 3"}));
}

void LibertyDeviceTest::anotherMakeAnswers() {
  LineBench bench = libertyBench("in process", {kStanding}, {}, 1.0, quick(LibertySetup{}), "patriot");
  bench.device->start();
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"is a Patriot", "write patriot:the line"}));
}

void LibertyDeviceTest::resetsATrackerThatDoesNotAnswer() {
  LineBench bench = libertyBench("in process", {kStanding});
  // Within the silence after a restart nothing is answered.
  std::vector<EmulatedOutput> none;
  unitOf(bench).receive("\x19\r", bench.emulator->time_s() + 2.5, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->state == DeviceState::kRunning, qPrintable(bench.probe->last_text), 15000);
  QVERIFY(bench.probe->texts.join('\n').contains("restarting the tracker"));
}

void LibertyDeviceTest::noticesThatTheClockJumped() {
  LineBench bench = libertyBench("in process", {kStanding});
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 240, 10000);
  std::vector<EmulatedOutput> none;
  unitOf(bench).receive("Q0\r", bench.emulator->time_s(), none);
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->last_text.contains("its clock jumped by -"), 5000);
  // The times of the samples go on.
  const auto& samples = bench.probe->samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    FT_VERIFY_MATCH(near(samples[i].time_s - samples[i - 1].time_s, 1.0 / 240.0, 0.1));
  }
}

void LibertyDeviceTest::anHourOfEightSensors() {
  constexpr std::uint64_t kSensors = 8;
  constexpr std::uint64_t kCycles = 3600 * 240;
  LibertyEmulatorOptions options;
  LibertySetup setup = quick(LibertySetup{});
  const auto now_s = std::make_shared<double>(0.0);
  LineBench bench = makeLineBench<LibertyEmulator, LibertyStartup>(
      "in process", std::make_unique<StandingSource>(inARow(kSensors), 240.0), options, setup, TrackerClock(now_s));
  bench.probe.reset();
  std::uint64_t n = 0, n_marked = 0, n_jumps = 0;
  double last_s = 0.0, first_s = 0.0, resident_after_warming_MB = 0.0;
  QString text;
  connect(bench.device.get(), &TrackerDevice::stateChanged, this, [&](DeviceState, const QString& now) { text = now; });
  connect(bench.device.get(), &TrackerDevice::samplesReceived, this, [&](const std::vector<Sample>& more) {
    for (const Sample& sample : more) {
      if (n == 0) first_s = last_s = sample.time_s;
      n_marked += sample.status.empty() ? 0 : 1;
      n_jumps += sample.time_s - last_s > 1.7 / 240.0 || sample.time_s < last_s ? 1 : 0;
      last_s = sample.time_s;
      if (sample.sensor != static_cast<int>(n++ % kSensors)) ++n_marked;
    }
    if (resident_after_warming_MB == 0.0 && n > kCycles) resident_after_warming_MB = resident_MB();
  });
  // Two seconds pass when the readings of the two before them were sent and read.
  std::uint64_t n_then = 0, sent_then = 0, sent_before = 0;
  QTimer passing;
  connect(&passing, &QTimer::timeout, this, [&] {
    const std::uint64_t sent = bench.emulator->recordsSent();
    const bool all_read = sent > sent_before && sent == sent_then && n == n_then;
    n_then = n;
    sent_then = sent;
    if (!all_read) return;
    sent_before = sent;
    *now_s += 2.0;
  });
  bench.device->start();
  passing.start(0);
  QTRY_VERIFY2_WITH_TIMEOUT(n >= kCycles * kSensors, qPrintable(text), 300000);
  // Every reading of every sensor in its order, no gap, an hour long, and no memory kept.
  QCOMPARE(n_marked, std::uint64_t{0});
  QCOMPARE(n_jumps, std::uint64_t{0});
  FT_VERIFY_MATCH(near((last_s - first_s) * 240.0 * kSensors / static_cast<double>(n), 1.0, 0.001));
  QVERIFY2(resident_MB() - resident_after_warming_MB < 10.0, qPrintable(QString::number(resident_MB())));
}

FIELDTRUE_TEST(LibertyDeviceTest)
#include "liberty_device_test.moc"
