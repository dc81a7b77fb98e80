#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <QElapsedTimer>
#include <QSignalSpy>
#include <QTcpServer>
#include <QTcpSocket>
#include <QTemporaryDir>
#include <QTest>
#include <cerrno>

#include "acquisition/emulators/emulator_endpoint.h"
#include "acquisition/emulators/pty_endpoint.h"
#include "acquisition/transports/line_driver.h"
#include "acquisition/transports/line_errors.h"
#include "tests/support/matchers.h"
#include "tests/support/silent_port.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

std::unique_ptr<Transport> lineTo(const QString& address) {
  auto line = makeTransport(address.toStdString());
  FT_CHECK(line.has_value());
  return std::move(*line);
}

/// A sentence of a few words that ends without a line break.
bool isOneSentence(const std::string& text) {
  return text.size() > 20 && text.find('\n') == std::string::npos && text.find(' ') != std::string::npos;
}

}  // namespace

class TransportTest : public QObject {
  Q_OBJECT
 private slots:
  void init() { folder_ = std::make_unique<QTemporaryDir>(); }
  void badAddresses_data();
  void badAddresses();
  void doesNotExist();
  void isNoLine();
  void isBusy();
  void noPermission();
  void everyReasonIsASentence_data();
  void everyReasonIsASentence();
  void carriesBytesBothWays_data();
  void carriesBytesBothWays();
  void keepsBytesRaw();
  void losesAPulledPty();
  void reopensAPty();
  void tcpNobodyListens();
  void tcpNobodyAnswers();
  void tcpPeerCloses();
  void tcpTurnsASecondHostAway();
  void ptysHaveNoRate();

 private:
  QString path(const char* name) const { return folder_->filePath(name); }
  std::unique_ptr<QTemporaryDir> folder_;
};

void TransportTest::badAddresses_data() {
  QTest::addColumn<QByteArray>("address");
  QTest::newRow("empty") << QByteArray("");
  QTest::newRow("only a rate") << QByteArray("@115200");
  QTest::newRow("rate not a number") << QByteArray("/dev/ttyUSB0@fast");
  QTest::newRow("negative rate") << QByteArray("/dev/ttyUSB0@-9600");
  QTest::newRow("no port") << QByteArray("tcp:localhost");
  QTest::newRow("port not a number") << QByteArray("tcp:localhost:http");
  QTest::newRow("port too large") << QByteArray("tcp:localhost:70000");
  QTest::newRow("no host") << QByteArray("tcp::4000");
}

void TransportTest::badAddresses() {
  QFETCH(QByteArray, address);
  const auto line = makeTransport(address.toStdString());
  QVERIFY(!line);
  QCOMPARE(line.error().code, ErrorCode::kBadInput);
  QVERIFY(isOneSentence(line.error().message));
}

void TransportTest::doesNotExist() {
  const auto opened = lineTo("/dev/ttyUSB77@19200")->openLine();
  QVERIFY(!opened);
  QCOMPARE(opened.error().code, ErrorCode::kDevice);
  FT_VERIFY_MATCH(holdsAll(opened.error().message, {"/dev/ttyUSB77", "does not exist"}));
}

void TransportTest::isNoLine() {
  QFile file(path("notes.txt"));
  QVERIFY(file.open(QIODevice::WriteOnly));
  const auto opened = lineTo(file.fileName())->openLine();
  FT_VERIFY_MATCH(holdsAll(opened.error().message, {"notes.txt", "not a serial line"}));
  FT_VERIFY_MATCH(holdsAll(lineTo("/dev/null")->openLine().error().message, {"/dev/null", "not a serial line"}));
}

void TransportTest::isBusy() {
  PtyEndpoint device(path("tracker"));
  FT_VERIFY_OK(device.open());
  auto first = lineTo(path("tracker"));
  FT_VERIFY_OK(first->openLine());
  const auto second = lineTo(path("tracker"))->openLine();
  QVERIFY(!second);
  FT_VERIFY_MATCH(
      holdsAll(second.error().message, {"busy", "process " + QByteArray::number(::getpid()), "close that program"}));
  first->close();
  FT_VERIFY_OK(lineTo(path("tracker"))->openLine());
}

