#include "acquisition/protocols/openigtlink_messages.h"

#include <QTest>
#include <limits>
#include <numbers>

#include "tests/acquisition/protocols/openigtlink_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// A quarter turn about z at 10, -20, 30.5 mm, as in the hand-made messages.
const Pose kQuarterTurn{{0.010, -0.020, 0.0305}, Eigen::Quaterniond(std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5))};

IgtlHeader headerOf(const std::string& type, int version = 1) {
  IgtlHeader header;
  header.type = type;
  header.device = "Probe";
  header.version = version;
  return header;
}

std::string floats(const std::vector<float>& numbers) {
  std::string out;
  for (const float number : numbers) {
    const auto word = std::bit_cast<std::uint32_t>(number);
    for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(word >> shift & 0xFF);
  }
  return out;
}

std::string statusOfMatrix(const std::vector<float>& columns_and_position) {
  const auto readings = readingsOf(headerOf("TRANSFORM"), floats(columns_and_position));
  FT_CHECK(readings && readings->size() == 1);
  return readings->front().status;
}

}  // namespace

class OpenigtlinkMessagesTest : public QObject {
  Q_OBJECT
 private slots:
  void crcOfTheStandard();
  void header();
  void noHeader_data();
  void noHeader();
  void stamps();
  void transform();
  void position_data();
  void position();
  void trackingData();
  void quaternionTrackingData();
  void nobodyIsVisible();
  void lengthsThatDoNotFit_data();
  void lengthsThatDoNotFit();
  void extendedHeaderAndMetadata();
  void extendedHeadersThatDoNotFit_data();
  void extendedHeadersThatDoNotFit();
  void noRotation_data();
  void noRotation();
  void roundedRotationsAreTaken();
  void everyStatusHasAMeaning();
  void serverStatus();
  void writesWhatItReads();
};

void OpenigtlinkMessagesTest::crcOfTheStandard() {
  // The check value of CRC-64/ECMA-182.
  QCOMPARE(igtlCrc("123456789"), std::uint64_t{0x6C40DF5F0B497347});
  QCOMPARE(igtlCrc(""), std::uint64_t{0});
}

void OpenigtlinkMessagesTest::header() {
  const auto header = decodeIgtlHeader(kIgtlTransform);
  QVERIFY(header.has_value());
  QCOMPARE(header->version, 1);
  QCOMPARE(header->type, std::string("TRANSFORM"));
  QCOMPARE(header->device, std::string("Probe"));
  QCOMPARE(secondsOfIgtlStamp(header->stamp), 1700000000.5);
  QCOMPARE(header->body_bytes, std::uint64_t{48});
  QCOMPARE(header->crc, std::uint64_t{0x9C7663F5F9CD7B70});
  QCOMPARE(igtlCrc(kIgtlQuarterTurn), header->crc);
}

void OpenigtlinkMessagesTest::noHeader_data() {
  QTest::addColumn<int>("offset");
  QTest::addColumn<int>("value");
  QTest::newRow("version 0") << 1 << 0;
  QTest::newRow("version 4") << 1 << 4;
  QTest::newRow("version 257") << 0 << 1;
  QTest::newRow("no type") << 2 << 0;
  QTest::newRow("type not printable") << 3 << 0x80;
  QTest::newRow("bytes after the type") << 13 << 0x58;
  QTest::newRow("name not printable") << 15 << 7;
  QTest::newRow("bytes after the name") << 33 << 0x58;
  QTest::newRow("body of 4 GiB") << 45 << 1;
}

void OpenigtlinkMessagesTest::noHeader() {
  QFETCH(int, offset);
  QFETCH(int, value);
  std::string wrong = kIgtlTransform;
  wrong[static_cast<std::size_t>(offset)] = static_cast<char>(value);
  QVERIFY(!decodeIgtlHeader(wrong));
  QVERIFY(!decodeIgtlHeader(kIgtlTransform.substr(0, 57)));
}

void OpenigtlinkMessagesTest::stamps() {
  QCOMPARE(igtlStampOf(1.5), std::uint64_t{0x0000000180000000});
  QCOMPARE(secondsOfIgtlStamp(0x0000000140000000), 1.25);
  // A microsecond is kept although the seconds take nine digits.
  const double seconds = 1700000000.123456;
  FT_VERIFY_MATCH(near(secondsOfIgtlStamp(igtlStampOf(seconds)), seconds, 3e-7));
  QCOMPARE(igtlStampOf(1.9999999999999), std::uint64_t{0x0000000200000000});
}

