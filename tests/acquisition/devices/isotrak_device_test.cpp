#include "acquisition/devices/isotrak_device.h"

#include <QTest>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/emulators/isotrak_emulator.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kHeld{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};
constexpr double kStepError_m = 5e-5;  ///< Half a step of 0.051 mm on each axis.
constexpr double kStepError_rad = 2e-4;

LineBench isotrakBench(const QByteArray& carrier, std::vector<Pose> poses, const EmulatorFaults& faults = {},
                       double speed = 1.0, const IsotrakSetup& setup = quick(IsotrakSetup{})) {
  IsotrakEmulatorOptions options;
  options.faults = faults;
  options.reset_silence_s = 0.1;
  auto source = std::make_unique<StandingSource>(std::move(poses), kIsotrakRate_hz);
  return makeLineBench<IsotrakEmulator, IsotrakStartup>(carrier, std::move(source), options, setup, speed);
}

IsotrakEmulator& isotrakOf(LineBench& bench) { return dynamic_cast<IsotrakEmulator&>(bench.emulator->tracker()); }

std::vector<Pose> isotrakPair() { return {kHeld, {{0.3, 0.2, 0.1}, Eigen::Quaterniond::Identity()}}; }

const std::vector<FaultCase>& isotrakFaults() {
  static const std::vector<FaultCase> kCases = commonFaults("Isotrak II", "isotrak", "error k");
  return kCases;
}

}  // namespace

class IsotrakDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void streamsOverEveryCarrier_data() { addCarriers(); }
  void streamsOverEveryCarrier();
  void bothSensors();
  void everyRecordKind_data();
  void everyRecordKind();
  void everyFaultIsTried();
  void isotrakMisbehaves_data() { addFaults(isotrakFaults()); }
  void isotrakMisbehaves();
  void settingsReachTheTracker();
  void onlyTheStationWanted();
  void nothingPluggedIn();
  void anotherTrackerAnswers();
  void resetsATrackerThatDoesNotAnswer();
};

void IsotrakDeviceTest::streamsOverEveryCarrier() {
  QFETCH(QByteArray, carrier);
  LineBench bench = isotrakBench(carrier, {kHeld});
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 120, qPrintable(probe.last_text), 10000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  for (const Sample& sample : probe.samples) {
    QCOMPARE(sample.status, std::string());
    QCOMPARE(sample.sensor, 0);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kHeld, kStepError_m, kStepError_rad));
  }
  FT_VERIFY_MATCH(near(probe.samples[119].time_s - probe.samples[0].time_s, 119.0 / 60.0, 0.1));
  const TableMetadata about = bench.device->describe();
  QCOMPARE(*about.rate_hz, 60.0);
  FT_VERIFY_MATCH(near(*about.quantum_m, 0.0508e-3, 0.0001e-3));
  QCOMPARE(*about.tracker, std::string("Polhemus Isotrak II 1.10"));
  QCOMPARE(about.setup.at("tracker_kind"), std::string("isotrak"));
  QCOMPARE(about.setup.at("filter"), std::string("off"));
  QCOMPARE(about.setup.at("units"), std::string("centimetres"));
  QCOMPARE(about.other.at("isotrak_hemisphere"), std::string("+x"));
  QCOMPARE(about.other.at("isotrak_hemisphere_read_back"), std::string("1.00   0.00   0.00"));
  QCOMPARE(about.other.at("isotrak_increment_read_back"), std::string("0.00"));
  QCOMPARE(about.other.at("isotrak_stations"), std::string("1"));
  QCOMPARE(about.other.count("isotrak_refused_1"), std::size_t{0});
  bench.device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  QVERIFY(!bench.emulator->tracker().streaming());
  QCOMPARE(probe.failures, 0);
}

void IsotrakDeviceTest::bothSensors() {
  const auto poses = isotrakPair();
  LineBench bench = isotrakBench("pty", poses);
  bench.device->start();
  DeviceProbe& probe = *bench.probe;
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 60, qPrintable(probe.last_text), 10000);
  for (std::size_t i = 0; i < probe.samples.size(); ++i) {
    QCOMPARE(probe.samples[i].sensor, static_cast<int>(i % 2));
    FT_VERIFY_MATCH(near(probe.samples[i].tracker_from_sensor, poses[i % 2], kStepError_m, kStepError_rad));
  }
  FT_VERIFY_MATCH(near(probe.samples[58].time_s - probe.samples[0].time_s, 29.0 / 30.0, 0.1));
  QVERIFY(probe.last_text.contains("Isotrak II 1.10, 2 stations at 30 Hz"));
}

void IsotrakDeviceTest::everyRecordKind_data() {
  QTest::addColumn<int>("number");
  QTest::addColumn<double>("tolerance_m");
  const double steps_m[] = {kStepError_m, kStepError_m, 1e-4};
  for (std::size_t i = 0; i < isotrakRecordKinds().size(); ++i) {
    QTest::newRow(isotrakRecordKinds()[i].id) << static_cast<int>(i) << steps_m[i];
  }
}

