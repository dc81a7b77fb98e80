#include "acquisition/search/tracker_search.h"

#include <QElapsedTimer>
#include <QProcess>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <filesystem>

#include "acquisition/emulators/fastrak_emulator.h"
#include "acquisition/emulators/openigtlink_emulator.h"
#include "acquisition/emulators/pty_endpoint.h"
#include "acquisition/search/known_adapters.h"
#include "acquisition/transports/followed_line.h"
#include "acquisition/transports/line_holders.h"
#include "tests/acquisition/devices/rated_line.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

std::unique_ptr<PoseSource> standingSensors(std::size_t count) {
  return std::make_unique<StandingSource>(std::vector<Pose>(count, {{0.3, 0.1, 0.0}, Eigen::Quaterniond::Identity()}));
}

std::unique_ptr<EmulatorRunner> fastrakAt(std::unique_ptr<EmulatorEndpoint> endpoint, EmulatorFaults faults = {},
                                          std::size_t sensors = 1) {
  FastrakEmulatorOptions options;
  options.faults = faults;
  auto core = std::make_unique<FastrakEmulatorCore>(standingSensors(sensors), options);
  auto runner = std::make_unique<EmulatorRunner>(std::move(core), std::move(endpoint), faults);
  FT_CHECK(runner->start().has_value());
  return runner;
}

std::vector<LineFinding> searched(const std::vector<std::string>& lines) {
  TrackerSearch search(lines);
  QSignalSpy ended(&search, &TrackerSearch::finished);
  search.start();
  FT_CHECK(!ended.isEmpty() || ended.wait(60000));
  return search.findings();
}

void write(const QString& path, const char* text) {
  std::filesystem::create_directories(std::filesystem::path(path.toStdString()).parent_path());
  QFile file(path);
  FT_CHECK(file.open(QIODevice::WriteOnly) && file.write(text) > 0);
}

/// The kernel's folder of devices with one adapter, as it looks for ftdi_sio.
void plugIn(const QString& system_folder, const QString& usb, const QString& tty, const char* serial) {
  const QString adapter = system_folder + "/devices/usb1/" + usb;
  write(adapter + "/idVendor", "0403\n");
  write(adapter + "/idProduct", "6001\n");
  write(adapter + "/serial", serial);
  write(adapter + "/manufacturer", "FTDI\n");
  write(adapter + "/product", "FT232R USB UART\n");
  const QString port = adapter + "/" + usb + ":1.0/" + tty;
  write(port + "/tty/" + tty + "/dev", "188:0\n");
  write(system_folder + "/class/tty/" + tty + "/uevent", "MAJOR=188\n");
  std::filesystem::create_directory_symlink(port.toStdString(),
                                            (system_folder + "/class/tty/" + tty + "/device").toStdString());
}

}  // namespace

class TrackerSearchTest : public QObject {
  Q_OBJECT
 private slots:
  void init();
  void everyProbeIsWhole();
  void everyEmulatedTrackerIsFound_data();
  void everyEmulatedTrackerIsFound();
  void findsAFastrakOnAPty();
  void findsOneThatSendsAlready();
  void findsAFastrakBehindAPort();
  void findsTheRate();
  void findsAnOpenIgtLinkServer();
  void nothingAnswers();
  void bytesOfNobody();
  void busyLine();
  void wrongLines();
  void sideBySide();
  void canBeStopped();
  void recognisesAStream();
  void whoHoldsALine();
  void adaptersFromTheSystem();
  void adaptersAreKnownOnAnotherPort();
  void aLineFollowsItsAdapter();

 private:
  QString path(const char* name) const { return folder_->filePath(name); }
  std::unique_ptr<QTemporaryDir> folder_;
};

void TrackerSearchTest::init() {
  folder_ = std::make_unique<QTemporaryDir>();
  qputenv("XDG_CONFIG_HOME", QFile::encodeName(path("config")));
}

