#include <QTest>
#include <QThread>
#include <atomic>
#include <cmath>
#include <set>

#include "acquisition/devices/registry.h"
#include "calib/core/statistics.h"
#include "tests/acquisition/devices/device_probe.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

std::unique_ptr<TrackerDevice> deviceOf(const std::string& text, const simulation::Scene& scene = {}) {
  auto device = makeDevice(text, scene);
  FT_CHECK(device.has_value());
  return std::move(*device);
}

}  // namespace

class DeviceRegistryTest : public QObject {
  Q_OBJECT
 private slots:
  void rows();
  void everyRow_data();
  void everyRow();
  void goodTexts_data();
  void goodTexts();
  void badTexts_data();
  void badTexts();
  void simulatedStandsWhereItIsSent();
  void simulatedKeepsItsOwnTime();
  void simulatedStartsAgain();
  void simulatedWorksInAnotherThread();
};

void DeviceRegistryTest::rows() {
  QVERIFY(!deviceKinds().empty());
  QCOMPARE(deviceKinds().front().id, std::string("simulated"));
  std::set<std::string> ids;
  for (const auto& kind : deviceKinds()) {
    QVERIFY(ids.insert(kind.id).second);
    QVERIFY(!kind.label.empty() && !kind.address_help.empty() && !kind.source.empty() && kind.make);
    std::set<std::string> keys;
    for (const auto& setting : kind.settings) {
      QVERIFY(keys.insert(setting.key).second);
      QVERIFY(!setting.label.empty() && !setting.help.empty());
    }
    FT_VERIFY_OK(resolveSettings(kind.id, kind.settings, {}));
  }
}

void DeviceRegistryTest::everyRow_data() {
  QTest::addColumn<QByteArray>("text");
  for (const auto& kind : deviceKinds()) {
    QTest::newRow(kind.id.c_str()) << QByteArray::fromStdString(kind.id +
                                                                (kind.id == "simulated" ? "" : ":/dev/does_not_exist"));
  }
}

void DeviceRegistryTest::everyRow() {
  QFETCH(QByteArray, text);
  auto device = deviceOf(text.toStdString());
  DeviceProbe probe(*device);
  QVERIFY(device->describe().tracker.has_value());
  device->stop();
  QCOMPARE(probe.state, DeviceState::kClosed);
  device->start();
  // It runs, or it says in one sentence why not.
  QTRY_VERIFY_WITH_TIMEOUT(probe.state == DeviceState::kRunning || probe.state == DeviceState::kFailed, 20000);
  QVERIFY(probe.last_text.size() > 10 && !probe.last_text.contains('\n'));
  device->stop();
  QTRY_COMPARE(probe.state, DeviceState::kClosed);
}

void DeviceRegistryTest::goodTexts_data() {
  QTest::addColumn<QByteArray>("text");
  for (const char* text :
       {"simulated", "simulated:speed=4,seed=2,travel_s=1", "simulated:fault=outliers", "fastrak:/dev/ttyUSB0",
        "fastrak:/dev/ttyUSB0@19200,hemisphere=-x,stations=13", "fastrak:/dev/ttyUSB0,stations=1+3",
        "fastrak:tcp:localhost:4000,filter=low,raw_frame=false", "liberty:/dev/ttyUSB0@115200,stations=1+16",
        "patriot:tcp:localhost:4000,stations=2", "isotrak:/dev/ttyUSB0@19200,stations=1+2,record=angles",
        "openigtlink:localhost:18944", "openigtlink:localhost",
        "openigtlink:tcp:localhost:18944,devices=Probe+Stylus,ask=false,transmitter=dipole"}) {
    QTest::newRow(text) << QByteArray(text);
  }
}

void DeviceRegistryTest::goodTexts() {
  QFETCH(QByteArray, text);
  FT_VERIFY_OK(makeDevice(text.toStdString(), {}));
}

void DeviceRegistryTest::badTexts_data() {
  QTest::addColumn<QByteArray>("text");
  QTest::addColumn<QList<QByteArray>>("fragments");
  const auto row = [](const char* text, const QList<QByteArray>& fragments) {
    QTest::newRow(text) << QByteArray(text) << fragments;
  };
  row("", {"simulated"});
  row("sonar:/dev/ttyUSB0", {"sonar", "simulated", "fastrak"});
  row("fastrak", {"/dev/ttyUSB0@115200"});
  row("fastrak:", {"/dev/ttyUSB0@115200"});
  row("fastrak:/dev/ttyUSB0@fast", {"fast", "baud"});
  row("fastrak:/dev/ttyUSB0,hemisphere=up", {"hemisphere", "up"});
  row("fastrak:/dev/ttyUSB0,stations=15", {"stations", "1 to 4", "1+2", "15"});
  row("fastrak:/dev/ttyUSB0,stations=1+", {"stations", "1+"});
  row("liberty:/dev/ttyUSB0,stations=17", {"stations", "1 to 16", "17"});
  row("patriot:/dev/ttyUSB0,stations=1+3", {"stations", "1 to 2", "1+3"});
  row("isotrak:/dev/ttyUSB0,stations=3", {"stations", "1 to 2", "3"});
  row("isotrak:/dev/ttyUSB0,record=words", {"record", "quaternion", "words"});
  row("fastrak:/dev/ttyUSB0,color=red", {"color", "hemisphere"});
  row("openigtlink:localhost:port", {"port", "1 to 65535"});
  row("openigtlink:localhost,devices=Probe+", {"devices", "Probe+Stylus"});
  row("simulated:speed=0", {"speed", "0.1"});
  row("simulated:travel=1", {"travel", "travel_s"});
  row("simulated:fault=magic", {"fault", "magic"});
}

