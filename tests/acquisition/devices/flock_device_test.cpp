#include "acquisition/devices/flock_device.h"

#include <QTest>

#include "acquisition/emulators/flock_emulator.h"
#include "calib/core/units.h"
#include "tests/acquisition/devices/line_bench.h"
#include "tests/acquisition/emulators/shaking_source.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

FlockEmulatorCore& flockOf(LineBench& bench) { return dynamic_cast<FlockEmulatorCore&>(bench.emulator->tracker()); }

const Pose kBirdPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};
/// Half a step of the 36 in range, per axis, and the tremble.
constexpr double kNear_m = 1.7321 * (0.0559e-3 + ShakingSource::kTremble_m);
constexpr double kNear_rad = 5e-4;

FlockSetup quickFlock() {
  FlockSetup setup = quick(FlockSetup{});
  setup.pulse_ms = 5;
  setup.boot_ms = 20;
  setup.configure_ms = 50;
  return setup;
}

LineBench makeFlockBench(const QByteArray& carrier, std::vector<Pose> poses, const FlockEmulatorOptions& options = {},
                         double speed = 1.0, const FlockSetup& setup = quickFlock()) {
  auto source = std::make_unique<ShakingSource>(std::move(poses), options.rate_hz);
  return makeLineBench<FlockEmulatorCore, FlockStartup>(carrier, std::move(source), options, setup, speed);
}

std::vector<Pose> rowOfBirds(int birds) {
  std::vector<Pose> poses;
  for (int i = 0; i < birds; ++i) poses.push_back({{0.3, 0.1 * i, 0.0}, Eigen::Quaterniond::Identity()});
  return poses;
}

std::vector<FaultCase> flockFaults() {
  std::vector<FaultCase> cases = commonFaults("Flock of Birds", "flock", "too low");
  for (FaultCase& one : cases) {
    // Its records carry no mark: a bird that cannot be measured says what it said, and that is dropped.
    if (one.fault == "error_status") one = {"error_status", false, {"Flock of Birds"}};
    if (one.fault == "hemisphere_flip") one.says = {"Bird 1", "hemisphere"};
  }
  cases.push_back({"repeats", false, {"Flock of Birds"}});
  cases.push_back({"stuck", false, {"Bird 1", "again and again", "saturated"}, true});
  return cases;
}

/// Notes what is done to RTS, on a line that has a rate.
class ModemLine : public BufferedTransport {
 public:
  ModemLine(std::unique_ptr<LoopbackTransport> inner, std::vector<bool>& rts) : inner_(std::move(inner)), rts_(rts) {
    connect(inner_.get(), &QIODevice::readyRead, this, [this] { received(inner_->readAll()); });
  }
  Result<void> openLine() override {
    openDevice();
    return inner_->openLine();
  }
  bool setBaud(int) override { return true; }
  void setRequestToSend(bool on) override { rts_.push_back(on); }

 protected:
  qint64 writeData(const char* from, qint64 size) override { return inner_->write(from, size); }

 private:
  std::unique_ptr<LoopbackTransport> inner_;
  std::vector<bool>& rts_;
};

}  // namespace

class FlockDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void streamsOverEveryCarrier_data();
  void streamsOverEveryCarrier();
  void severalBirds();
  void oneBirdOfMany();
  void extendedRange();
  void standaloneBird();
  void everyRecord_data();
  void everyRecord();
  void everyConvention_data();
  void everyConvention();
  void isFound();
  void everyFaultIsTried();
  void faults_data();
  void faults();
  void resetsByRts();
  void settingsReachTheBirds();
  void tellsAnError();
  void nothingPluggedIn();
  void stopsWhileConnecting();
};

void FlockDeviceTest::streamsOverEveryCarrier_data() { addCarriers(); }