void IsotrakDeviceTest::everyRecordKind() {
  QFETCH(int, number);
  QFETCH(double, tolerance_m);
  IsotrakSetup setup = quick(IsotrakSetup{});
  setup.record = &isotrakRecordKinds()[static_cast<std::size_t>(number)];
  LineBench bench = isotrakBench("pty", isotrakPair(), {}, 1.0, setup);
  bench.device->start();
  DeviceProbe& probe = *bench.probe;
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 30, qPrintable(probe.last_text), 10000);
  for (const Sample& sample : probe.samples) {
    QCOMPARE(sample.status, std::string());
    const Pose pose = isotrakPair()[static_cast<std::size_t>(sample.sensor)];
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, pose, tolerance_m, kStepError_rad));
  }
  QCOMPARE(bench.device->describe().other.at("isotrak_record"), std::string(setup.record->id));
}

void IsotrakDeviceTest::everyFaultIsTried() { QCOMPARE(untried(isotrakFaults(), "isotrak"), std::string()); }

void IsotrakDeviceTest::isotrakMisbehaves() {
  QFETCH(int, number);
  QFETCH(QByteArray, carrier);
  const FaultCase& now = isotrakFaults()[static_cast<std::size_t>(number)];
  LineBench bench = isotrakBench(carrier, {kHeld}, *parseFaults(now.fault), 20.0);
  tryFault(bench, now, kHeld, kStepError_m, kStepError_rad);
}

void IsotrakDeviceTest::settingsReachTheTracker() {
  IsotrakSetup setup = quick(IsotrakSetup{});
  setup.hemisphere = "-z";
  setup.filter = "medium";
  const Pose below{{0.1, 0.1, -0.3}, Eigen::Quaterniond::Identity()};
  LineBench bench = isotrakBench("in process", {below}, {}, 1.0, setup);
  std::vector<EmulatedOutput> none;
  isotrakOf(bench).receive("A1,0,0,0,0,1,0,1,0,0\rB1\rI1,5\r", 0.0, none);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 10, 10000);
  QCOMPARE(isotrakOf(bench).numbers('H', 1), (std::vector{0.0, 0.0, -1.0}));
  QCOMPARE(isotrakOf(bench).numbers('x', 0), (std::vector{0.2, 0.2, 0.8, 0.95}));
  QCOMPARE(isotrakOf(bench).numbers('v', 0), (std::vector{0.2, 0.2, 0.8, 0.95}));
  QCOMPARE(isotrakOf(bench).numbers('I', 1), std::vector{0.0});
  FT_VERIFY_MATCH(near(bench.probe->samples[0].tracker_from_sensor, below, kStepError_m, kStepError_rad));
}

void IsotrakDeviceTest::onlyTheStationWanted() {
  IsotrakSetup setup = quick(IsotrakSetup{});
  setup.stations = {2};
  LineBench bench = isotrakBench("in process", isotrakPair(), {}, 1.0, setup);
  // Switched off by somebody before.
  std::vector<EmulatedOutput> none;
  isotrakOf(bench).receive("l2,0\r", 0.0, none);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 40, 10000);
  for (const Sample& sample : bench.probe->samples) QCOMPARE(sample.sensor, 1);
  QCOMPARE(bench.device->describe().other.at("isotrak_stations"), std::string("2"));
  QCOMPARE(*bench.device->describe().rate_hz, 60.0);
}

void IsotrakDeviceTest::nothingPluggedIn() {
  IsotrakSetup setup = quick(IsotrakSetup{});
  setup.stations = {2};
  LineBench bench = isotrakBench("in process", {kHeld}, {}, 1.0, setup);
  bench.device->start();
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"Isotrak II", "no receiver", "station 2"}));
}

void IsotrakDeviceTest::anotherTrackerAnswers() {
  FastrakEmulatorOptions options;
  auto source = std::make_unique<StandingSource>(isotrakPair());
  LineBench fastrak = makeLineBench<FastrakEmulatorCore, IsotrakStartup>("in process", std::move(source), options,
                                                                         quick(IsotrakSetup{}));
  fastrak.device->start();
  QTRY_COMPARE(fastrak.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(fastrak.probe->last_text.toStdString(), {"is a Fastrak", "write fastrak:the line"}));
  LineBench isotrak = makeLineBench<IsotrakEmulator, FastrakStartup>(
      "in process", std::make_unique<StandingSource>(isotrakPair()), IsotrakEmulatorOptions{}, quick(FastrakSetup{}));
  isotrak.device->start();
  QTRY_COMPARE(isotrak.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(isotrak.probe->last_text.toStdString(), {"is an Isotrak II", "write isotrak:the line"}));
}

void IsotrakDeviceTest::resetsATrackerThatDoesNotAnswer() {
  LineBench bench = isotrakBench("in process", {kHeld});
  std::vector<EmulatedOutput> none;
  isotrakOf(bench).receive("\x19", bench.emulator->time_s() + 2.5, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->state == DeviceState::kRunning, qPrintable(bench.probe->last_text), 15000);
  QVERIFY(bench.probe->texts.join('\n').contains("restarting the tracker"));
}

FIELDTRUE_TEST(IsotrakDeviceTest)
#include "isotrak_device_test.moc"
