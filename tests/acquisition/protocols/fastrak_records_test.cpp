#include <QTest>
#include <cmath>
#include <limits>
#include <set>

#include "acquisition/protocols/fastrak.h"
#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

Q_DECLARE_METATYPE(std::vector<int>)
Q_DECLARE_METATYPE(FastrakFormat)

namespace {

/// Of the exchange with VRPN: az 30, el 10, roll -20 deg at (0.254, -0.127, 0.0635) m.
const Pose kStation1{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};

FastrakLayout layoutOf(const std::vector<int>& items, FastrakFormat format) {
  auto layout = fastrakLayout(items, format);
  FT_CHECK(layout.has_value());
  return *layout;
}

std::optional<FastrakRecord> decode(const std::string& record, const std::vector<int>& items, FastrakFormat format,
                                    FastrakUnit unit) {
  return decodeRecord(record, layoutOf(items, format), unit);
}

}  // namespace

class FastrakRecordsTest : public QObject {
  Q_OBJECT
 private slots:
  void lengthsOfTheManual_data();
  void lengthsOfTheManual();
  void refusesBadLists();
  void poseInEveryForm_data();
  void poseInEveryForm();
  void touchingFields();
  void fieldsByColumn_data();
  void fieldsByColumn();
  void twoByteItems();
  void stylusSwitch();
  void fixedBytesMustStandThere();
  void missingReadings_data();
  void missingReadings();
  void writesWhatItReads_data();
  void writesWhatItReads();
  void clampsWhatDoesNotFit();
  void statusRecord();
  void statusOfFiftyFourBytes();
  void statusInGarbage();
  void statusFlags();
  void refusals();
  void meanings();
  void readsBack();
};

void FastrakRecordsTest::lengthsOfTheManual_data() {
  QTest::addColumn<std::vector<int>>("items");
  QTest::addColumn<FastrakFormat>("format");
  QTest::addColumn<int>("length");
  QTest::newRow("default ASCII") << std::vector{2, 4, 1} << FastrakFormat::kAscii << 47;
  QTest::newRow("default binary") << std::vector{2, 4, 1} << FastrakFormat::kBinary << 29;
  QTest::newRow("VRPN binary") << std::vector{2, 11, 0} << FastrakFormat::kBinary << 32;
  QTest::newRow("driver binary") << std::vector{2, 11, 16, 1} << FastrakFormat::kBinary << 35;
  QTest::newRow("extended ASCII") << std::vector{52, 61, 51} << FastrakFormat::kAscii << 3 + 39 + 52 + 2;
  QTest::newRow("two bytes a value") << std::vector{18, 20, 1} << FastrakFormat::kBinary << 3 + 6 + 8 + 2;
  QTest::newRow("cosines ASCII") << std::vector{5, 6, 7, 0} << FastrakFormat::kAscii << 3 + 63 + 1;
}

void FastrakRecordsTest::lengthsOfTheManual() {
  QFETCH(std::vector<int>, items);
  QFETCH(FastrakFormat, format);
  QTEST(static_cast<int>(layoutOf(items, format).bytes), "length");
}

void FastrakRecordsTest::refusesBadLists() {
  FT_VERIFY_MATCH(holdsAll(fastrakLayout(std::vector{2, 9}, FastrakFormat::kAscii).error().message, {"item 9"}));
  FT_VERIFY_MATCH(holdsAll(fastrakLayout(std::vector{18}, FastrakFormat::kAscii).error().message, {"18", "binary"}));
  FT_VERIFY_MATCH(
      holdsAll(fastrakLayout(std::vector<int>(33, 0), FastrakFormat::kAscii).error().message, {"32", "33"}));
  // 3 + 7 * 39 = 276 bytes.
  FT_VERIFY_MATCH(
      holdsAll(fastrakLayout(std::vector<int>(7, 52), FastrakFormat::kAscii).error().message, {"254", "276"}));
}