void OpenigtlinkMessagesTest::transform() {
  const auto readings = readingsOf(headerOf("TRANSFORM"), kIgtlQuarterTurn);
  QVERIFY(readings && readings->size() == 1);
  QCOMPARE(readings->front().name, std::string("Probe"));
  QCOMPARE(readings->front().status, std::string());
  FT_VERIFY_MATCH(near(readings->front().tracker_from_sensor, kQuarterTurn, 1e-9, 1e-7));
}

void OpenigtlinkMessagesTest::position_data() {
  QTest::addColumn<QByteArray>("body");
  QTest::addColumn<QByteArray>("status");
  const QByteArray place = QByteArray::fromStdString(floats({10.0f, -20.0f, 30.5f}));
  const float half = std::sqrt(0.5f);
  QTest::newRow("four") << place + QByteArray::fromStdString(floats({0.0f, 0.0f, half, half})) << QByteArray();
  QTest::newRow("three") << place + QByteArray::fromStdString(floats({0.0f, 0.0f, half})) << QByteArray();
  QTest::newRow("none") << place << QByteArray("no_orientation");
}

void OpenigtlinkMessagesTest::position() {
  QFETCH(QByteArray, body);
  QFETCH(QByteArray, status);
  const auto readings = readingsOf(headerOf("POSITION"), body.toStdString());
  QVERIFY(readings && readings->size() == 1);
  QCOMPARE(readings->front().status, status.toStdString());
  if (status.isEmpty()) FT_VERIFY_MATCH(near(readings->front().tracker_from_sensor, kQuarterTurn, 1e-9, 1e-6));
}

void OpenigtlinkMessagesTest::trackingData() {
  const std::string body = bytes("Tip<000000 00000000 00000000 00000000 0000 0200>") + kIgtlQuarterTurn +
                           bytes("Needle<00000000 00000000 00000000 00000300>") + kIgtlQuarterTurn;
  QCOMPARE(body.size(), std::size_t{140});
  const auto readings = readingsOf(headerOf("TDATA"), body);
  QVERIFY(readings && readings->size() == 2);
  QCOMPARE(readings->at(0).name, std::string("Tip"));
  QCOMPARE(readings->at(0).status, std::string());
  FT_VERIFY_MATCH(near(readings->at(0).tracker_from_sensor, kQuarterTurn, 1e-9, 1e-7));
  QCOMPARE(readings->at(1).name, std::string("Needle"));
  QCOMPARE(readings->at(1).status, std::string("no_orientation"));
}

void OpenigtlinkMessagesTest::quaternionTrackingData() {
  const std::string body = bytes(
      "Tip<000000 00000000 00000000 00000000 0000 0200 41200000 C1A00000 41F40000 00000000 00000000 3F3504F3 "
      "3F3504F3>");
  const auto readings = readingsOf(headerOf("QTDATA"), body);
  QVERIFY(readings && readings->size() == 1);
  QCOMPARE(readings->front().status, std::string());
  FT_VERIFY_MATCH(near(readings->front().tracker_from_sensor, kQuarterTurn, 1e-9, 1e-7));
}

void OpenigtlinkMessagesTest::nobodyIsVisible() {
  const auto readings = readingsOf(headerOf("TDATA"), {});
  QVERIFY(readings && readings->empty());
}

void OpenigtlinkMessagesTest::lengthsThatDoNotFit_data() {
  QTest::addColumn<QByteArray>("type");
  QTest::addColumn<int>("bytes");
  QTest::newRow("TRANSFORM") << QByteArray("TRANSFORM") << 47;
  QTest::newRow("POSITION") << QByteArray("POSITION") << 16;
  QTest::newRow("TDATA") << QByteArray("TDATA") << 71;
  QTest::newRow("QTDATA") << QByteArray("QTDATA") << 70;
  QTest::newRow("another type") << QByteArray("IMAGE") << 48;
}

void OpenigtlinkMessagesTest::lengthsThatDoNotFit() {
  QFETCH(QByteArray, type);
  QFETCH(int, bytes);
  QVERIFY(!readingsOf(headerOf(type.toStdString()), std::string(static_cast<std::size_t>(bytes), '\0')));
}

