#include "acquisition/devices/fastrak_device.h"

#include <QTemporaryDir>
#include <QTest>
#include <algorithm>

#include "acquisition/emulators/fastrak_emulator.h"
#include "acquisition/emulators/pty_endpoint.h"
#include "calib/core/statistics.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};

LineTimings quick() {
  LineTimings timings;
  timings.settle_ms = 20;
  timings.clear_ms = 5;
  timings.command_ms = 1;
  timings.quiet_ms = 20;
  timings.drain_most_ms = 300;
  timings.reply_ms = 800;
  timings.reset_ms = 300;
  timings.lock_ms = 1000;
  timings.silence_ms = 750;
  timings.stop_quiet_ms = 30;
  return timings;
}

FastrakSetup quickSetup(const QString& where = "the line") {
  FastrakSetup setup;
  setup.where = where.toStdString();
  setup.device_text = "fastrak:" + where.toStdString();
  setup.timings = quick();
  return setup;
}

/// An emulated Fastrak on one of the carriers, with the device that drives it.
struct Bench {
  std::unique_ptr<QTemporaryDir> folder = std::make_unique<QTemporaryDir>();
  std::unique_ptr<EmulatorRunner> emulator;
  std::unique_ptr<LineDevice> device;
  std::unique_ptr<DeviceProbe> probe;

  FastrakEmulatorCore& core() { return dynamic_cast<FastrakEmulatorCore&>(emulator->tracker()); }
};

Bench makeBench(const QByteArray& carrier, std::vector<Pose> poses, EmulatorFaults faults = {}, double speed = 1.0,
                const FastrakSetup& setup = quickSetup()) {
  Bench bench;
  FastrakEmulatorOptions options;
  options.faults = faults;
  options.reset_silence_s = 0.1;
  auto source = std::make_unique<StandingSource>(std::move(poses));
  LineDevice::TransportFactory make_line;
  if (carrier == "in process") {
    auto ends = LoopbackTransport::pair();
    bench.emulator = emulatorOnLine<FastrakEmulatorCore>(std::move(source), std::move(ends.second), options, speed);
    auto host = std::make_shared<std::unique_ptr<Transport>>(std::move(ends.first));
    make_line = [host]() -> Result<std::unique_ptr<Transport>> { return std::move(*host); };
  } else {
    std::unique_ptr<EmulatorEndpoint> endpoint;
    if (carrier == "tcp") {
      endpoint = std::make_unique<TcpEndpoint>(quint16{0});
    } else {
      endpoint = std::make_unique<PtyEndpoint>(bench.folder->filePath("tracker"));
    }
    auto core = std::make_unique<FastrakEmulatorCore>(std::move(source), options);
    bench.emulator = std::make_unique<EmulatorRunner>(std::move(core), std::move(endpoint), faults, speed);
  }
  FT_CHECK(bench.emulator->start().has_value());
  if (!make_line) {
    const std::string address = bench.emulator->endpoint().address().toStdString();
    make_line = [address] { return makeTransport(address); };
  }
  bench.device = makeLineDevice<FastrakStartup>(setup, std::move(make_line), speed);
  bench.probe = std::make_unique<DeviceProbe>(*bench.device);
  return bench;
}

/// A line whose bytes only make sense at one rate.
class RatedLine : public BufferedTransport {
 public:
  RatedLine(std::unique_ptr<LoopbackTransport> inner, int right_baud, int baud)
      : inner_(std::move(inner)), right_baud_(right_baud), baud_(baud) {
    connect(inner_.get(), &QIODevice::readyRead, this, [this] {
      const QByteArray bytes = inner_->readAll();
      received(baud_ == right_baud_ ? bytes : QByteArray(bytes.size(), '\xF8'));
    });
  }
  Result<void> openLine() override {
    openDevice();
    return inner_->openLine();
  }
  bool setBaud(int baud) override {
    baud_ = baud;
    return true;
  }

 protected:
  qint64 writeData(const char* from, qint64 size) override {
    inner_->write(baud_ == right_baud_ ? QByteArray(from, size) : QByteArray(size, '\xFE'));
    return size;
  }

