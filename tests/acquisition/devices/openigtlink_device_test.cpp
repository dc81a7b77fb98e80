#include "acquisition/devices/openigtlink_device.h"

#include <QTcpServer>
#include <QTcpSocket>
#include <QTest>
#include <algorithm>

#include "acquisition/emulators/openigtlink_emulator.h"
#include "calib/core/statistics.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/acquisition/protocols/openigtlink_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kServedPose{{0.254, -0.127, 0.0635},
                       Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};
const Pose kSecondPose{{-0.3, 0.2, 0.1}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
constexpr double kStart_utc_s = 1.7e9;

IgtlSetup quickServerSetup() {
  IgtlSetup setup;
  setup.where = "the line";
  setup.device_text = "openigtlink:the line";
  setup.listen_ms = 150;
  setup.survey_ms = 200;
  setup.timings.silence_ms = 750;
  setup.timings.stop_quiet_ms = 30;
  return setup;
}

/// An emulated server at the other end of a line in this process, and the device.
struct ServerBench {
  std::unique_ptr<EmulatorRunner> server;
  std::unique_ptr<LineDevice> device;
  std::unique_ptr<DeviceProbe> probe;
};

ServerBench makeServerBench(std::vector<Pose> poses, EmulatorFaults faults = {}, double rate_hz = 120.0,
                            const IgtlSetup& setup = quickServerSetup()) {
  ServerBench bench;
  IgtlEmulatorOptions options;
  options.faults = faults;
  options.start_utc_s = kStart_utc_s;
  auto ends = LoopbackTransport::pair();
  bench.server = emulatorOnLine<IgtlEmulatorCore>(std::make_unique<StandingSource>(std::move(poses), rate_hz),
                                                  std::move(ends.second), options);
  FT_CHECK(bench.server->start().has_value());
  auto host = std::make_shared<std::unique_ptr<Transport>>(std::move(ends.first));
  bench.device =
      makeLineDevice<IgtlStartup>(setup, [host]() -> Result<std::unique_ptr<Transport>> { return std::move(*host); });
  bench.probe = std::make_unique<DeviceProbe>(*bench.device);
  return bench;
}

/// A TCP server that sends the bytes it is given, again every few milliseconds, to whoever connects.
class ByteServer : public QObject {
 public:
  explicit ByteServer(std::function<QByteArray()> next, int every_ms = 5) {
    FT_CHECK(server_.listen(QHostAddress::LocalHost));
    connect(&server_, &QTcpServer::newConnection, this, [this, next, every_ms] {
      QTcpSocket* host = server_.nextPendingConnection();
      auto* timer = new QTimer(host);
      connect(timer, &QTimer::timeout, host, [host, next] { host->write(next()); });
      connect(host, &QTcpSocket::readyRead, this, [this, host] { heard += host->readAll(); });
      timer->start(every_ms);
    });
  }
  std::string address() const { return "localhost:" + std::to_string(server_.serverPort()); }
  QByteArray heard;

 private:
  QTcpServer server_;
};

std::unique_ptr<TrackerDevice> deviceFor(const ByteServer& server, const std::string& settings = {}) {
  auto device = makeOpenigtlink(server.address() + settings, {});
  FT_CHECK(device.has_value());
  return std::move(*device);
}

QByteArray transformOf(const char* name, double seconds, const std::string& body) {
  return QByteArray::fromStdString(encodeIgtl("TRANSFORM", name, seconds > 0.0 ? igtlStampOf(seconds) : 0, body));
}

}  // namespace

class OpenigtlinkDeviceTest : public QObject {
  Q_OBJECT
 private slots:
  void streamsOverTcp();
  void everyFaultIsTried();
  void faults_data();
  void faults();
  void asksWhereNothingComes();
  void severalSensorsAndWhoIsNotSeen();
  void namesGiveTheOrder();
  void noRotationIsRefused();
  void nothingUseful();
  void stampsAreTheClock();
  void clockJumps();
  void repeatedMessagesAreNotNew();
  void numbersStayAfterAReconnection();
};