void FlockDeviceTest::streamsOverEveryCarrier() {
  QFETCH(QByteArray, carrier);
  LineBench bench = makeFlockBench(carrier, {kBirdPose});
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 104, qPrintable(probe.last_text), 15000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  checkStanding(probe.samples, kBirdPose, kNear_m, kNear_rad);
  FT_VERIFY_MATCH(near(probe.samples[103].time_s - probe.samples[0].time_s, 103.0 / 103.3, 0.15));
  const TableMetadata about = bench.device->describe();
  FT_VERIFY_MATCH(near(*about.rate_hz, 103.3, 0.05));
  FT_VERIFY_MATCH(near(*about.quantum_m, 914.4e-3 / 8192.0, 1e-12));
  QCOMPARE(*about.excitation, std::string("pulsed_dc"));
  QVERIFY(about.tracker->find("6DFOB 3.67") != std::string::npos);
  QCOMPARE(about.other.at("flock_filter"), std::string("off"));
  QCOMPARE(about.other.at("flock_range_in"), std::string("36"));
  QCOMPARE(about.other.at("flock_hemisphere"), std::string("+x"));
  bench.device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  QVERIFY(!bench.emulator->tracker().streaming());
  QCOMPARE(probe.failures, 0);
}

void FlockDeviceTest::severalBirds() {
  LineBench bench = makeFlockBench("in process", rowOfBirds(4));
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 120, qPrintable(bench.probe->last_text), 15000);
  QVERIFY(flockOf(bench).configured() && flockOf(bench).group());
  const auto& samples = bench.probe->samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    QCOMPARE(samples[i].sensor, static_cast<int>(i % 4));
    FT_VERIFY_MATCH(near(samples[i].tracker_from_sensor.position_m, rowOfBirds(4)[i % 4].position_m, kNear_m));
  }
  // Every bird has the whole rate.
  FT_VERIFY_MATCH(near(*bench.device->describe().rate_hz, 103.3, 0.05));
  QCOMPARE(bench.device->describe().other.at("flock_stations"), std::string("1+2+3+4"));
}

void FlockDeviceTest::oneBirdOfMany() {
  FlockSetup setup = quickFlock();
  setup.stations = {2};
  LineBench bench = makeFlockBench("in process", rowOfBirds(3), {}, 1.0, setup);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 30, qPrintable(bench.probe->last_text), 15000);
  for (const Sample& sample : bench.probe->samples) {
    QCOMPARE(sample.sensor, 1);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m, rowOfBirds(3)[1].position_m, kNear_m));
  }
}

void FlockDeviceTest::extendedRange() {
  FlockEmulatorOptions options;
  options.extended_range = true;
  const Pose far{{2.5, -1.0, 0.5}, Eigen::Quaterniond::Identity()};
  LineBench bench = makeFlockBench("in process", {far}, options);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 30, qPrintable(bench.probe->last_text), 15000);
  for (const Sample& sample : bench.probe->samples) {
    // The controller has address 1: the first bird is the first sensor all the same.
    QCOMPARE(sample.sensor, 0);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m, far.position_m, 1e-3));
  }
  QCOMPARE(bench.device->describe().other.at("flock_range_in"), std::string("144"));
}

void FlockDeviceTest::standaloneBird() {
  FlockEmulatorOptions options;
  options.standalone = true;
  LineBench bench = makeFlockBench("in process", {kBirdPose}, options);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 30, qPrintable(bench.probe->last_text), 15000);
  QVERIFY(!flockOf(bench).group());
  QCOMPARE(bench.device->describe().other.at("flock_addressing"), std::string("standalone"));
}

void FlockDeviceTest::everyRecord_data() {
  QTest::addColumn<QByteArray>("record");
  for (const FlockMode& mode : flockModes()) {
    if (mode.position) QTest::newRow(mode.id) << QByteArray(mode.id);
  }
}

void FlockDeviceTest::everyRecord() {
  QFETCH(QByteArray, record);
  FlockSetup setup = quickFlock();
  setup.record = record.toStdString();
  LineBench bench = makeFlockBench("in process", {kBirdPose, kBirdPose}, {}, 1.0, setup);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 30, qPrintable(bench.probe->last_text), 15000);
  const bool turns = findFlockMode(setup.record)->orientation != FlockOrientation::kNone;
  for (const Sample& sample : bench.probe->samples) {
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m, kBirdPose.position_m, kNear_m));
    if (turns) FT_VERIFY_MATCH(near(sample.tracker_from_sensor.orientation, kBirdPose.orientation, kNear_rad));
  }
}