 private:
  std::unique_ptr<LoopbackTransport> inner_;
  int right_baud_;
  int baud_;
};

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

void FastrakDeviceTest::streamsOverEveryCarrier_data() {
  QTest::addColumn<QByteArray>("carrier");
  for (const char* carrier : {"in process", "pty", "tcp"}) QTest::newRow(carrier) << QByteArray(carrier);
}

void FastrakDeviceTest::streamsOverEveryCarrier() {
  QFETCH(QByteArray, carrier);
  Bench bench = makeBench(carrier, {kPose});
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QCOMPARE(probe.state, DeviceState::kConnecting);
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 120, qPrintable(probe.last_text), 10000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  double last_s = 0.0;
  for (const auto& sample : probe.samples) {
    QCOMPARE(sample.status, std::string());
    QCOMPARE(sample.sensor, 0);
    QVERIFY(sample.time_s > last_s);
    last_s = sample.time_s;
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kPose, 1e-7, 2e-6));
  }
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
  Bench bench = makeBench("in process", poses);
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

namespace {

struct FaultCase {
  const char* fault;
  bool fails;
  QList<QByteArray> sentence;
};

const std::vector<FaultCase>& faultCases() {
  static const std::vector<FaultCase> kCases = {
      {"garbage_at_open", false, {"Fastrak"}},
      {"lost_bytes", false, {"Fastrak"}},
      {"split_writes", false, {"Fastrak"}},
      {"error_status", false, {"Station 1", "too low"}},
      {"hemisphere_flip", false, {"Station 1", "hemisphere"}},
      {"wrong_baud", true, {"not Fastrak records", "try 19200", "fastrak:the line@19200"}},
      {"unplug_after=100", true, {"unplugged"}},
      {"silence", true, {"No answer", "switched on", "cable"}},
      {"already_streaming", false, {"Fastrak"}},
      {"slow_reply", false, {"Fastrak"}},
      {"outliers", false, {"Fastrak"}},
  };
  return kCases;
}

}  // namespace

void FastrakDeviceTest::everyFaultIsTried() {
  for (const auto& known : emulatorFaults()) {
    const bool tried = std::any_of(faultCases().begin(), faultCases().end(), [&](const FaultCase& c) {
      return QByteArray(c.fault).startsWith(QByteArray::fromStdString(known.id));
    });
    QVERIFY2(tried, known.id.c_str());
  }
}

void FastrakDeviceTest::faults_data() {
  QTest::addColumn<QByteArray>("fault");
  QTest::addColumn<bool>("fails");
  QTest::addColumn<QList<QByteArray>>("sentence");
  for (const auto& c : faultCases()) QTest::newRow(c.fault) << QByteArray(c.fault) << c.fails << c.sentence;
}

void FastrakDeviceTest::faults() {
  QFETCH(QByteArray, fault);
  QFETCH(bool, fails);
  QFETCH(QList<QByteArray>, sentence);
  constexpr double kSpeed = 20.0;
  constexpr std::size_t kSamples = 700;
  Bench bench = makeBench("in process", {kPose}, *parseFaults(fault.toStdString()), kSpeed);
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(fails ? probe.state == DeviceState::kFailed : probe.good().size() >= kSamples,
                            qPrintable(probe.last_text), 20000);
  QCOMPARE(probe.failures, fails ? 1 : 0);
  const QString said = fails ? probe.last_text : probe.texts.join('\n');
  FT_VERIFY_MATCH(holdsAll(said.toStdString(), sentence));
  if (fails) {
    QVERIFY(!probe.last_text.contains('\n'));
    QTest::qWait(50);
    QCOMPARE(probe.failures, 1);
  }
  // Nothing wrong can be averaged: what carries no status is right, or falls to the outlier test.
  const auto good = probe.good();
  if (good.empty()) return;
  if (fault == "outliers") {
    const auto statistics = averageSamples(good);
    FT_VERIFY_OK(statistics);
    QVERIFY(!statistics->rejections.empty());
    FT_VERIFY_MATCH(near(statistics->mean, kPose, 1e-6, 1e-5));
    return;
  }
  for (const auto& sample : good) FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kPose, 1e-6, 1e-5));
  const bool marks = fault == "error_status" || fault == "hemisphere_flip";
  if (marks) QVERIFY(good.size() < probe.samples.size());
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
  Bench bench = makeBench("pty", {kPose});
  auto other = makeTransport(bench.emulator->endpoint().address().toStdString());
  FT_VERIFY_OK((*other)->openLine());
  bench.device->start();
  QCOMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"busy", "process"}));
}