void FastrakRecordsTest::poseInEveryForm_data() {
  QTest::addColumn<QByteArray>("record");
  QTest::addColumn<std::vector<int>>("items");
  QTest::addColumn<bool>("binary");
  QTest::addColumn<bool>("centimetres");
  QTest::addColumn<double>("rotation_tolerance_rad");
  const auto row = [](const char* name, std::string_view text, const std::vector<int>& items, bool binary, bool cm,
                      double tolerance) {
    QTest::newRow(name) << QByteArray::fromStdString(bytes(text)) << items << binary << cm << tolerance;
  };
  row("binary quaternion, inches", kVrpnBinary, {2, 11, 0}, true, false, 2e-6);
  row("ASCII quaternion, inches", kVrpnAscii, {2, 11, 0}, false, false, 2e-4);
  row("ASCII angles, inches", "01   10.00  -5.00   2.50  30.00  10.00 -20.00<0D0A>", {2, 4, 1}, false, false, 2e-6);
  row("ASCII angles, centimetres", "01   25.40 -12.70   6.35  30.00  10.00 -20.00<0D0A>", {2, 4, 1}, false, true, 2e-6);
  row("ASCII cosines, inches",
      "01   10.00  -5.00   2.50 0.8529-0.5213-0.0297 0.4924 0.7841 0.3778-0.1736-0.3368 0.9254 ", {2, 5, 6, 7, 0},
      false, false, 2e-4);
  row("extended precision",
      "01  1.00000E+01 -5.00000E+00  2.50000E+00  9.43714E-01 -1.89308E-01  3.81350E-02  2.68536E-01 <0D0A>",
      {52, 61, 51}, false, false, 2e-6);
  row("extended, blank exponent sign",
      "01  1.00000E 01 -5.00000E 00  2.50000E 00  3.00000E 01  1.00000E 01 -2.00000E 01 <0D0A>", {52, 54, 51}, false,
      false, 2e-6);
}

void FastrakRecordsTest::poseInEveryForm() {
  QFETCH(QByteArray, record);
  QFETCH(std::vector<int>, items);
  QFETCH(bool, binary);
  QFETCH(bool, centimetres);
  QFETCH(double, rotation_tolerance_rad);
  const auto decoded = decode(record.toStdString(), items, binary ? FastrakFormat::kBinary : FastrakFormat::kAscii,
                              centimetres ? FastrakUnit::kCentimetre : FastrakUnit::kInch);
  QVERIFY(decoded.has_value());
  QCOMPARE(decoded->station, 1);
  QCOMPARE(decoded->error, ' ');
  const Sample sample = toSample(*decoded, 1.5);
  QCOMPARE(sample.status, std::string());
  QCOMPARE(sample.sensor, 0);
  QCOMPARE(sample.time_s, 1.5);
  FT_VERIFY_MATCH(near(sample.tracker_from_sensor, kStation1, 1e-7, rotation_tolerance_rad));
}

void FastrakRecordsTest::touchingFields() {
  const auto record = decode(bytes("02k-123.45-123.45 -99.99-170.00 -80.00-179.99<0D0A>"), {2, 4, 1},
                             FastrakFormat::kAscii, FastrakUnit::kCentimetre);
  QVERIFY(record.has_value());
  QCOMPARE(record->station, 2);
  QCOMPARE(record->error, 'k');
  FT_VERIFY_MATCH(near(*record->position_m, Eigen::Vector3d(-1.2345, -1.2345, -0.9999), 1e-12));
  FT_VERIFY_MATCH(near(*record->euler_deg, Eigen::Vector3d(-170.0, -80.0, -179.99), 1e-12));
  const Sample sample = toSample(*record, 0.0);
  QCOMPARE(sample.sensor, 1);
  QCOMPARE(sample.status, std::string("k"));
}