void FlockDeviceTest::everyConvention_data() {
  QTest::addColumn<QByteArray>("setting");
  QTest::addColumn<QByteArray>("value");
  for (const auto& [setting, value] : {std::pair{"quaternion", "inverted"},
                                       {"matrix", "columns"},
                                       {"mirrored", "x"},
                                       {"mirrored", "y"},
                                       {"mirrored", "z"}}) {
    QTest::addRow("%s=%s", setting, value) << QByteArray(setting) << QByteArray(value);
  }
}

void FlockDeviceTest::everyConvention() {
  QFETCH(QByteArray, setting);
  QFETCH(QByteArray, value);
  // A firmware of the other convention is read right once the setting says so, and wrong without.
  FlockEmulatorOptions options;
  if (setting == "quaternion") options.conventions.inverted_quaternion = true;
  if (setting == "matrix") options.conventions.matrix_by_columns = true;
  if (setting == "mirrored") options.conventions.mirrored = value[0];
  for (const bool told : {true, false}) {
    FlockSetup setup = quickFlock();
    setup.record = setting == "matrix" ? "position_matrix" : "position_quaternion";
    if (told) setup.conventions = options.conventions;
    LineBench bench = makeFlockBench("in process", {kBirdPose}, options, 1.0, setup);
    bench.device->start();
    QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() >= 5, qPrintable(bench.probe->last_text), 15000);
    const Pose& seen = bench.probe->samples[0].tracker_from_sensor;
    QCOMPARE(bool(near(seen, kBirdPose, kNear_m, kNear_rad)), told);
  }
}

void FlockDeviceTest::isFound() {
  const TrackerProbe probe = flockProbe();
  QCOMPARE(probe.ask, std::string("O\x0F"));
  QVERIFY(probe.drops_rts);
  QCOMPARE(probe.answer("6DFOB     ")->model, std::string("Ascension Flock of Birds 6DFOB"));
  for (const char* other :
       {"", "6DFOB", "OKAYA896\r", "21S3F00000", "ABCDEFGHIJ", "\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF"}) {
    QVERIFY2(!probe.answer(other), other);
  }
  // Its stream by the phasing bit: 14 bytes and an address.
  FlockLayout layout;
  layout.mode = findFlockMode("position_quaternion");
  layout.group = true;
  std::string stream = encodeFlockRecord(1, kBirdPose, layout).substr(5);
  for (int i = 0; i < 5; ++i) stream += encodeFlockRecord(1 + i % 2, kBirdPose, layout);
  QVERIFY(probe.stream(stream));
  QVERIFY(!probe.stream(stream.substr(0, 30)));
  QVERIFY(!probe.stream(std::string(100, '\x80')));
  QVERIFY(!probe.stream("01   10.00  -5.00   2.50  30.00  10.00 -20.00\r\n"));
}

void FlockDeviceTest::everyFaultIsTried() { QCOMPARE(untried(flockFaults(), "flock"), std::string()); }

void FlockDeviceTest::faults_data() { addFaults(flockFaults()); }

void FlockDeviceTest::faults() {
  QFETCH(int, number);
  QFETCH(QByteArray, carrier);
  const FaultCase now = flockFaults()[static_cast<std::size_t>(number)];
  const std::string& fault = now.fault;
  constexpr double kSpeed = 10.0;
  FlockEmulatorOptions options;
  options.faults = *parseFaults(fault, "flock");
  LineBench bench = makeFlockBench(carrier, {kBirdPose}, options, kSpeed);
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  const std::size_t enough = fault == "stuck" ? 250 : 700;
  const auto done = [&] {
    if (now.fails) return probe.state == DeviceState::kFailed;
    return probe.good().size() >= enough && (fault != "stuck" || probe.samples.back().status == kStatusStuck);
  };
  QTRY_VERIFY2_WITH_TIMEOUT(done(), qPrintable(probe.last_text), 20000);
  QCOMPARE(probe.failures, now.fails ? 1 : 0);
  const QString said = now.fails ? probe.last_text : probe.texts.join('\n');
  FT_VERIFY_MATCH(holdsAll(said.toStdString(), now.says));
  const auto good = probe.good();
  checkGood(good, now, kBirdPose, kNear_m, kNear_rad);
  // A bird that says the same twice has not measured twice.
  for (std::size_t i = 1; fault == "repeats" && i < good.size(); ++i) {
    QVERIFY(good[i].tracker_from_sensor.position_m != good[i - 1].tracker_from_sensor.position_m);
  }
  if (now.marks_readings) QVERIFY(good.size() < probe.samples.size());
}