void FastrakDeviceTest::nothingPluggedIn() {
  FastrakSetup setup = quickSetup();
  setup.stations = {3, 4};
  Bench bench = makeBench("in process", {kPose}, {}, 1.0, setup);
  bench.device->start();
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"no receiver", "station 3+4"}));
}

void FastrakDeviceTest::resetsATrackerThatDoesNotAnswer() {
  Bench bench = makeBench("in process", {kPose});
  // Within the silence after a restart nothing is answered.
  std::vector<EmulatedOutput> none;
  bench.core().receive("\x19", bench.emulator->time_s() + 2.5, none);
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(bench.probe->state == DeviceState::kRunning, qPrintable(bench.probe->last_text), 15000);
  QVERIFY(bench.probe->texts.join('\n').contains("restarting the tracker"));
}

void FastrakDeviceTest::goesSilent() {
  Bench bench = makeBench("in process", {kPose});
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
  std::vector<EmulatedOutput> none;
  bench.core().receive("c", bench.emulator->time_s(), none);
  QTRY_COMPARE(bench.probe->state, DeviceState::kFailed);
  FT_VERIFY_MATCH(holdsAll(bench.probe->last_text.toStdString(), {"gone silent", "power", "cable"}));
}

void FastrakDeviceTest::settingsReachTheTracker() {
  FastrakSetup setup = quickSetup();
  setup.hemisphere = "-z";
  setup.filter = "medium";
  Bench bench = makeBench("in process", {{{0.1, 0.1, -0.3}, Eigen::Quaterniond::Identity()}}, {}, 1.0, setup);
  std::vector<EmulatedOutput> none;
  bench.core().receive("I1,5\rA1,0,0,0,0,1,0,1,0,0\rB1\r", 0.0, none);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 10, 10000);
  QCOMPARE(bench.core().numbers('H', 1), (std::vector{0.0, 0.0, -1.0}));
  QCOMPARE(bench.core().numbers('x', 0), (std::vector{0.2, 0.2, 0.8, 0.95}));
  QCOMPARE(bench.core().numbers('I', 1), std::vector{0.0});
  QCOMPARE(bench.core().status().compensation, false);
  FT_VERIFY_MATCH(near(bench.probe->samples[0].tracker_from_sensor, {{0.1, 0.1, -0.3}, Eigen::Quaterniond::Identity()},
                       1e-7, 1e-6));
  QCOMPARE(bench.device->describe().other.at("fastrak_filter"), std::string("medium"));
}

void FastrakDeviceTest::stopsWhileConnecting() {
  for (const int after_ms : {0, 10, 30, 60}) {
    Bench bench = makeBench("in process", {kPose});
    bench.device->start();
    QTest::qWait(after_ms);
    bench.device->stop();
    bench.device->stop();
    QTRY_COMPARE(bench.probe->state, DeviceState::kClosed);
    QCOMPARE(bench.probe->failures, 0);
  }
}

void FastrakDeviceTest::goesAwayWhileStreaming() {
  Bench bench = makeBench("pty", {kPose});
  bench.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(bench.probe->state, DeviceState::kRunning, 10000);
  bench.device.reset();
  QTRY_VERIFY(!bench.emulator->tracker().streaming());
}

void FastrakDeviceTest::startsAgainAfterFailure() {
  Bench bench = makeBench("pty", {kPose});
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