void DeviceRegistryTest::badTexts() {
  QFETCH(QByteArray, text);
  QFETCH(QList<QByteArray>, fragments);
  const auto device = makeDevice(text.toStdString(), {});
  QVERIFY(!device);
  QCOMPARE(device.error().code, ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(device.error().message, fragments));
}

void DeviceRegistryTest::simulatedStandsWhereItIsSent() {
  simulation::Scene scene;
  scene.reference_from_tracker = {{0.1, 0.2, 0.3}, rotationFromEuler(Eigen::Vector3d(0.3, 0.0, 0.0))};
  auto device = deviceOf("simulated:speed=20,travel_s=0.5,seed=3", scene);
  DeviceProbe probe(*device);
  device->start();
  QTRY_COMPARE_WITH_TIMEOUT(probe.state, DeviceState::kRunning, 10000);
  for (const Pose& local : {Pose{{0.4, 0.1, 0.0}, Eigen::Quaterniond::Identity()},
                            Pose{{0.5, -0.2, 0.1}, rotationFromEuler(Eigen::Vector3d(0.2, 0.1, 0.0))},
                            Pose{{-0.4, -0.2, 0.1}, Eigen::Quaterniond::Identity()}}) {
    device->guideTo(scene.reference_from_tracker * local);
    const double sent_s = probe.samples.empty() ? 0.0 : probe.samples.back().time_s;
    QTRY_VERIFY_WITH_TIMEOUT(!probe.samples.empty() && probe.samples.back().time_s > sent_s + 3.0, 10000);
    const std::vector<Sample> last(probe.samples.end() - 60, probe.samples.end());
    const auto statistics = averageSamples(last);
    FT_VERIFY_OK(statistics);
    // A clean room: within six standard errors of where it stands in the tracker's frame.
    const double sem_m = std::sqrt(statistics->covariance_m2.trace() / 60.0);
    QVERIFY(sem_m < 0.002);
    FT_VERIFY_MATCH(near(statistics->mean.position_m, local.position_m, 6.0 * sem_m + 1e-5));
    FT_VERIFY_MATCH(
        near(statistics->mean.orientation, local.orientation, 6.0 * statistics->sd_rot_rad / std::sqrt(60.0) + 1e-4));
  }
  QCOMPARE(probe.failures, 0);
  const TableMetadata about = device->describe();
  QVERIFY(about.tracker->find("simulated") != std::string::npos);
  QCOMPARE(about.rig, std::optional<std::string>(scene.rig.name));
  QCOMPARE(*about.rate_hz, 120.0);
}

void DeviceRegistryTest::simulatedKeepsItsOwnTime() {
  auto device = deviceOf("simulated:speed=10");
  DeviceProbe probe(*device);
  device->start();
  QTRY_VERIFY_WITH_TIMEOUT(probe.samples.size() > 1500, 20000);
  // 120 Hz of its own seconds, whatever the speed.
  const auto& s = probe.samples;
  FT_VERIFY_MATCH(near((s[1400].time_s - s[200].time_s) / 1200.0, 1.0 / 120.0, 0.05 / 120.0));
}

void DeviceRegistryTest::simulatedStartsAgain() {
  auto device = deviceOf("simulated:speed=10");
  DeviceProbe probe(*device);
  for (int i = 0; i < 2; ++i) {
    device->start();
    QTRY_COMPARE_WITH_TIMEOUT(probe.state, DeviceState::kRunning, 10000);
    device->stop();
    QTRY_COMPARE_WITH_TIMEOUT(probe.state, DeviceState::kClosed, 10000);
  }
}

void DeviceRegistryTest::simulatedWorksInAnotherThread() {
  qRegisterMetaType<DeviceState>("fieldtrue::acquisition::DeviceState");
  auto device = deviceOf("simulated:speed=10");
  std::atomic<int> samples{0};
  connect(device.get(), &TrackerDevice::samplesReceived, device.get(),
          [&](const auto& more) { samples += static_cast<int>(more.size()); });
  QThread thread;
  device->moveToThread(&thread);
  thread.start();
  QMetaObject::invokeMethod(device.get(), [&] { device->start(); });
  QTRY_VERIFY_WITH_TIMEOUT(samples > 100, 10000);
  QMetaObject::invokeMethod(
      device.get(), [&] { device.reset(); }, Qt::BlockingQueuedConnection);
  thread.quit();
  QVERIFY(thread.wait(5000));
}

FIELDTRUE_TEST(DeviceRegistryTest)
#include "device_registry_test.moc"
