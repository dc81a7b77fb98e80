#include "acquisition/devices/fastrak_device.h"

#include <QTest>

#include "acquisition/emulators/fastrak_emulator.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/acquisition/devices/rated_line.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};

FastrakSetup quickSetup(const QString& where = "the line") { return quick(FastrakSetup{}, where); }

LineBench makeBench(const QByteArray& carrier, std::vector<Pose> poses, EmulatorFaults faults = {}, double speed = 1.0,
                    const FastrakSetup& setup = quickSetup()) {
  FastrakEmulatorOptions options;
  options.faults = faults;
  options.reset_silence_s = 0.1;
  return makeLineBench<FastrakEmulatorCore, FastrakStartup>(carrier, std::make_unique<StandingSource>(std::move(poses)),
                                                            options, setup, speed);
}

FastrakEmulatorCore& coreOf(LineBench& bench) { return dynamic_cast<FastrakEmulatorCore&>(bench.emulator->tracker()); }

const std::vector<FaultCase>& faultCases() {
  static const std::vector<FaultCase> kCases = commonFaults("Fastrak", "fastrak", "too low");
  return kCases;
}

}  // namespace

class FastrakDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void streamsOverEveryCarrier_data();
  void streamsOverEveryCarrier();
  void severalStations();
  void everyFaultIsTried();
  void faults_data();
  void faults();
  void findsTheRate();
  void portDoesNotExist();
  void portIsBusy();
  void nothingPluggedIn();
  void resetsATrackerThatDoesNotAnswer();
  void goesSilent();
  void settingsReachTheTracker();
  void stopsWhileConnecting();
  void goesAwayWhileStreaming();
  void startsAgainAfterFailure();
};

void FastrakDeviceTest::streamsOverEveryCarrier_data() { addCarriers(); }

void FastrakDeviceTest::streamsOverEveryCarrier() {
  QFETCH(QByteArray, carrier);
  LineBench bench = makeBench(carrier, {kPose});
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QCOMPARE(probe.state, DeviceState::kConnecting);
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 120, qPrintable(probe.last_text), 10000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  checkStanding(probe.samples, kPose, 1e-7, 2e-6);
  const double span_s = probe.samples[119].time_s - probe.samples[0].time_s;
  FT_VERIFY_MATCH(near(span_s, 119.0 / 120.0, 0.15));

  const TableMetadata about = bench.device->describe();
  QCOMPARE(*about.rate_hz, 120.0);
  QVERIFY(about.tracker->find("Fastrak G1.02") != std::string::npos);
  QCOMPARE(about.other.at("fastrak_filter"), std::string("off"));
  QCOMPARE(about.other.at("fastrak_compensation"), std::string("off"));
  QCOMPARE(about.other.at("fastrak_units"), std::string("centimetres"));
  QCOMPARE(about.other.at("fastrak_increment_read_back"), std::string("0.00"));
  QVERIFY(about.other.contains("fastrak_position_envelope_read_back"));

  bench.device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  QVERIFY(!bench.emulator->tracker().streaming());
  QVERIFY(probe.bytes_sent.endsWith("Cc"));
  QCOMPARE(probe.failures, 0);
}

void FastrakDeviceTest::severalStations() {
  std::vector<Pose> poses;
  for (int i = 0; i < 3; ++i) poses.push_back({{0.3, 0.1 * i, 0.0}, Eigen::Quaterniond::Identity()});
  LineBench bench = makeBench("in process", poses);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() >= 90, 10000);
  const auto& samples = bench.probe->samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    QCOMPARE(samples[i].sensor, static_cast<int>(i % 3));
    FT_VERIFY_MATCH(near(samples[i].tracker_from_sensor.position_m, poses[i % 3].position_m, 1e-7));
  }
  QCOMPARE(*bench.device->describe().rate_hz, 40.0);
  QCOMPARE(bench.device->describe().other.at("fastrak_stations"), std::string("1+2+3"));
}

void FastrakDeviceTest::everyFaultIsTried() { QCOMPARE(untried(faultCases(), "fastrak"), std::string()); }

void FastrakDeviceTest::faults_data() { addFaults(faultCases()); }

void FastrakDeviceTest::faults() {
  QFETCH(int, number);
  QFETCH(QByteArray, carrier);
  constexpr double kSpeed = 20.0;
  const FaultCase& now = faultCases()[static_cast<std::size_t>(number)];
  LineBench bench = makeBench(carrier, {kPose}, *parseFaults(now.fault), kSpeed);
  tryFault(bench, now, kPose, 1e-6, 1e-5);
}