void FlockDeviceTest::resetsByRts() {
  for (const bool may_reset : {true, false}) {
    auto ends = LoopbackTransport::pair();
    const FlockEmulatorOptions options;
    auto emulator = emulatorOnLine<FlockEmulatorCore>(
        std::make_unique<ShakingSource>(std::vector{kBirdPose}, options.rate_hz), std::move(ends.second), options);
    FT_VERIFY_OK(emulator->start());
    auto inner = std::make_shared<std::unique_ptr<LoopbackTransport>>(std::move(ends.first));
    std::vector<bool> rts;
    FlockSetup setup = quickFlock();
    setup.may_reset = may_reset;
    const auto device = makeLineDevice<FlockStartup>(setup, [&]() -> Result<std::unique_ptr<Transport>> {
      return std::make_unique<ModemLine>(std::move(*inner), rts);
    });
    DeviceProbe probe(*device);
    device->start();
    QTRY_VERIFY2_WITH_TIMEOUT(probe.state == DeviceState::kRunning, qPrintable(probe.last_text), 10000);
    // High holds the bird in reset: it ends low in any case.
    QCOMPARE(rts, (std::vector<bool>{true, false}));
  }
}

void FlockDeviceTest::settingsReachTheBirds() {
  FlockSetup setup = quickFlock();
  setup.hemisphere = "-z";
  setup.filter = "on";
  setup.range = "72";
  std::vector<Pose> poses(2, {{1.2, 0.1, -0.3}, Eigen::Quaterniond::Identity()});
  LineBench bench = makeFlockBench("in process", poses, {}, 1.0, setup);
  std::vector<EmulatedOutput> none;
  flockOf(bench).receive(flock::toBird(2, std::string("q\0\0\0\0\0\x20", 7)), 0.0, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() > 10, qPrintable(bench.probe->last_text), 15000);
  for (const int bird : {1, 2}) {
    QCOMPARE(flockOf(bench).parameter(flock_parameter::kHemisphere, bird), (std::string{'\x0C', '\1'}));
    QCOMPARE(flockOf(bench).parameter(flock_parameter::kFilters, bird), std::string(2, '\0'));
    QCOMPARE(flockOf(bench).parameter(flock_parameter::kAngleAlign, bird), std::string(6, '\0'));
    QCOMPARE(flockOf(bench).parameter(flock_parameter::kScale, bird), (std::string{'\1', '\0'}));
  }
  for (const Sample& sample : bench.probe->samples) {
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, poses[0], 2.0 * kNear_m, kNear_rad));
  }
  QCOMPARE(bench.device->describe().other.at("flock_range_in"), std::string("72"));
}

void FlockDeviceTest::tellsAnError() {
  // A command it does not know is noted; a flock that is not there is told at once.
  LineBench bench = makeFlockBench("in process", {kBirdPose});
  std::vector<EmulatedOutput> none;
  flockOf(bench).receive("z", 0.0, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->samples.size() > 10, qPrintable(bench.probe->last_text), 15000);
  QCOMPARE(bench.device->describe().other.at("flock_error_before"), std::string("a command was not understood"));
  QVERIFY(!bench.device->describe().other.contains("flock_refused_1"));
}

void FlockDeviceTest::nothingPluggedIn() {
  FlockSetup setup = quickFlock();
  setup.stations = {3};
  LineBench bench = makeFlockBench("in process", rowOfBirds(2), {}, 1.0, setup);
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kFailed, 10000);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"no receiver", "3"}));
}

void FlockDeviceTest::stopsWhileConnecting() {
  checkStopsWhileConnecting([] { return makeFlockBench("in process", rowOfBirds(2)); });
}

FIELDTRUE_TEST(FlockDeviceTest)
#include "flock_device_test.moc"