void TrackerSearchTest::everyProbeIsWhole() {
  for (const DeviceKind& kind : deviceKinds()) {
    QVERIFY2(kind.probe.has_value() == (kind.stream != nullptr), kind.id.c_str());
    if (!kind.probe) continue;
    QVERIFY(kind.probe->answer && !kind.probe->may_do.empty());
    QVERIFY(!kind.probe->ask.empty() || kind.probe->stream);
    QVERIFY(!kind.probe->rates.empty() || !kind.usual_addresses.empty());
    // Noise is nobody's answer, and no kind takes another's question, echoed, for an answer.
    for (const DeviceKind& other : deviceKinds()) {
      if (other.probe) QVERIFY2(!kind.probe->answer(other.probe->stop + other.probe->ask), other.id.c_str());
    }
    QVERIFY(!kind.probe->answer("") && !kind.probe->answer(std::string(500, '\xFF')));
  }
}

void TrackerSearchTest::everyEmulatedTrackerIsFound_data() {
  QTest::addColumn<QByteArray>("kind");
  QTest::addColumn<bool>("sends_already");
  for (const DeviceKind& kind : deviceKinds()) {
    if (!kind.emulate || !kind.probe) continue;
    for (const bool sends : {false, true}) {
      QTest::addRow("%s%s", kind.id.c_str(), sends ? ", sends already" : "")
          << QByteArray::fromStdString(kind.id) << sends;
    }
  }
}

void TrackerSearchTest::everyEmulatedTrackerIsFound() {
  QFETCH(QByteArray, kind);
  QFETCH(bool, sends_already);
  Emulation emulation;
  emulation.tcp_port = 0;
  emulation.faults.already_streaming = sends_already;
  auto emulator = (*findEmulated(kind.toStdString()))->emulate(emulation);
  FT_VERIFY_OK(emulator);
  FT_VERIFY_OK((*emulator)->start());
  const auto findings = searched({(*emulator)->endpoint().address().toStdString()});
  QVERIFY2(findings[0].tracker.has_value(), findings[0].text.c_str());
  QCOMPARE(findings[0].tracker->kind, kind.toStdString());
  const ProbeAnswer& answer = findings[0].tracker->answer;
  // The questions that a Flock and an NDI are asked tell no sensors.
  const std::size_t n_told = kind == "flock" || kind == "ndi" ? 0 : 1;
  QCOMPARE(answer.sensors.size() + answer.sensor_names.size(), n_told);
  QVERIFY(!answer.model.empty());
  FT_VERIFY_OK(makeDevice(findings[0].tracker->device, {}));
}

void TrackerSearchTest::findsAFastrakOnAPty() {
  const auto emulator = fastrakAt(std::make_unique<PtyEndpoint>(path("tracker")), {}, 2);
  const auto findings = searched({path("tracker").toStdString()});
  QCOMPARE(findings.size(), std::size_t{1});
  const LineFinding& finding = findings[0];
  QVERIFY2(finding.tracker.has_value(), finding.text.c_str());
  QCOMPARE(finding.tracker->kind, std::string("fastrak"));
  QCOMPARE(finding.tracker->device, "fastrak:" + path("tracker").toStdString());
  QCOMPARE(finding.tracker->answer.firmware, std::string("G1.02"));
  QCOMPARE(finding.tracker->answer.sensors, (std::vector{1, 2}));
  QVERIFY(!finding.tracker->was_streaming);
  FT_VERIFY_MATCH(holdsAll(finding.text, {"Polhemus Fastrak", "G1.02", "sensors 1, 2"}));
  // The line is free again.
  auto line = makeTransport(path("tracker").toStdString());
  FT_VERIFY_OK((*line)->openLine());
}

void TrackerSearchTest::findsOneThatSendsAlready() {
  EmulatorFaults faults;
  faults.already_streaming = true;
  const auto emulator = fastrakAt(std::make_unique<TcpEndpoint>(quint16{0}), faults);
  const auto findings = searched({emulator->endpoint().address().toStdString()});
  QVERIFY2(findings[0].tracker.has_value(), findings[0].text.c_str());
  QVERIFY(findings[0].tracker->was_streaming);
  QCOMPARE(findings[0].tracker->answer.firmware, std::string("G1.02"));
}