void FastrakRecordsTest::fieldsByColumn_data() {
  QTest::addColumn<QByteArray>("x");
  QTest::addColumn<bool>("good");
  QTest::newRow("blank padded") << QByteArray("   1.25") << true;
  QTest::newRow("zero padded") << QByteArray(" 001.25") << true;
  QTest::newRow("sign before zeros") << QByteArray("-001.25") << true;
  QTest::newRow("sign at the digits") << QByteArray("  -1.25") << true;
  QTest::newRow("no digit before the point") << QByteArray("    .25") << true;
  QTest::newRow("point one column late") << QByteArray("  1.250") << false;
  QTest::newRow("letter") << QByteArray("   1.2x") << false;
  QTest::newRow("blank among digits") << QByteArray("  1 .25") << false;
  QTest::newRow("two signs") << QByteArray(" --1.25") << false;
  QTest::newRow("blank") << QByteArray("       ") << false;
}

void FastrakRecordsTest::fieldsByColumn() {
  QFETCH(QByteArray, x);
  const auto record =
      decode("01 " + x.toStdString() + "   0.00   0.00\r\n", {2, 1}, FastrakFormat::kAscii, FastrakUnit::kCentimetre);
  QTEST(record.has_value(), "good");
  if (!record) return;
  const double sign = x.contains('-') ? -1.0 : 1.0;
  const double expected_m = x.contains("1.25") ? sign * 0.0125 : 0.0025;
  FT_VERIFY_MATCH(near(record->position_m->x(), expected_m, 1e-15));
}

void FastrakRecordsTest::twoByteItems() {
  // 14-bit two's complement, seven bits a byte, low byte first: 0x2000 of 16384 counts is -full scale, 0x1000 half of
  // it.
  const std::string record = bytes("01 <8020 0040 0000><0D0A>");
  const auto decoded = decode(record, {18, 1}, FastrakFormat::kBinary, FastrakUnit::kInch);
  QVERIFY(decoded.has_value());
  FT_VERIFY_MATCH(near(*decoded->position_m, Eigen::Vector3d(1.5, -3.0, 0.0), 1e-12));
  QCOMPARE(encodeRecord(*decoded, layoutOf({18, 1}, FastrakFormat::kBinary), FastrakUnit::kInch), record);
  const auto angles = decode(bytes("01 <8020 0060 0000><0D0A>"), {19, 1}, FastrakFormat::kBinary, FastrakUnit::kInch);
  FT_VERIFY_MATCH(near(*angles->euler_deg, Eigen::Vector3d(90.0, -90.0, 0.0), 1e-12));
}

void FastrakRecordsTest::stylusSwitch() {
  for (const char pressed : {'0', '1'}) {
    const auto record =
        decode(std::string("01  ") + pressed + "\r\n", {16, 1}, FastrakFormat::kBinary, FastrakUnit::kInch);
    QVERIFY(record.has_value());
    QCOMPARE(record->stylus_pressed, std::optional(pressed == '1'));
  }
  QVERIFY(!decode("01  2\r\n", {16, 1}, FastrakFormat::kBinary, FastrakUnit::kInch));
}

void FastrakRecordsTest::fixedBytesMustStandThere() {
  const std::string good = bytes(kVrpnBinary);
  for (const std::size_t at : {std::size_t{0}, std::size_t{1}, good.size() - 1}) {
    std::string bad = good;
    bad[at] = 'x';
    QVERIFY(!decode(bad, {2, 11, 0}, FastrakFormat::kBinary, FastrakUnit::kInch));
  }
}

void FastrakRecordsTest::missingReadings_data() {
  QTest::addColumn<QByteArray>("record");
  QTest::addColumn<std::vector<int>>("items");
  QTest::addColumn<bool>("binary");
  QTest::addColumn<QByteArray>("status");
  const auto row = [](const char* name, std::string_view text, const std::vector<int>& items, bool binary,
                      const char* status) {
    QTest::newRow(name) << QByteArray::fromStdString(bytes(text)) << items << binary << QByteArray(status);
  };
  // The marker of recordings, -3.7e28, as float32.
  row("marker in the position", "01 <5E1BEFEE 0000A0C0 00002040><0D0A>", {2, 1}, true, "missing");
  row("NaN in the position", "01 <0000C07F 0000A0C0 00002040><0D0A>", {2, 1}, true, "missing");
  row("overflow in ASCII", "01 ******* -12.70   6.35<0D0A>", {2, 1}, false, "missing");
  row("no quaternion", "01 <00002041 0000A0C0 00002040><00000000 00000000 00000000 00000000> ", {2, 11, 0}, true,
      "damaged");
  row("changed byte in the quaternion", "01 <00002041 0000A0C0 00002040><3E97F13F F5D941BE 72331C3D 8D7D893E> ",
      {2, 11, 0}, true, "damaged");
  row("error letter stays", "01k<00002041 0000A0C0 00002040><00000000 00000000 00000000 00000000> ", {2, 11, 0}, true,
      "k");
}