void TransportTest::noPermission() {
  FT_VERIFY_MATCH(holdsAll(lineOpenError("/dev/ttyUSB0", EACCES).message, {"/dev/ttyUSB0", "dialout"}));
  if (::geteuid() != 0) QSKIP("The rest needs root, to take its own rights away");
  PtyEndpoint device(path("tracker"));
  FT_VERIFY_OK(device.open());
  QVERIFY(QFile::setPermissions(device.terminal(), QFileDevice::ReadOwner));
  QVERIFY(::seteuid(65534) == 0);
  const auto opened = lineTo(device.terminal())->openLine();
  QVERIFY(::seteuid(0) == 0);
  QVERIFY(!opened);
  FT_VERIFY_MATCH(holdsAll(opened.error().message, {"dialout"}));
}

void TransportTest::everyReasonIsASentence_data() {
  QTest::addColumn<int>("reason");
  QTest::addColumn<QByteArray>("fragment");
  QTest::newRow("ENOENT") << ENOENT << QByteArray("does not exist");
  QTest::newRow("EBUSY") << EBUSY << QByteArray("busy");
  QTest::newRow("EPERM") << EPERM << QByteArray("dialout");
  QTest::newRow("ENXIO") << ENXIO << QByteArray("plug");
  QTest::newRow("ENOTTY") << ENOTTY << QByteArray("not a serial line");
  QTest::newRow("EMFILE") << EMFILE << QByteArray("open files");
}

void TransportTest::everyReasonIsASentence() {
  QFETCH(int, reason);
  QFETCH(QByteArray, fragment);
  const Error error = lineOpenError("/dev/ttyS9", reason);
  QVERIFY(isOneSentence(error.message));
  FT_VERIFY_MATCH(holdsAll(error.message, {"/dev/ttyS9", fragment}));
}

void TransportTest::carriesBytesBothWays_data() {
  QTest::addColumn<QByteArray>("carrier");
  for (const char* carrier : {"in process", "pty", "tcp"}) QTest::newRow(carrier) << QByteArray(carrier);
}

void TransportTest::carriesBytesBothWays() {
  QFETCH(QByteArray, carrier);
  std::unique_ptr<EmulatorEndpoint> device;
  std::unique_ptr<Transport> host;
  if (carrier == "in process") {
    auto [host_end, device_end] = LoopbackTransport::pair();
    host = std::move(host_end);
    device = std::make_unique<LoopbackEndpoint>(std::move(device_end));
  } else if (carrier == "pty") {
    device = std::make_unique<PtyEndpoint>(path("tracker"));
  } else {
    device = std::make_unique<TcpEndpoint>(quint16{0});
  }
  FT_VERIFY_OK(device->open());
  if (!host) host = lineTo(device->address());
  FT_VERIFY_OK(host->openLine());
  QTRY_VERIFY(host->isOpen());

  QByteArray at_device, at_host;
  connect(device.get(), &EmulatorEndpoint::received, this, [&](const QByteArray& bytes) { at_device += bytes; });
  connect(host.get(), &QIODevice::readyRead, this, [&] { at_host += host->readAll(); });
  QByteArray all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
  QCOMPARE(host->write(all), all.size());
  QTRY_COMPARE(at_device, all);
  // Far more than a pty's buffer holds, in small writes, and nothing is lost.
  QByteArray sent;
  for (int i = 0; i < 3000; ++i) {
    const QByteArray record = QByteArray::number(i).rightJustified(34, '.') + '\n';
    device->send(record);
    sent += record;
  }
  QTRY_COMPARE_WITH_TIMEOUT(at_host.size(), sent.size(), 10000);
  QVERIFY(at_host == sent);
}

void TransportTest::keepsBytesRaw() {
  PtyEndpoint device(path("tracker"));
  FT_VERIFY_OK(device.open());
  auto host = lineTo(path("tracker"));
  FT_VERIFY_OK(host->openLine());
  QByteArray echoed;
  connect(&device, &EmulatorEndpoint::received, this, [&](const QByteArray& bytes) { echoed += bytes; });
  device.send(QByteArray("01 \x03\x04\x11\x13\r\n\x19", 10));
  QTRY_COMPARE(host->bytesAvailable(), qint64{10});
  QCOMPARE(host->readAll(), QByteArray("01 \x03\x04\x11\x13\r\n\x19", 10));
  QTest::qWait(20);
  QVERIFY2(echoed.isEmpty(), "the terminal echoes what the device sends");
}