void TrackerSearchTest::findsAFastrakBehindAPort() {
  const auto emulator = fastrakAt(std::make_unique<TcpEndpoint>(quint16{0}));
  const std::string address = emulator->endpoint().address().toStdString();
  const auto findings = searched({address});
  QVERIFY2(findings[0].tracker.has_value(), findings[0].text.c_str());
  QCOMPARE(findings[0].tracker->device, "fastrak:" + address);
}

void TrackerSearchTest::findsTheRate() {
  auto ends = LoopbackTransport::pair();
  auto emulator =
      emulatorOnLine<FastrakEmulatorCore>(standingSensors(1), std::move(ends.second), FastrakEmulatorOptions{});
  FT_VERIFY_OK(emulator->start());
  auto inner = std::make_shared<std::unique_ptr<LoopbackTransport>>(std::move(ends.first));
  LineSearch search("/dev/ttyS7", [inner](const std::string&) -> Result<std::unique_ptr<Transport>> {
    return std::make_unique<RatedLine>(std::move(*inner), 19200, 115200);
  });
  QSignalSpy ended(&search, &LineSearch::finished);
  search.start();
  QVERIFY(ended.wait(20000));
  QVERIFY2(search.finding().tracker.has_value(), search.finding().text.c_str());
  QCOMPARE(search.finding().tracker->device, std::string("fastrak:/dev/ttyS7@19200"));
}

void TrackerSearchTest::findsAnOpenIgtLinkServer() {
  auto core = std::make_unique<IgtlEmulatorCore>(standingSensors(2), IgtlEmulatorOptions{});
  EmulatorRunner server(std::move(core), std::make_unique<TcpEndpoint>(quint16{0}));
  FT_VERIFY_OK(server.start());
  const std::string address = server.endpoint().address().toStdString();
  const auto findings = searched({address});
  QVERIFY2(findings[0].tracker.has_value(), findings[0].text.c_str());
  QCOMPARE(findings[0].tracker->kind, std::string("openigtlink"));
  QCOMPARE(findings[0].tracker->device, "openigtlink:" + address.substr(4));
  QCOMPARE(findings[0].tracker->answer.sensor_names, (std::vector<std::string>{"Sensor1", "Sensor2"}));
  FT_VERIFY_OK(makeDevice(findings[0].tracker->device, {}));
}

void TrackerSearchTest::nothingAnswers() {
  EmulatorFaults faults;
  faults.silence = true;
  const auto emulator = fastrakAt(std::make_unique<PtyEndpoint>(path("tracker")), faults);
  const auto findings = searched({path("tracker").toStdString()});
  QVERIFY(!findings[0].tracker);
  FT_VERIFY_MATCH(holdsAll(findings[0].text, {"Nothing answered", "switched on"}));
}

void TrackerSearchTest::bytesOfNobody() {
  EmulatorFaults faults;
  faults.wrong_baud = true;
  const auto emulator = fastrakAt(std::make_unique<PtyEndpoint>(path("tracker")), faults);
  const auto findings = searched({path("tracker").toStdString()});
  QVERIFY(!findings[0].tracker);
  FT_VERIFY_MATCH(holdsAll(findings[0].text, {"No known tracker", "bytes came"}));
}

void TrackerSearchTest::busyLine() {
  const auto emulator = fastrakAt(std::make_unique<PtyEndpoint>(path("tracker")));
  auto other = makeTransport(path("tracker").toStdString());
  FT_VERIFY_OK((*other)->openLine());
  const auto findings = searched({path("tracker").toStdString()});
  QVERIFY(!findings[0].tracker);
  FT_VERIFY_MATCH(holdsAll(findings[0].text, {"busy", "process"}));
}

void TrackerSearchTest::wrongLines() {
  const auto findings = searched({"/dev/ttyUSB77", "tcp:nowhere"});
  QCOMPARE(findings.size(), std::size_t{2});
  FT_VERIFY_MATCH(holdsAll(findings[0].text, {"/dev/ttyUSB77", "does not exist"}));
  FT_VERIFY_MATCH(holdsAll(findings[1].text, {"tcp:nowhere", "port"}));
}

