#include <fcntl.h>
#include <libserialport.h>
#include <termios.h>
#include <unistd.h>

#include <QCoreApplication>
#include <QDir>
#include <QFile>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/devices/registry.h"
#include "acquisition/emulators/emulator_runner.h"
#include "acquisition/emulators/fastrak_emulator_core.h"
#include "acquisition/emulators/pty_endpoint.h"
#include "acquisition/transports/local_transport.h"
#include "acquisition/transports/serial_ports.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const Pose kPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};

std::unique_ptr<Transport> throughLibserialport(const std::string& path, int baud) {
  std::vector<std::unique_ptr<LineDriver>> drivers;
  drivers.push_back(makeSerialPortDriver());
  return std::make_unique<LocalTransport>(path, baud, std::move(drivers));
}

}  // namespace

/// Runs libserialport itself against the emulator: the name leads out of /dev through a symbolic link to the pty, and
/// the modem lines are answered by a preloaded library.
class LibserialportLineTest : public QObject {
  Q_OBJECT
 private slots:
  void init();
  void cleanup() {
    ::unsetenv("FIELDTRUE_FAKE_TTYS");
    emulator_.reset();
  }
  void libraryItselfReadsRecords_data();
  void libraryItselfReadsRecords();
  void driverReadsThroughIt_data();
  void driverReadsThroughIt();
  void setsTheLine();
  void noticesThePull();
  void refusesTheSecond();
  void listsThePortsOfAMachine();
  void listsNothingWithoutAPort();

 private:
  /// Makes a machine's /sys of its own and lets libserialport see it.
  void haveATty(const QString& name, const QString& device, const QByteArray& product = {});
  std::unique_ptr<QTemporaryDir> folder_;
  std::unique_ptr<EmulatorRunner> emulator_;
  std::string name_;
};

void LibserialportLineTest::init() {
  folder_ = std::make_unique<QTemporaryDir>();
  const QString link = folder_->filePath("tracker");
  auto core = std::make_unique<FastrakEmulatorCore>(std::make_unique<StandingSource>(std::vector{kPose}));
  emulator_ = std::make_unique<EmulatorRunner>(std::move(core), std::make_unique<PtyEndpoint>(link));
  FT_VERIFY_OK(emulator_->start());
  name_ = "/dev/../../.." + link.toStdString();
}

void LibserialportLineTest::libraryItselfReadsRecords_data() {
  QTest::addColumn<int>("baud");
  for (const int baud : {9600, 19200, 57600, 115200, 921600, 1228739}) QTest::addRow("%d", baud) << baud;
}

void LibserialportLineTest::libraryItselfReadsRecords() {
  QFETCH(int, baud);
  sp_port* port = nullptr;
  QCOMPARE(sp_get_port_by_name(name_.c_str(), &port), SP_OK);
  QCOMPARE(sp_open(port, SP_MODE_READ_WRITE), SP_OK);
  QCOMPARE(sp_set_baudrate(port, baud), SP_OK);
  QCOMPARE(sp_set_bits(port, 8), SP_OK);
  QCOMPARE(sp_set_parity(port, SP_PARITY_NONE), SP_OK);
  QCOMPARE(sp_set_stopbits(port, 1), SP_OK);
  QCOMPARE(sp_set_flowcontrol(port, SP_FLOWCONTROL_NONE), SP_OK);
  const std::string commands = "cO1,2,11,16,1\rufC";
  // A count, or one of the enumeration's negative values.
  const int n_written = sp_nonblocking_write(port, commands.data(), commands.size());
  QCOMPARE(n_written, static_cast<int>(commands.size()));

  FastrakStreamSettings settings;
  settings.items[0] = {2, 11, 16, 1};
  auto parser = *FastrakParser::make(settings);
  std::vector<FastrakRecord> records;
  for (int i = 0; i < 400 && records.size() < 30; ++i) {
    QTest::qWait(5);
    std::array<char, 512> chunk;
    const auto n = sp_nonblocking_read(port, chunk.data(), chunk.size());
    QVERIFY(n >= 0);
    parser.add({chunk.data(), static_cast<std::size_t>(n)}, records);
  }
  sp_close(port);
  sp_free_port(port);
  QVERIFY(records.size() >= 30);
  QCOMPARE(parser.dropped_bytes(), std::uint64_t{0});
  for (const auto& record : records)
    FT_VERIFY_MATCH(near(toSample(record, 0.0).tracker_from_sensor, kPose, 1e-7, 2e-6));
}

void LibserialportLineTest::driverReadsThroughIt_data() {
  QTest::addColumn<int>("baud");
  for (const int baud : {19200, 115200}) QTest::addRow("%d", baud) << baud;
}

void LibserialportLineTest::driverReadsThroughIt() {
  QFETCH(int, baud);
  FastrakSetup setup;
  setup.where = name_;
  setup.baud = baud;
  const auto device = makeLineDevice<FastrakStartup>(
      setup, [this, baud]() -> Result<std::unique_ptr<Transport>> { return throughLibserialport(name_, baud); });
  std::vector<Sample> samples;
  DeviceState state = DeviceState::kClosed;
  QString text;
  connect(device.get(), &TrackerDevice::samplesReceived, this,
          [&](const auto& more) { samples.insert(samples.end(), more.begin(), more.end()); });
  connect(device.get(), &TrackerDevice::stateChanged, this, [&](DeviceState now, const QString& why) {
    state = now;
    text = why;
  });
  device->start();
  QTRY_VERIFY2_WITH_TIMEOUT(samples.size() >= 60, qPrintable(text), 15000);
  QVERIFY2(state == DeviceState::kRunning, qPrintable(text));
  for (const auto& sample : samples) FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kPose, 1e-7, 2e-6));
  device->stop();
  QTRY_COMPARE(state, DeviceState::kClosed);
  QVERIFY(!emulator_->tracker().streaming());
}