namespace {

/// Version 3: extended header of 12 bytes, a matrix, two entries of metadata.
std::string bodyWithMetadata(const std::string& transform_status) {
  const std::string text = "AbcTransformStatus" + transform_status;
  const auto size = static_cast<char>(transform_status.size());
  return bytes("<000C 0012>") + std::string(3, '\0') + static_cast<char>(text.size()) + bytes("<00000007>") +
         kIgtlQuarterTurn + bytes("<0002 0001 0003 00000002 000F 0003 000000>") + size + text;
}

}  // namespace

void OpenigtlinkMessagesTest::extendedHeaderAndMetadata() {
  // Whole, as noted from another program.
  QCOMPARE(bodyWithMetadata("OUT_OF_VIEW").size(), std::size_t{107});
  QCOMPARE(igtlCrc(bodyWithMetadata("OUT_OF_VIEW")), std::uint64_t{0xBD8ACF7A54459C84});
  for (const char* there : {"OK", "SWITCH1_ON"}) {
    const auto readings = readingsOf(headerOf("TRANSFORM", 2), bodyWithMetadata(there));
    QVERIFY(readings && readings->size() == 1);
    QCOMPARE(readings->front().status, std::string());
    FT_VERIFY_MATCH(near(readings->front().tracker_from_sensor, kQuarterTurn, 1e-9, 1e-7));
  }
  // The server says that the tool is not seen: its last matrix is no reading.
  const auto unseen = readingsOf(headerOf("TRANSFORM", 2), bodyWithMetadata("OUT_OF_VIEW"));
  QVERIFY(unseen && unseen->size() == 1);
  QCOMPARE(unseen->front().status, std::string("out_of_view"));
  // A longer extended header of a version to come is passed over; so is one without metadata.
  const std::string longer = bytes("<000E 0000 00000000 00000007 ABCD>") + kIgtlQuarterTurn;
  QCOMPARE(readingsOf(headerOf("TRANSFORM", 3), longer)->front().status, std::string());
}

void OpenigtlinkMessagesTest::extendedHeadersThatDoNotFit_data() {
  QTest::addColumn<QByteArray>("body");
  const QByteArray matrix = QByteArray::fromStdString(kIgtlQuarterTurn);
  QTest::newRow("none") << QByteArray();
  QTest::newRow("cut") << QByteArray::fromStdString(bytes("<000C 0000 0000>"));
  QTest::newRow("too short") << QByteArray::fromStdString(bytes("<000B 0000 00000000 00000000>")) + matrix;
  QTest::newRow("longer than the body") << QByteArray::fromStdString(bytes("<FFFF 0000 00000000 00000000>")) + matrix;
  QTest::newRow("metadata too long") << QByteArray::fromStdString(bytes("<000C 0000 FFFFFFFF 00000000>")) + matrix;
  QTest::newRow("version 1 in disguise") << matrix;
}

void OpenigtlinkMessagesTest::extendedHeadersThatDoNotFit() {
  QFETCH(QByteArray, body);
  QVERIFY(!readingsOf(headerOf("TRANSFORM", 2), body.toStdString()));
}

void OpenigtlinkMessagesTest::noRotation_data() {
  QTest::addColumn<QList<float>>("columns");
  QTest::addColumn<QByteArray>("status");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  QTest::newRow("mirrored") << QList<float>{-1, 0, 0, 0, 1, 0, 0, 0, 1} << QByteArray("mirrored");
  QTest::newRow("scaled") << QList<float>{2, 0, 0, 0, 2, 0, 0, 0, 2} << QByteArray("scaled");
  QTest::newRow("scaled by 1 %") << QList<float>{1.01f, 0, 0, 0, 1, 0, 0, 0, 1} << QByteArray("scaled");
  QTest::newRow("sheared") << QList<float>{1, 0, 0, 0.1f, 0.995f, 0, 0, 0, 1} << QByteArray("sheared");
  QTest::newRow("zeros") << QList<float>{0, 0, 0, 0, 0, 0, 0, 0, 0} << QByteArray("missing");
  QTest::newRow("not numbers") << QList<float>{1, 0, 0, 0, nan, 0, 0, 0, 1} << QByteArray("damaged");
}