void TrackerSearchTest::sideBySide() {
  EmulatorFaults faults;
  faults.silence = true;
  std::vector<std::unique_ptr<EmulatorRunner>> emulators;
  std::vector<std::string> lines;
  for (int i = 0; i < 6; ++i) {
    const QString link = folder_->filePath(QString("tracker%1").arg(i));
    emulators.push_back(fastrakAt(std::make_unique<PtyEndpoint>(link), i == 5 ? EmulatorFaults{} : faults));
    lines.push_back(link.toStdString());
  }
  QElapsedTimer timer;
  timer.start();
  searched({lines.front()});
  const qint64 one_ms = timer.restart();
  const auto findings = searched(lines);
  QVERIFY2(timer.elapsed() < 2 * one_ms + 500, qPrintable(QString::number(timer.elapsed())));
  for (std::size_t i = 0; i < lines.size(); ++i) QCOMPARE(findings[i].tracker.has_value(), i == 5);
}

void TrackerSearchTest::canBeStopped() {
  EmulatorFaults faults;
  faults.silence = true;
  const auto emulator = fastrakAt(std::make_unique<PtyEndpoint>(path("tracker")), faults);
  TrackerSearch search({path("tracker").toStdString()});
  QSignalSpy ended(&search, &TrackerSearch::finished);
  search.start();
  QTest::qWait(50);
  search.stop();
  QCOMPARE(ended.count(), 1);
  QCOMPARE(search.findings()[0].text, std::string("Stopped"));
  QTest::qWait(500);
  QCOMPARE(ended.count(), 1);
  // And begun anew.
  search.start();
  QVERIFY(ended.wait(20000));
}

void TrackerSearchTest::recognisesAStream() {
  std::string stream;
  for (int i = 0; i < 8; ++i) stream += "01 " + std::string(29, static_cast<char>('A' + i));
  QVERIFY(looksLikeFastrakStream(stream));
  QVERIFY(looksLikeFastrakStream("rest of a record" + stream));
  QVERIFY(!looksLikeFastrakStream(stream.substr(0, 5 * 32)));
  QVERIFY(!looksLikeFastrakStream(std::string(2000, '0')));
  QVERIFY(!looksLikeFastrakStream(""));
}

void TrackerSearchTest::whoHoldsALine() {
  PtyEndpoint device({});
  FT_VERIFY_OK(device.open());
  QVERIFY(holdersOf(device.terminal().toStdString()).empty());
  QProcess other;
  other.setStandardInputFile(device.terminal());
  other.start("sleep", {"30"});
  QVERIFY(other.waitForStarted());
  const auto expected = "sleep (process " + std::to_string(other.processId()) + ")";
  QTRY_COMPARE(holdersOf(device.terminal().toStdString()), std::vector{expected});
  const auto findings = searched({device.terminal().toStdString()});
  FT_VERIFY_MATCH(holdsAll(findings[0].note, {QByteArray::fromStdString(expected), "open too"}));
  other.kill();
  other.waitForFinished();
}

void TrackerSearchTest::adaptersFromTheSystem() {
  plugIn(path("sys"), "1-2", "ttyUSB0", "A10KWXYZ\n");
  plugIn(path("sys"), "1-3", "ttyUSB1", "B20\n");
  write(path("sys/class/tty/ttyS0/device/uevent"), "DRIVER=serial8250\n");
  const std::string system = path("sys").toStdString();
  const auto ports = usbPorts(system);
  QCOMPARE(ports.size(), std::size_t{2});
  QCOMPARE(ports[0].path, std::string("/dev/ttyUSB0"));
  QCOMPARE(ports[0].adapter.vendor, 0x0403);
  QCOMPARE(ports[0].adapter.product, 0x6001);
  QCOMPARE(ports[0].adapter.serial, std::string("A10KWXYZ"));
  QCOMPARE(ports[0].adapter.description, std::string("FTDI FT232R USB UART"));
  QCOMPARE(*portOf(ports[1].adapter, system), std::string("/dev/ttyUSB1"));
  QVERIFY(!usbAdapterOf("/dev/ttyS0", system));
  QVERIFY(!usbAdapterOf("/dev/ttyUSB9", system));
  // Without a serial number nobody can tell two adapters of a kind apart.
  UsbAdapter nameless = ports[0].adapter;
  nameless.serial.clear();
  QVERIFY(!nameless.isSame(nameless) && !portOf(nameless, system));
}