void FastrakRecordsTest::missingReadings() {
  QFETCH(QByteArray, record);
  QFETCH(std::vector<int>, items);
  QFETCH(bool, binary);
  QFETCH(QByteArray, status);
  const auto decoded = decode(record.toStdString(), items, binary ? FastrakFormat::kBinary : FastrakFormat::kAscii,
                              FastrakUnit::kCentimetre);
  QVERIFY(decoded.has_value());
  const Sample sample = toSample(*decoded, 0.0);
  QCOMPARE(QByteArray::fromStdString(sample.status), status);
  QVERIFY(sample.tracker_from_sensor.position_m.allFinite());
  QVERIFY(!fastrakStatusMeaning(sample.status).empty());
}

void FastrakRecordsTest::writesWhatItReads_data() {
  QTest::addColumn<int>("item");
  QTest::addColumn<FastrakFormat>("format");
  for (const auto& item : fastrakItems()) {
    for (const FastrakFormat format : {FastrakFormat::kAscii, FastrakFormat::kBinary}) {
      if (!itemWidth(item, format)) continue;
      QTest::addRow("%d %s %s", item.id, item.name, format == FastrakFormat::kAscii ? "ASCII" : "binary")
          << item.id << format;
    }
  }
}

void FastrakRecordsTest::writesWhatItReads() {
  QFETCH(int, item);
  QFETCH(FastrakFormat, format);
  const FastrakLayout layout = layoutOf({item, 1}, format);
  FastrakRecord record = recordOfPose(3, 'x', kStation1, true);
  record.relative_m = Eigen::Vector3d(-0.1, 0.2, 0.3);
  const std::string once = encodeRecord(record, layout, FastrakUnit::kCentimetre);
  QCOMPARE(once.size(), layout.bytes);
  const auto read = decodeRecord(once, layout, FastrakUnit::kCentimetre);
  QVERIFY(read.has_value());
  QCOMPARE(read->station, 3);
  QCOMPARE(read->error, 'x');
  QCOMPARE(encodeRecord(*read, layout, FastrakUnit::kCentimetre), once);
  if (read->position_m) FT_VERIFY_MATCH(near(*read->position_m, *record.position_m, 3.2e-4));
  if (read->relative_m) FT_VERIFY_MATCH(near(*read->relative_m, *record.relative_m, 1e-4));
  if (read->stylus_pressed) QCOMPARE(*read->stylus_pressed, true);
}