void LibserialportLineTest::setsTheLine() {
  auto line = throughLibserialport(name_, 19200);
  FT_VERIFY_OK(line->openLine());
  const int slave = ::open(name_.c_str(), O_RDWR | O_NOCTTY);
  termios settings{};
  QVERIFY(::tcgetattr(slave, &settings) == 0);
  QCOMPARE(::cfgetospeed(&settings), static_cast<speed_t>(B19200));
  QCOMPARE(settings.c_lflag & static_cast<tcflag_t>(ICANON | ECHO | ISIG), tcflag_t{0});
  QVERIFY(line->setBaud(115200));
  QVERIFY(::tcgetattr(slave, &settings) == 0);
  QCOMPARE(::cfgetospeed(&settings), static_cast<speed_t>(B115200));
  line->setRequestToSend(true);
  line->setRequestToSend(false);
  line->setBreak(true);
  line->setBreak(false);
  ::close(slave);
}

void LibserialportLineTest::noticesThePull() {
  auto line = throughLibserialport(name_, 115200);
  FT_VERIFY_OK(line->openLine());
  QSignalSpy lost(line.get(), &Transport::lineLost);
  line->write("C");
  QTRY_VERIFY(line->bytesAvailable() > 100);
  emulator_->unplug();
  QTRY_COMPARE(lost.count(), 1);
}

void LibserialportLineTest::refusesTheSecond() {
  auto first = throughLibserialport(name_, 115200);
  FT_VERIFY_OK(first->openLine());
  const auto second = throughLibserialport(name_, 115200)->openLine();
  QVERIFY(!second);
  FT_VERIFY_MATCH(holdsAll(second.error().message, {"busy"}));
}

void LibserialportLineTest::haveATty(const QString& name, const QString& device, const QByteArray& product) {
  const QString ttys = folder_->filePath("sys/class/tty");
  ::setenv("FIELDTRUE_FAKE_TTYS", qPrintable(ttys), 1);
  QVERIFY(QDir().mkpath(ttys));
  if (name.isEmpty()) return;
  const QString at = folder_->filePath("sys/devices/" + device);
  QVERIFY(QDir().mkpath(at + "/device"));
  QVERIFY(QFile::link("../../devices/" + device, ttys + "/" + name));
  const std::vector<std::pair<QString, QByteArray>> attributes = {
      {"busnum", "1"}, {"devnum", "2"}, {"idVendor", "067b"}, {"idProduct", "2303"}, {"product", product}};
  for (const auto& [file, text] : attributes) {
    if (product.isEmpty()) break;
    QFile attribute(at + "/" + file);
    QVERIFY(attribute.open(QIODevice::WriteOnly) && attribute.write(text + "\n") > 0);
  }
}

// As sysfs has them: an adapter on USB, one that tells no name, a console, and a chip that answers to no driver.
void LibserialportLineTest::listsThePortsOfAMachine() {
  haveATty("ttyUSB70", "usb1/1-1/ttyUSB70", "USB-Serial Controller");
  haveATty("ttyACM70", "platform/amba/ttyACM70");
  haveATty("tty3", "virtual/tty/tty3");
  haveATty("ttyS70", "platform/serial8250/tty/ttyS70");
  std::vector<SerialPortInfo> ports = listSerialPorts();
  std::sort(ports.begin(), ports.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  QCOMPARE(ports.size(), std::size_t{2});
  QCOMPARE(ports[0].path, std::string("/dev/ttyACM70"));
  QVERIFY(!ports[0].description.empty());
  QCOMPARE(ports[1].path, std::string("/dev/ttyUSB70"));
  FT_VERIFY_MATCH(holdsAll(ports[1].description, {"USB-Serial Controller"}));

  std::vector<SerialLine> lines = serialLines();
  std::sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  QCOMPARE(lines.size(), ports.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    QCOMPARE(lines[i].path, ports[i].path);
    QCOMPARE(lines[i].description, ports[i].description);
  }
}

void LibserialportLineTest::listsNothingWithoutAPort() {
  haveATty({}, {});
  QVERIFY(listSerialPorts().empty());
  QVERIFY(serialLines().empty());
}

int main(int argc, char** argv) {
  const char* preloaded = std::getenv("LD_PRELOAD");
  if (!preloaded || !std::strstr(preloaded, FIELDTRUE_FAKE_MODEM_LINES)) {
    ::setenv("LD_PRELOAD", FIELDTRUE_FAKE_MODEM_LINES, 1);
    const char* asan = std::getenv("ASAN_OPTIONS");
    ::setenv("ASAN_OPTIONS", (std::string(asan ? asan : "") + ":verify_asan_link_order=0").c_str(), 1);
    ::execv("/proc/self/exe", argv);
    return EXIT_FAILURE;
  }
  QCoreApplication application(argc, argv);
  LibserialportLineTest test;
  return fieldtrue::testing::runTest(test, argc, argv);
}

#include "libserialport_line_test.moc"