void OpenigtlinkDeviceTest::streamsOverTcp() {
  Emulation emulation;
  emulation.tcp_port = 0;
  emulation.sensors = 2;
  auto server = makeIgtlEmulator(emulation);
  FT_VERIFY_OK(server);
  FT_VERIFY_OK((*server)->start());
  auto device = makeOpenigtlink((*server)->endpoint().address().toStdString(), {});
  FT_VERIFY_OK(device);
  DeviceProbe probe(**device);
  (*device)->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() >= 240, qPrintable(probe.last_text), 10000);
  QCOMPARE(probe.state, DeviceState::kRunning);
  for (std::size_t i = 0; i < probe.samples.size(); ++i) {
    QCOMPARE(probe.samples[i].sensor, static_cast<int>(i % 2));
    QCOMPARE(probe.samples[i].status, std::string());
    if (i >= 2) QVERIFY(probe.samples[i].time_s > probe.samples[i - 2].time_s);
  }
  const TableMetadata about = (*device)->describe();
  QCOMPARE(about.other.at("openigtlink_sensor_1"), std::string("Sensor1 (TDATA)"));
  QCOMPARE(about.other.at("openigtlink_sensor_2"), std::string("Sensor2 (TDATA)"));
  QCOMPARE(about.other.at("openigtlink_clock"), std::string("server"));
  QCOMPARE(*about.transmitter_model, std::string("unknown"));
  FT_VERIFY_MATCH(near(*about.rate_hz, 120.0, 25.0));
  (*device)->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  QTRY_VERIFY(!(*server)->tracker().streaming());
  // A line that is no TCP port is refused, for nobody would hear it.
  emulation.tcp_port.reset();
  emulation.pty_link = "/tmp/nowhere";
  FT_VERIFY_MATCH(holdsAll(makeIgtlEmulator(emulation).error().message, {"TCP", "--listen"}));
}

namespace {

struct ServerFaultCase {
  const char* fault;
  bool fails;
  QList<QByteArray> sentence;
};

const std::vector<ServerFaultCase>& serverFaultCases() {
  static const std::vector<ServerFaultCase> kCases = {
      {"garbage_at_open", false, {"OpenIGTLink"}},
      {"lost_bytes", false, {"OpenIGTLink"}},
      {"split_writes", false, {"OpenIGTLink"}},
      {"error_status", false, {"Sensor 1", "no pose of it now"}},
      {"hemisphere_flip", false, {"Sensor 1", "hemisphere"}},
      {"wrong_baud", true, {"sends no poses", "start tracking"}},
      {"unplug_after=300", true, {"unplugged"}},
      {"silence", true, {"sends no poses", "nothing else"}},
      {"already_streaming", false, {"OpenIGTLink"}},
      {"slow_reply", false, {"OpenIGTLink"}},
      {"outliers", false, {"OpenIGTLink"}},
      {"wrong_crc", false, {"OpenIGTLink"}},
      {"unknown_types", false, {"OpenIGTLink"}},
      {"no_stamps", false, {"OpenIGTLink"}},
      {"waits_to_be_asked", false, {"asking for them"}},
  };
  return kCases;
}

}  // namespace

void OpenigtlinkDeviceTest::everyFaultIsTried() {
  for (const auto& known : emulatorFaults()) {
    if (!known.isOf("openigtlink")) continue;
    const bool tried = std::any_of(serverFaultCases().begin(), serverFaultCases().end(), [&](const ServerFaultCase& c) {
      return QByteArray(c.fault).startsWith(QByteArray::fromStdString(known.id));
    });
    QVERIFY2(tried, known.id.c_str());
  }
}

void OpenigtlinkDeviceTest::faults_data() {
  QTest::addColumn<QByteArray>("fault");
  QTest::addColumn<bool>("fails");
  QTest::addColumn<QList<QByteArray>>("sentence");
  for (const auto& c : serverFaultCases()) QTest::newRow(c.fault) << QByteArray(c.fault) << c.fails << c.sentence;
}

void OpenigtlinkDeviceTest::faults() {
  QFETCH(QByteArray, fault);
  QFETCH(bool, fails);
  QFETCH(QList<QByteArray>, sentence);
  constexpr double kRate_hz = 400.0;
  // Faults that act one second in four begin with the fourth.
  const bool late = fault == "error_status" || fault == "hemisphere_flip";
  const std::size_t wanted = late ? 1700 : fault == "outliers" ? 1200 : 300;
  ServerBench bench = makeServerBench({kServedPose}, *parseFaults(fault.toStdString(), "openigtlink"), kRate_hz);
  DeviceProbe& probe = *bench.probe;
  bench.device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(fails ? probe.state == DeviceState::kFailed : probe.samples.size() >= wanted,
                            qPrintable(probe.last_text), 20000);
  QCOMPARE(probe.failures, fails ? 1 : 0);
  const QString said = fails ? probe.last_text : probe.texts.join('\n');
  FT_VERIFY_MATCH(holdsAll(said.toStdString(), sentence));
  QVERIFY(!probe.last_text.contains('\n'));
  // Nothing wrong can be averaged: what carries no status is right, or falls to the outlier test.
  const auto good = probe.good();
  QCOMPARE(good.size() < probe.samples.size(), late);
  if (good.empty()) return;
  if (fault == "outliers") {
    const auto statistics = averageSamples(good);
    FT_VERIFY_OK(statistics);
    QVERIFY(!statistics->rejections.empty());
    FT_VERIFY_MATCH(near(statistics->mean, kServedPose, 1e-6, 1e-5));
    return;
  }
  for (const auto& sample : good) FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kServedPose, 1e-6, 1e-5));
  const bool by_arrival = bench.device->describe().other.at("openigtlink_clock") == "arrival";
  QCOMPARE(by_arrival, fault == "no_stamps");
}