void OpenigtlinkMessagesTest::noRotation() {
  QFETCH(QList<float>, columns);
  QFETCH(QByteArray, status);
  std::vector<float> numbers(columns.begin(), columns.end());
  numbers.insert(numbers.end(), {10.0f, 20.0f, 30.0f});
  QCOMPARE(statusOfMatrix(numbers), status.toStdString());
}

void OpenigtlinkMessagesTest::roundedRotationsAreTaken() {
  // 30 deg about z with four decimals.
  QCOMPARE(statusOfMatrix({0.8660f, 0.5f, 0, -0.5f, 0.8660f, 0, 0, 0, 1, 0, 0, 0}), std::string());
  const auto place_of_nan = statusOfMatrix({1, 0, 0, 0, 1, 0, 0, 0, 1, std::numeric_limits<float>::infinity(), 0, 0});
  QCOMPARE(place_of_nan, std::string("damaged"));
}

void OpenigtlinkMessagesTest::everyStatusHasAMeaning() {
  QCOMPARE(igtlStatusMeaning(""), std::string());
  for (const char* status : {"mirrored", "scaled", "sheared", "missing", "damaged", "no_orientation"}) {
    QVERIFY(!igtlStatusMeaning(status).empty() && igtlStatusMeaning(status).find("server says") == std::string::npos);
  }
  QCOMPARE(igtlStatusMeaning("out_of_view"), std::string("the server says out_of_view"));
}

void OpenigtlinkMessagesTest::serverStatus() {
  const std::string body = bytes("<000D 00000000 00000000>NotReady<00000000 00000000 00000000>starting up<00>");
  const auto status = serverStatusOf(headerOf("STATUS"), body);
  QVERIFY(status.has_value());
  QCOMPARE(status->code, 13);
  QCOMPARE(status->name, std::string("NotReady"));
  QCOMPARE(status->message, std::string("starting up"));
  QVERIFY(!serverStatusOf(headerOf("STATUS"), body.substr(0, 29)));
  QVERIFY(!serverStatusOf(headerOf("STRING"), body));
}

void OpenigtlinkMessagesTest::writesWhatItReads() {
  // The whole message byte for byte, then the bodies through the readers, which the tests above hold to hand-made
  // bytes.
  Pose turn = kQuarterTurn;
  turn.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  const std::string written = encodeIgtl("TRANSFORM", "Probe", igtlStampOf(1700000000.5), kIgtlQuarterTurn);
  QCOMPARE(QByteArray::fromStdString(written), QByteArray::fromStdString(kIgtlTransform));
  const Pose odd{{1.234, -0.5, 0.077}, Eigen::Quaterniond(0.7, -0.3, 0.5, 0.4).normalized()};
  const std::vector<IgtlReading> two = {{"One", turn, {}}, {"A name of 21 letters.", odd, {}}};
  const auto matrices = readingsOf(headerOf("TDATA"), encodeTrackingBody(two));
  const auto quaternions = readingsOf(headerOf("QTDATA"), encodeQuaternionTrackingBody(two));
  for (const auto& read : {matrices, quaternions}) {
    QVERIFY(read && read->size() == 2);
    QCOMPARE(read->at(1).name, std::string("A name of 21 letters"));
    FT_VERIFY_MATCH(near(read->at(0).tracker_from_sensor, turn, 1e-8, 1e-6));
    FT_VERIFY_MATCH(near(read->at(1).tracker_from_sensor, odd, 1e-7, 1e-6));
  }
  FT_VERIFY_MATCH(
      near(readingsOf(headerOf("TRANSFORM"), encodeTransformBody(odd))->front().tracker_from_sensor, odd, 1e-7, 1e-6));
  FT_VERIFY_MATCH(
      near(readingsOf(headerOf("POSITION"), encodePositionBody(odd))->front().tracker_from_sensor, odd, 1e-7, 1e-6));
  QCOMPARE(encodeStartTrackingBody(), std::string(36, '\0'));
  const auto status = serverStatusOf(headerOf("STATUS"), encodeServerStatusBody({13, "NotReady", "wait"}));
  QCOMPARE(status->code, 13);
  QCOMPARE(status->name, std::string("NotReady"));
  QCOMPARE(status->message, std::string("wait"));
}

FIELDTRUE_TEST(OpenigtlinkMessagesTest)
#include "openigtlink_messages_test.moc"