void TrackerSearchTest::adaptersAreKnownOnAnotherPort() {
  plugIn(path("before"), "1-2", "ttyUSB0", "A10KWXYZ\n");
  plugIn(path("after"), "1-2", "ttyUSB0", "B20\n");
  plugIn(path("after"), "1-3", "ttyUSB3", "A10KWXYZ\n");
  const std::string file = path("config/fieldtrue/adapters.json").toStdString();
  const std::string before = path("before").toStdString(), after = path("after").toStdString();
  const UsbAdapter adapter = *usbAdapterOf("/dev/ttyUSB0", before);
  KnownAdapters(file).remember(adapter, "/dev/ttyUSB0", "fastrak:/dev/ttyUSB0@115200");
  const KnownAdapters known(file);
  QCOMPARE(known.rows().size(), std::size_t{1});
  QVERIFY(known.rows()[0].adapter.isSame(adapter));
  FT_VERIFY_MATCH(holdsAll(known.noteOn("/dev/ttyUSB3", usbAdapterOf("/dev/ttyUSB3", after)),
                           {"was on /dev/ttyUSB0", "fastrak:/dev/ttyUSB0@115200"}));
  QCOMPARE(known.noteOn("/dev/ttyUSB0", usbAdapterOf("/dev/ttyUSB0", after)), std::string());
  // Where it was before another adapter now is; it has moved.
  QVERIFY(!known.movedTo("/dev/ttyUSB0", before));
  QCOMPARE(*known.movedTo("/dev/ttyUSB0", after), std::string("/dev/ttyUSB3"));
  QVERIFY(!known.movedTo("/dev/ttyUSB5", after));
  std::filesystem::remove_all(after + "/devices/usb1/1-3");
  QVERIFY(!known.movedTo("/dev/ttyUSB0", after));
  // A file that is none counts as empty, and is written anew.
  write(QString::fromStdString(file), "{\"adapters\": [1, 2");
  QVERIFY(KnownAdapters(file).rows().empty());
  KnownAdapters(file).remember(adapter, "/dev/ttyUSB3", "fastrak:/dev/ttyUSB3@115200");
  QCOMPARE(KnownAdapters(file).rows().size(), std::size_t{1});
}

void TrackerSearchTest::aLineFollowsItsAdapter() {
  const std::string system = path("moving").toStdString();
  plugIn(path("moving"), "1-2", "ttyUSB0", "A10KWXYZ\n");
  FollowedLine line("/dev/ttyUSB0@19200", system);
  QCOMPARE(line.now(), std::string("/dev/ttyUSB0@19200"));
  // Pulled: it is asked for where it was, until it is somewhere.
  std::filesystem::remove_all(system + "/devices/usb1/1-2");
  std::filesystem::remove_all(system + "/class/tty/ttyUSB0");
  QCOMPARE(line.now(), std::string("/dev/ttyUSB0@19200"));
  plugIn(path("moving"), "1-3", "ttyUSB3", "A10KWXYZ\n");
  QCOMPARE(line.now(), std::string("/dev/ttyUSB3@19200"));
  // Another adapter under the first name is not it.
  plugIn(path("moving"), "1-2", "ttyUSB0", "B20\n");
  QCOMPARE(line.now(), std::string("/dev/ttyUSB3@19200"));
  for (const char* fixed : {"tcp:localhost:4000", "/dev/ttyS0@9600", "/tmp/a link"})
    QCOMPARE(FollowedLine(fixed, system).now(), std::string(fixed));
}

FIELDTRUE_TEST(TrackerSearchTest)
#include "tracker_search_test.moc"