void OpenigtlinkDeviceTest::asksWhereNothingComes() {
  EmulatorFaults faults;
  faults.waits_to_be_asked = true;
  IgtlSetup setup = quickServerSetup();
  setup.asks = false;
  ServerBench silent = makeServerBench({kServedPose}, faults, 120.0, setup);
  silent.device->start();
  QTRY_COMPARE_WITH_TIMEOUT(silent.probe->state, DeviceState::kFailed, 5000);
  QVERIFY(silent.probe->bytes_sent.isEmpty());
  ServerBench bench = makeServerBench({kServedPose}, faults);
  bench.device->start();
  QTRY_VERIFY_WITH_TIMEOUT(bench.probe->samples.size() > 20, 5000);
  // As the protocol writes it: a request for tracking data without name or time, 36 bytes of zeros.
  QVERIFY(bench.probe->bytes_sent.startsWith(QByteArray("\x00\x01STT_TDATA\0\0\0", 14)));
  bench.device->stop();
  QTRY_COMPARE(bench.probe->state, DeviceState::kClosed);
  QTRY_VERIFY(!bench.server->tracker().streaming());
}

void OpenigtlinkDeviceTest::severalSensorsAndWhoIsNotSeen() {
  int cycle = 0;
  const ByteServer server([&cycle] {
    ++cycle;
    std::vector<IgtlReading> seen = {{"B", kSecondPose, {}}};
    if (cycle < 120 || cycle % 2 == 0) seen.push_back({"A", kServedPose, {}});
    return QByteArray::fromStdString(
        encodeIgtl("TDATA", "Tracker", igtlStampOf(kStart_utc_s + cycle * 0.005), encodeTrackingBody(seen)));
  });
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(cycle > 400 && probe.samples.size() > 400, qPrintable(probe.last_text), 15000);
  int missing = 0;
  for (const Sample& sample : probe.samples) {
    QVERIFY(sample.sensor == 0 || sample.sensor == 1);
    if (sample.status == "missing") {
      QCOMPARE(sample.sensor, 0);
      ++missing;
      continue;
    }
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, sample.sensor == 0 ? kServedPose : kSecondPose, 1e-6, 1e-5));
  }
  QVERIFY(missing > 50);
}

void OpenigtlinkDeviceTest::namesGiveTheOrder() {
  const std::string body = encodeTransformBody(kServedPose), second = encodeTransformBody(kSecondPose);
  int n = 0;
  const ByteServer server([&] {
    const double now_s = kStart_utc_s + ++n * 0.005;
    return transformOf("Alpha", now_s, body) + transformOf("Omega", now_s, second) + transformOf("Table", now_s, body);
  });
  auto device = deviceFor(server, ",devices=Omega+Later+Alpha");
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 50, qPrintable(probe.last_text), 10000);
  for (const Sample& sample : probe.samples) {
    QVERIFY(sample.sensor == 0 || sample.sensor == 2);
    FT_VERIFY_MATCH(near(sample.tracker_from_sensor, sample.sensor == 2 ? kServedPose : kSecondPose, 1e-6, 1e-5));
  }
  auto none = deviceFor(server, ",devices=Probe");
  DeviceProbe failed(*none);
  none->start();
  QTRY_COMPARE_WITH_TIMEOUT(failed.state, DeviceState::kFailed, 10000);
  FT_VERIFY_MATCH(holdsAll(failed.last_text.toStdString(), {"no pose of Probe", "Alpha", "Omega"}));
}

void OpenigtlinkDeviceTest::noRotationIsRefused() {
  std::string mirrored = kIgtlQuarterTurn;
  mirrored[32] = static_cast<char>(0xBF);  // z of the third column: -1.
  int n = 0;
  bool also_good = true;
  const ByteServer server([&] {
    const double now_s = kStart_utc_s + ++n * 0.005;
    return transformOf("Image", now_s, mirrored) + (also_good ? transformOf("Probe", now_s, kIgtlQuarterTurn) : "");
  });
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 50, qPrintable(probe.last_text), 10000);
  for (const Sample& sample : probe.samples) QCOMPARE(sample.sensor, 0);
  FT_VERIFY_MATCH(holdsAll(device->describe().other.at("openigtlink_refused_1"), {"Image", "mirrors"}));
  FT_VERIFY_MATCH(holdsAll(probe.last_text.toStdString(), {"left out", "Image", "mirrors"}));
  also_good = false;
  auto only_mirrored = deviceFor(server);
  DeviceProbe failed(*only_mirrored);
  only_mirrored->start();
  QTRY_COMPARE_WITH_TIMEOUT(failed.state, DeviceState::kFailed, 10000);
  FT_VERIFY_MATCH(holdsAll(failed.last_text.toStdString(), {"rigid motion", "Image", "mirrors"}));
}