void FastrakDeviceTest::findsTheRate() {
  auto ends = LoopbackTransport::pair();
  auto emulator = emulatorOnLine<FastrakEmulatorCore>(std::make_unique<StandingSource>(std::vector{kPose}),
                                                      std::move(ends.second), FastrakEmulatorOptions{});
  FT_VERIFY_OK(emulator->start());
  auto inner = std::make_shared<std::unique_ptr<LoopbackTransport>>(std::move(ends.first));
  FastrakSetup setup = quickSetup("/dev/ttyUSB0");
  setup.timings.reply_ms = 100;
  const auto device = makeLineDevice<FastrakStartup>(setup, [inner]() -> Result<std::unique_ptr<Transport>> {
    return std::make_unique<RatedLine>(std::move(*inner), 19200, 115200);
  });
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.state == DeviceState::kRunning, qPrintable(probe.last_text), 10000);
  FT_VERIFY_MATCH(holdsAll(probe.last_text.toStdString(), {"found at 19200 baud", "fastrak:/dev/ttyUSB0@19200"}));
}

void FastrakDeviceTest::portDoesNotExist() {
  const auto device =
      makeLineDevice<FastrakStartup>(quickSetup("/dev/ttyUSB77"), [] { return makeTransport("/dev/ttyUSB77"); });
  DeviceProbe probe(*device);
  device->start();
  QCOMPARE(probe.state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(probe.last_text.toStdString(), {"/dev/ttyUSB77", "does not exist"}));
}

void FastrakDeviceTest::portIsBusy() {
  LineBench bench = makeBench("pty", {kPose});
  auto other = makeTransport(bench.emulator->endpoint().address().toStdString());
  FT_VERIFY_OK((*other)->openLine());
  bench.device->start();
  QCOMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"busy", "process"}));
}

void FastrakDeviceTest::nothingPluggedIn() {
  FastrakSetup setup = quickSetup();
  setup.stations = {3, 4};
  LineBench bench = makeBench("in process", {kPose}, {}, 1.0, setup);
  bench.device->start();
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"no receiver", "station 3+4"}));
}

void FastrakDeviceTest::resetsATrackerThatDoesNotAnswer() {
  LineBench bench = makeBench("in process", {kPose});
  // Within the silence after a restart nothing is answered.
  std::vector<EmulatedOutput> none;
  coreOf(bench).receive("\x19", bench.emulator->time_s() + 2.5, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->state == DeviceState::kRunning, qPrintable(bench.probe->last_text), 15000);
  QVERIFY(bench.probe->texts.join('\n').contains("restarting the tracker"));
}

void FastrakDeviceTest::goesSilent() {
  LineBench bench = makeBench("in process", {kPose});
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
  std::vector<EmulatedOutput> none;
  coreOf(bench).receive("c", bench.emulator->time_s(), none);
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"gone silent", "power", "cable"}));
}

void FastrakDeviceTest::settingsReachTheTracker() {
  FastrakSetup setup = quickSetup();
  setup.hemisphere = "-z";
  setup.filter = "medium";
  LineBench bench = makeBench("in process", {{{0.1, 0.1, -0.3}, Eigen::Quaterniond::Identity()}}, {}, 1.0, setup);
  std::vector<EmulatedOutput> none;
  coreOf(bench).receive("I1,5\rA1,0,0,0,0,1,0,1,0,0\rB1\r", 0.0, none);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 10, 10000);
  QCOMPARE(coreOf(bench).numbers('H', 1), (std::vector{0.0, 0.0, -1.0}));
  QCOMPARE(coreOf(bench).numbers('x', 0), (std::vector{0.2, 0.2, 0.8, 0.95}));
  QCOMPARE(coreOf(bench).numbers('I', 1), std::vector{0.0});
  QCOMPARE(coreOf(bench).status().compensation, false);
  FT_VERIFY_MATCH(near(bench.probe->samples[0].tracker_from_sensor, {{0.1, 0.1, -0.3}, Eigen::Quaterniond::Identity()},
                       1e-7, 1e-6));
  QCOMPARE(bench.device->describe().other.at("fastrak_filter"), std::string("medium"));
}

void FastrakDeviceTest::stopsWhileConnecting() {
  checkStopsWhileConnecting([] { return makeBench("in process", {kPose}); });
}

void FastrakDeviceTest::goesAwayWhileStreaming() {
  LineBench bench = makeBench("pty", {kPose});
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
  bench.device.reset();
  QTRY_VERIFY(!bench.emulator->tracker().streaming());
}

void FastrakDeviceTest::startsAgainAfterFailure() {
  LineBench bench = makeBench("pty", {kPose});
  auto other = makeTransport(bench.emulator->endpoint().address().toStdString());
  FT_VERIFY_OK((*other)->openLine());
  bench.device->start();
  QCOMPARE(bench.probe->state, DeviceState::kFailed);
  other->reset();
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
  bench.device->stop();
  QTRY_COMPARE(bench.probe->state, DeviceState::kClosed);
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
}

FIELDTRUE_TEST(FastrakDeviceTest)
#include "fastrak_device_test.moc"