void FastrakRecordsTest::clampsWhatDoesNotFit() {
  FastrakRecord record = recordOfPose(1, ' ', {{-50.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  const std::string text = encodeRecord(record, layoutOf({2, 1}, FastrakFormat::kAscii), FastrakUnit::kCentimetre);
  QCOMPARE(text, std::string("01 -999.99   0.00   0.00\r\n"));
}

void FastrakRecordsTest::statusRecord() {
  const std::string record = "21S3F2    F35  G1.02 Fastrak in the cellar           \r\n";
  QCOMPARE(record.size(), std::size_t{55});
  const auto status = findStatus(record);
  QVERIFY(status.has_value());
  QCOMPARE(status->unit, FastrakUnit::kCentimetre);
  QCOMPARE(status->format, FastrakFormat::kAscii);
  QCOMPARE(status->compensation, false);
  QCOMPARE(status->continuous, false);
  QCOMPARE(status->sensors, 5u);
  QVERIFY(status->plugged(1) && !status->plugged(2) && status->plugged(3) && !status->plugged(4));
  QCOMPARE(status->version, std::string("G1.02"));
  QCOMPARE(status->identity, std::string("Fastrak in the cellar"));
  QCOMPARE(encodeStatus(*status), record);
}

void FastrakRecordsTest::statusOfFiftyFourBytes() {
  const std::string record = "21S3F0    F31  4.2014InterSense IS-900              \r\n";
  QCOMPARE(record.size(), std::size_t{54});
  const auto status = findStatus(record);
  QVERIFY(status.has_value());
  QCOMPARE(status->version, std::string("4.2014"));
  QCOMPARE(status->identity, std::string("InterSense IS-900"));
}

void FastrakRecordsTest::statusInGarbage() {
  const std::string record = encodeStatus({});
  QVERIFY(findStatus("\x80\xFF 01  1.00\r\n2x" + record).has_value());
  QVERIFY(findStatus(record + "01 tail").has_value());
  for (std::size_t cut = 0; cut < record.size(); ++cut) QVERIFY(!findStatus(record.substr(0, cut)));
  for (std::size_t cut = 2; cut < record.size(); ++cut) QVERIFY(!findStatus(record.substr(cut)));
}

void FastrakRecordsTest::statusFlags() {
  // Hexadecimal codes of the manual's table.
  const auto flags = [](const char* code) {
    return *findStatus(std::string("21S") + code + "    F31  " + std::string(38, 'x') + "\r\n");
  };
  QCOMPARE(flags("3F1").format, FastrakFormat::kBinary);
  QCOMPARE(flags("3FC").compensation, true);
  QCOMPARE(flags("3FC").continuous, true);
  QCOMPARE(flags("3F7").unit, FastrakUnit::kCentimetre);
  QCOMPARE(flags("3F8").continuous, true);
  QCOMPARE(flags("3F8").compensation, false);
}

void FastrakRecordsTest::refusals() {
  const auto refusal = findRefusal(
      "\x01\x02"
      "21 E*ERROR*O9,2,4*ERROR* EC -3 out of range\r\n");
  QVERIFY(refusal.has_value());
  QCOMPARE(refusal->station, 1);
  QCOMPARE(refusal->command, std::string("O9,2,4"));
  QCOMPARE(refusal->code, -3);
  QVERIFY(!findRefusal("21 E*ERROR*O9,2,4*ERR"));
  std::set<std::string> meanings;
  for (const int code : {-1, -2, -3, -5, -99, -42}) {
    const auto back = findRefusal(encodeRefusal({2, "?", code}));
    QVERIFY(back.has_value());
    QCOMPARE(back->station, 2);
    QCOMPARE(back->code, code);
    meanings.insert(refusalMeaning(code));
  }
  QCOMPARE(meanings.size(), std::size_t{6});
}

void FastrakRecordsTest::meanings() {
  QCOMPARE(errorMeaning(' '), std::string());
  for (const char letter : std::string("abcdefgjklmstuvwxyAZ?")) QVERIFY2(!errorMeaning(letter).empty(), &letter);
  FT_VERIFY_MATCH(holdsAll(errorMeaning('k'), {"too low", "far"}));
  FT_VERIFY_MATCH(holdsAll(errorMeaning('j'), {"saturated", "close"}));
  FT_VERIFY_MATCH(holdsAll(fastrakStatusMeaning("flipped"), {"hemisphere"}));
  QCOMPARE(fastrakStatusMeaning(""), std::string());
}

void FastrakRecordsTest::readsBack() {
  QCOMPARE(findReadBack("\r\n21I   0.50\r\n", 'I', 1), std::optional<std::string>("0.50"));
  QVERIFY(!findReadBack("21I   0.5", 'I', 1));
  QVERIFY(!findReadBack("22I   0.50\r\n", 'I', 1));
}

FIELDTRUE_TEST(FastrakRecordsTest)
#include "fastrak_records_test.moc"