void OpenigtlinkDeviceTest::nothingUseful() {
  const QByteArray status =
      QByteArray::fromStdString(encodeIgtl("STATUS", "Server", 0, encodeServerStatusBody({13, "NotReady", "warming"})) +
                                encodeIgtl("IMAGE", "Camera", 0, std::string(100, 'x')));
  const ByteServer server([status] { return status; }, 50);
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_COMPARE_WITH_TIMEOUT(probe.state, DeviceState::kFailed, 10000);
  FT_VERIFY_MATCH(holdsAll(probe.last_text.toStdString(), {"sends no poses", "IMAGE", "NotReady", "warming"}));
  QVERIFY(server.heard.contains("STT_TDATA") && server.heard.contains("STT_QTDATA"));
}

void OpenigtlinkDeviceTest::stampsAreTheClock() {
  // Sent in bunches of ten every 100 ms, stamped 10 ms apart: the samples are 10 ms apart.
  int n = 0;
  const std::string body = encodeTransformBody(kServedPose);
  const ByteServer server(
      [&] {
        QByteArray bunch;
        for (int i = 0; i < 10; ++i) bunch += transformOf("Probe", kStart_utc_s + ++n * 0.01, body);
        return bunch;
      },
      100);
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 100, qPrintable(probe.last_text), 10000);
  for (std::size_t i = 20; i < 100; ++i) {
    const double step_s = probe.samples[i].time_s - probe.samples[i - 1].time_s;
    QVERIFY2(step_s > 0.0 && step_s < 0.02, qPrintable(QString::number(step_s)));
  }
  FT_VERIFY_MATCH(near(probe.samples[99].time_s - probe.samples[59].time_s, 0.4, 0.05));
}

void OpenigtlinkDeviceTest::clockJumps() {
  int n = 0;
  double jump_s = 0.0;
  const std::string body = encodeTransformBody(kServedPose);
  const ByteServer server([&] { return transformOf("Probe", kStart_utc_s + jump_s + ++n * 0.005, body); });
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 20, qPrintable(probe.last_text), 10000);
  jump_s = -3600.0;
  const std::size_t before = probe.samples.size();
  QTRY_VERIFY_WITH_TIMEOUT(probe.samples.size() > before + 20, 10000);
  QVERIFY(probe.texts.join('\n').contains("clock jumped"));
  for (std::size_t i = 1; i < probe.samples.size(); ++i) {
    QVERIFY(std::abs(probe.samples[i].time_s - probe.samples[i - 1].time_s) < 1.0);
  }
}

void OpenigtlinkDeviceTest::repeatedMessagesAreNotNew() {
  // A server that sends its newest pose five times as often as it measures one.
  int n = 0;
  const ByteServer server([&] {
    const Pose pose{{0.1 + 1e-5 * (n / 5), 0.0, 0.0}, kServedPose.orientation};
    return transformOf("Probe", kStart_utc_s + (n++ / 5) * 0.025, encodeTransformBody(pose));
  });
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 30, qPrintable(probe.last_text), 10000);
  for (std::size_t i = 1; i < probe.samples.size(); ++i) {
    QVERIFY(probe.samples[i].tracker_from_sensor.position_m.x() >
            probe.samples[i - 1].tracker_from_sensor.position_m.x());
  }
}

void OpenigtlinkDeviceTest::numbersStayAfterAReconnection() {
  // The first of two sensors by name is not seen when the device is started for a second time.
  bool both = true;
  int n = 0;
  const ByteServer server([&] {
    const double now_s = kStart_utc_s + ++n * 0.005;
    return (both ? transformOf("A", now_s, encodeTransformBody(kServedPose)) : QByteArray()) +
           transformOf("B", now_s, encodeTransformBody(kSecondPose));
  });
  auto device = deviceFor(server);
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 20, qPrintable(probe.last_text), 10000);
  device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
  both = false;
  probe.samples.clear();
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(probe.samples.size() > 20, qPrintable(probe.last_text), 10000);
  for (const Sample& sample : probe.samples) QCOMPARE(sample.sensor, 1);
}

FIELDTRUE_TEST(OpenigtlinkDeviceTest)
#include "openigtlink_device_test.moc"