void TransportTest::losesAPulledPty() {
  auto device = std::make_unique<PtyEndpoint>(path("tracker"));
  FT_VERIFY_OK(device->open());
  auto host = lineTo(path("tracker"));
  FT_VERIFY_OK(host->openLine());
  QSignalSpy lost(host.get(), &Transport::lineLost);
  device->send("last words");
  QTRY_COMPARE(host->bytesAvailable(), qint64{10});
  device->unplug();
  QTRY_COMPARE(lost.count(), 1);
  QVERIFY(lost[0][0].toString().contains("unplugged"));
  QCOMPARE(host->readAll(), QByteArray("last words"));
  QCOMPARE(host->write("c"), qint64{-1});
  QTest::qWait(20);
  QCOMPARE(lost.count(), 1);
  QVERIFY(!QFileInfo(path("tracker")).isSymLink());
}

void TransportTest::reopensAPty() {
  PtyEndpoint device(path("tracker"));
  FT_VERIFY_OK(device.open());
  for (int i = 0; i < 3; ++i) {
    auto host = lineTo(path("tracker"));
    FT_VERIFY_OK(host->openLine());
    QSignalSpy heard(&device, &EmulatorEndpoint::received);
    host->write("S");
    QTRY_COMPARE(heard.count(), 1);
  }
}

void TransportTest::tcpNobodyListens() {
  QTcpServer server;
  QVERIFY(server.listen(QHostAddress::LocalHost));
  const QString address = QString("tcp:127.0.0.1:%1").arg(server.serverPort());
  server.close();
  const auto line = lineTo(address);
  QSignalSpy lost(line.get(), &Transport::lineLost);
  QSignalSpy opened(line.get(), &Transport::lineOpened);
  for (int time = 1; time <= 2; ++time) {
    FT_VERIFY_OK(line->openLine());
    QTRY_COMPARE(lost.count(), time);
    FT_VERIFY_MATCH(holdsAll(lost.last()[0].toString().toStdString(), {"Nothing listens", "127.0.0.1"}));
  }
  QCOMPARE(opened.count(), 0);
}

void TransportTest::tcpNobodyAnswers() {
  const testing::SilentPort port;
  const auto line = lineTo(QString("tcp:127.0.0.1:%1").arg(port.number()));
  QSignalSpy lost(line.get(), &Transport::lineLost);
  QElapsedTimer timer;
  timer.start();
  FT_VERIFY_OK(line->openLine());
  QVERIFY2(timer.elapsed() < 500, "nobody waits for it");
  line->close();
  FT_VERIFY_OK(line->openLine());
  QTRY_COMPARE_WITH_TIMEOUT(lost.count(), 1, 6000);
  FT_VERIFY_MATCH(holdsAll(lost[0][0].toString().toStdString(), {"127.0.0.1", "did not answer within 3 s"}));
}

void TransportTest::tcpPeerCloses() {
  TcpEndpoint device(0);
  FT_VERIFY_OK(device.open());
  auto host = lineTo(device.address());
  FT_VERIFY_OK(host->openLine());
  QTRY_VERIFY(host->isOpen());
  QSignalSpy lost(host.get(), &Transport::lineLost);
  QTest::qWait(20);
  device.unplug();
  QTRY_COMPARE(lost.count(), 1);
  QVERIFY(lost[0][0].toString().contains("closed the connection"));
}

void TransportTest::tcpTurnsASecondHostAway() {
  TcpEndpoint device(0);
  FT_VERIFY_OK(device.open());
  auto first = lineTo(device.address());
  FT_VERIFY_OK(first->openLine());
  QTRY_VERIFY(first->isOpen());
  QTest::qWait(20);
  auto second = lineTo(device.address());
  QSignalSpy lost(second.get(), &Transport::lineLost);
  FT_VERIFY_OK(second->openLine());
  QTRY_COMPARE(lost.count(), 1);
}

void TransportTest::ptysHaveNoRate() {
  PtyEndpoint device({});
  FT_VERIFY_OK(device.open());
  QVERIFY(isPseudoTerminal(device.terminal().toStdString()));
  auto host = lineTo(device.terminal() + "@12345");
  FT_VERIFY_OK(host->openLine());
  QVERIFY(!host->setBaud(9600));
}

FIELDTRUE_TEST(TransportTest)
#include "transport_test.moc"
