#include "acquisition/protocols/isotrak.h"

#include <QTest>
#include <random>

#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const std::vector<int> kIsotrakPose = {2, 11};

/// Station 1 at (0.254, -0.127, 0.0635) m, az 30, el 10, roll -20 deg in the list 2,11: words 5004, -2502, 1251 and
/// 30923, -6203, 1250, 8799, packed by another program.
const std::string kIsotrakBytes = bytes("<B0 31 20 0C 13 3A 76 48  63 04 4B 78 45 67 62 75  04 5F 22 00>");
const Pose kIsotrakHeld{{0.254, -0.127, 0.0635},
                        Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};
constexpr double kHalfStep_m = 0.5 * 1.6632 / 32767.0;

std::string isotrakRecord(int number, int station = 1, char mark = ' ') {
  FastrakRecord sent = recordOfPose(station, mark, {{0.3, 0.01 * number, -0.2}, Eigen::Quaterniond::Identity()});
  return encodeIsotrakRecord(sent, kIsotrakPose);
}

std::string isotrakRow(int records, int stations = 1) {
  std::string all;
  for (int i = 1; i <= records; ++i) {
    for (int station = 1; station <= stations; ++station) all += isotrakRecord(i, station);
  }
  return all;
}

IsotrakParser isotrakParser(std::vector<int> stations, bool single = false, std::vector<int> items = kIsotrakPose) {
  IsotrakParser::Settings settings;
  settings.stations = std::move(stations);
  settings.items = std::move(items);
  settings.single = single;
  return *IsotrakParser::make(settings);
}

std::vector<Reading> isotrakParsed(IsotrakParser parser, const std::vector<std::string>& pieces) {
  std::vector<Reading> readings;
  for (const auto& piece : pieces) parser.add(piece, readings);
  return readings;
}

std::vector<int> isotrakNumbers(const std::vector<Reading>& readings) {
  std::vector<int> numbers;
  for (const Reading& reading : readings) {
    numbers.push_back(static_cast<int>(std::lround(100.0 * reading.sample.tracker_from_sensor.position_m.y())));
  }
  return numbers;
}

}  // namespace

class IsotrakTest : public QObject {
  Q_OBJECT
 private slots:
  void packs_data();
  void packs();
  void unpacksNothingElse();
  void handMadeRecord();
  void handMadeAngles();
  void fullScale();
  void cutAtEveryOffset();
  void byteByByte();
  void garbageFirst();
  void beginsInTheMiddle();
  void onlyWhatIsSwitchedOn();
  void oneLostByteCostsOneRecord();
  void oneChangedSyncBitCostsOneRecord();
  void neverBelievesNoise();
  void errorLettersAreKept();
  void stylusIsNoError();
  void damagedNumbersAreMarked();
  void quaternionsAreNormalised();
  void asciiRecords();
  void refusesWhatCannotBe();
  void status();
  void stations();
  void recognisesAStream();
  void outputList();
};

void IsotrakTest::packs_data() {
  QTest::addColumn<QByteArray>("logical");
  QTest::addColumn<QByteArray>("wire");
  const auto row = [](const char* name, const char* logical, const char* wire) {
    QTest::newRow(name) << QByteArray::fromHex(logical) << QByteArray::fromHex(wire);
  };
  row("one byte", "30", "B0 00");
  row("highest bit of the first byte", "B0", "B0 01");
  row("two bytes", "01FF", "81 7F 02");
  row("seven zeros", "00000000000000", "80 00 00 00 00 00 00 00");
  row("seven of all bits", "FFFFFFFFFFFFFF", "FF 7F 7F 7F 7F 7F 7F 7F");
  row("eight", "0102030405068708", "81 02 03 04 05 06 07 40 08 00");
}

void IsotrakTest::packs() {
  QFETCH(QByteArray, logical);
  QFETCH(QByteArray, wire);
  QCOMPARE(QByteArray::fromStdString(isotrakPacked(logical.toStdString())), wire);
  const auto back = isotrakUnpacked(wire.toStdString());
  QVERIFY(back.has_value());
  QCOMPARE(QByteArray::fromStdString(*back), logical);
}

void IsotrakTest::unpacksNothingElse() {
  // No byte, no bit 7, bit 7 elsewhere too, a group without bytes, a highest bit of a byte that is not there.
  for (const char* wire : {"", "30 00", "B0 80", "B0 31 20 0C 13 3A 76 48 00", "B0 02", "B0 31 04"}) {
    QVERIFY2(!isotrakUnpacked(QByteArray::fromHex(wire).toStdString()), wire);
  }
}

void IsotrakTest::handMadeRecord() {
  QCOMPARE(*isotrakRecordBytes(kIsotrakPose), kIsotrakBytes.size());
  const auto read = decodeIsotrakRecord(kIsotrakBytes, kIsotrakPose);
  QVERIFY(read.has_value());
  QCOMPARE(read->station, 1);
  FT_VERIFY_MATCH(sameBits(read->position_m->x(), 5004.0 * (1.6632 / 32767.0)));
  const auto readings = isotrakParsed(isotrakParser({1}, true), {kIsotrakBytes});
  QCOMPARE(readings.size(), std::size_t{1});
  QCOMPARE(readings[0].sample.sensor, 0);
  QCOMPARE(readings[0].sample.status, std::string());
  FT_VERIFY_MATCH(near(readings[0].sample.tracker_from_sensor, kIsotrakHeld, 2.0 * kHalfStep_m, 1e-4));
  // And the emulator's side writes these very bytes.
  QCOMPARE(encodeIsotrakRecord(recordOfPose(1, ' ', kIsotrakHeld), kIsotrakPose), kIsotrakBytes);
}

void IsotrakTest::handMadeAngles() {
  // The same pose in the list 2,4: 30, 10 and -20 deg are 5461, 1820 and -3641 of 32768 to 180.
  const std::string wire = bytes("<B0 31 20 0C 13 3A 76 48  63 04 55 15 1C 07 47 41  71 01>");
  const std::vector items = {2, 4};
  QCOMPARE(*isotrakRecordBytes(items), wire.size());
  const auto readings = isotrakParsed(isotrakParser({1}, true, items), {wire});
  QCOMPARE(readings.size(), std::size_t{1});
  FT_VERIFY_MATCH(near(readings[0].sample.tracker_from_sensor, kIsotrakHeld, 2.0 * kHalfStep_m, 1e-4));
  QCOMPARE(encodeIsotrakRecord(recordOfPose(1, ' ', kIsotrakHeld), items), wire);
}

void IsotrakTest::fullScale() {
  for (const double reach_m : {1.6632, -1.6632}) {
    const Pose pose{{reach_m, 2.0 * reach_m, 0.0}, Eigen::Quaterniond::Identity()};
    const auto read = decodeIsotrakRecord(encodeIsotrakRecord(recordOfPose(2, ' ', pose), kIsotrakPose), kIsotrakPose);
    FT_VERIFY_MATCH(near(*read->position_m, Eigen::Vector3d(reach_m, reach_m, 0.0), 1e-12));
    FT_VERIFY_MATCH(near(*read->quaternion_wxyz, Eigen::Vector4d(1.0, 0.0, 0.0, 0.0), 1e-12));
  }
}

void IsotrakTest::cutAtEveryOffset() {
  const std::string all = isotrakRow(4);
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    QCOMPARE(isotrakNumbers(isotrakParsed(isotrakParser({1}), {all.substr(0, cut), all.substr(cut)})),
             (std::vector{1, 2, 3, 4}));
  }
}

void IsotrakTest::byteByByte() {
  std::vector<std::string> pieces;
  for (const char c : isotrakRow(5, 2)) pieces.emplace_back(1, c);
  const auto readings = isotrakParsed(isotrakParser({1, 2}), pieces);
  QCOMPARE(isotrakNumbers(readings), (std::vector{1, 1, 2, 2, 3, 3, 4, 4, 5, 5}));
  for (std::size_t i = 0; i < readings.size(); ++i) QCOMPARE(readings[i].sample.sensor, static_cast<int>(i % 2));
}

void IsotrakTest::garbageFirst() {
  std::mt19937 random(3);
  for (std::size_t length = 1; length < 120; ++length) {
    std::string garbage(length, '\0');
    for (char& c : garbage) c = "\xB0\x31\x32\x20 01@*\r\n\x7F"[random() % 12];
    QCOMPARE(isotrakNumbers(isotrakParsed(isotrakParser({1, 2}), {garbage + isotrakRow(3)})), (std::vector{1, 2, 3}));
  }
}

void IsotrakTest::beginsInTheMiddle() {
  const std::string all = isotrakRow(4);
  for (std::size_t from = 1; from < 20; ++from) {
    QCOMPARE(isotrakNumbers(isotrakParsed(isotrakParser({1}), {all.substr(from)})), (std::vector{2, 3, 4}));
  }
}

void IsotrakTest::onlyWhatIsSwitchedOn() {
  const auto readings = isotrakParsed(isotrakParser({2}), {isotrakRow(3, 2)});
  QCOMPARE(readings.size(), std::size_t{2});
  for (const Reading& reading : readings) QCOMPARE(reading.sample.sensor, 1);
  for (const int station : {0, 3, 9})
    QVERIFY(isotrakParsed(isotrakParser({1, 2}, true), {isotrakRecord(1, station)}).empty());
}

void IsotrakTest::oneLostByteCostsOneRecord() {
  for (std::size_t lost = 0; lost < 20; ++lost) {
    std::string all = isotrakRow(6);
    all.erase(2 * 20 + lost, 1);
    QCOMPARE(isotrakNumbers(isotrakParsed(isotrakParser({1}), {all})), (std::vector{1, 2, 4, 5, 6}));
  }
}

void IsotrakTest::oneChangedSyncBitCostsOneRecord() {
  for (std::size_t changed = 0; changed < 20; ++changed) {
    std::string all = isotrakRow(6);
    all[2 * 20 + changed] = static_cast<char>(all[2 * 20 + changed] ^ 0x80);
    QCOMPARE(isotrakNumbers(isotrakParsed(isotrakParser({1}), {all})), (std::vector{1, 2, 4, 5, 6}));
  }
}

void IsotrakTest::neverBelievesNoise() {
  std::mt19937 random(5);
  std::string noise(400000, '\0');
  for (char& c : noise) c = static_cast<char>(random() & 0xFF);
  QVERIFY(isotrakParsed(isotrakParser({1, 2}), {noise, std::string(5000, '\xFF'), std::string(5000, '\xB0')}).empty());
  // Where only bit 7 of the right byte is right too.
  for (std::size_t i = 0; i < noise.size(); ++i) {
    noise[i] = static_cast<char>(i % 20 == 0 ? noise[i] | 0x80 : noise[i] & 0x7F);
  }
  QVERIFY(isotrakParsed(isotrakParser({1, 2}), {noise}).empty());
}

void IsotrakTest::errorLettersAreKept() {
  const auto readings =
      isotrakParsed(isotrakParser({1}), {isotrakRecord(1, 1, 'A') + isotrakRecord(2, 1, 'k') + isotrakRecord(3)});
  QCOMPARE(readings.size(), std::size_t{3});
  QCOMPARE(readings[0].sample.status, std::string("A"));
  QCOMPARE(readings[1].sample.status, std::string("k"));
  FT_VERIFY_MATCH(holdsAll(isotrakStatusMeaning("A"), {"error A", "manual"}));
  FT_VERIFY_MATCH(holdsAll(isotrakStatusMeaning("flipped"), {"hemisphere"}));
  QVERIFY(isotrakParsed(isotrakParser({1}, true), {isotrakRecord(1, 1, '\x05')}).empty());
}

void IsotrakTest::stylusIsNoError() {
  QCOMPARE(decodeIsotrakRecord(isotrakRecord(1, 1, '@'), kIsotrakPose)->stylus_pressed, std::optional(true));
  QCOMPARE(decodeIsotrakRecord(isotrakRecord(1, 1, '*'), kIsotrakPose)->stylus_pressed, std::optional(false));
  QVERIFY(!decodeIsotrakRecord(isotrakRecord(1), kIsotrakPose)->stylus_pressed);
  for (const char mark : {'@', '*'}) {
    QCOMPARE(isotrakParsed(isotrakParser({1}, true), {isotrakRecord(1, 1, mark)}).at(0).sample.status, std::string());
  }
}

void IsotrakTest::damagedNumbersAreMarked() {
  FastrakRecord sent = recordOfPose(1, ' ', kIsotrakHeld);
  (*sent.quaternion_wxyz)[0] = 0.1;
  const auto readings = isotrakParsed(isotrakParser({1}, true), {encodeIsotrakRecord(sent, kIsotrakPose)});
  QCOMPARE(readings.at(0).sample.status, std::string("damaged"));
}

void IsotrakTest::quaternionsAreNormalised() {
  FastrakRecord sent = recordOfPose(1, ' ', kIsotrakHeld);
  *sent.quaternion_wxyz *= 0.95;
  const auto readings = isotrakParsed(isotrakParser({1}, true), {encodeIsotrakRecord(sent, kIsotrakPose)});
  QCOMPARE(readings.at(0).sample.status, std::string());
  FT_VERIFY_MATCH(near(readings[0].sample.tracker_from_sensor, kIsotrakHeld, 2.0 * kHalfStep_m, 1e-4));
}

void IsotrakTest::asciiRecords() {
  IsotrakParser::Settings settings;
  settings.format = FastrakFormat::kAscii;
  settings.unit = FastrakUnit::kInch;
  settings.stations = {1, 2};
  settings.items = {2, 11, 1};
  const std::string first = "01   10.00  -5.00   2.50 0.9437-0.1893 0.0381 0.2685\r\n";
  const std::string second = "02@  10.00  -5.00   2.50 0.9437-0.1893 0.0381 0.2685\r\n";
  const std::string all = "rest of a line\r\n" + first + second + first;
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    const auto readings = isotrakParsed(*IsotrakParser::make(settings), {all.substr(0, cut), all.substr(cut)});
    QCOMPARE(readings.size(), std::size_t{3});
    for (std::size_t i = 0; i < readings.size(); ++i) {
      QCOMPARE(readings[i].sample.sensor, static_cast<int>(i % 2));
      QCOMPARE(readings[i].sample.status, std::string());
      FT_VERIFY_MATCH(near(readings[i].sample.tracker_from_sensor, kIsotrakHeld, 1e-9, 2e-4));
    }
  }
}

void IsotrakTest::refusesWhatCannotBe() {
  IsotrakParser::Settings settings;
  settings.items = kIsotrakPose;
  FT_VERIFY_MATCH(holdsAll(IsotrakParser::make(settings).error().message, {"station"}));
  settings.stations = {1};
  settings.items = {2, 5};
  FT_VERIFY_MATCH(holdsAll(IsotrakParser::make(settings).error().message, {"item 5", "0, 1, 2, 4 and 11"}));
  settings.items = {2, 40};
  FT_VERIFY_MATCH(holdsAll(IsotrakParser::make(settings).error().message, {"item 40"}));
}

void IsotrakTest::status() {
  const std::string record = "21S3F1         1.10\r\n";
  QCOMPARE(record.size(), std::size_t{21});
  const auto status = findIsotrakStatus("noise\r\n" + record);
  QVERIFY(status.has_value());
  QCOMPARE(status->version, std::string("1.10"));
  QCOMPARE(status->text, std::string("3F1         1.10"));
  QCOMPARE(encodeIsotrakStatus(1, 0x3F1, "1.10"), record);
  for (std::size_t n = 0; n < record.size(); ++n) QVERIFY(!findIsotrakStatus(record.substr(0, n)));
  // A Fastrak's is longer, whatever identification a person gave it.
  FastrakStatus fastrak;
  fastrak.version = "G1.02";
  for (const char* identity : {"", "21S3F1         1.10", "21S"}) {
    fastrak.identity = identity;
    QVERIFY(!findIsotrakStatus(encodeStatus(fastrak)));
  }
  QVERIFY(!findStatus(record));
}

void IsotrakTest::stations() {
  QCOMPARE(findIsotrakStations("21l10\r\n"), std::optional(1u));
  QCOMPARE(findIsotrakStations("21l01\r\n"), std::optional(2u));
  QCOMPARE(findIsotrakStations("noise 21l11\r\n"), std::optional(3u));
  for (const char* text : {"", "21l11", "21l1\r\n", "21l1x\r\n", "21H11\r\n"}) QVERIFY(!findIsotrakStations(text));
}

void IsotrakTest::recognisesAStream() {
  QVERIFY(looksLikeIsotrakStream("rest" + isotrakRow(8)));
  QVERIFY(looksLikeIsotrakStream(isotrakRow(4, 2)));
  QVERIFY(!looksLikeIsotrakStream(isotrakRow(6)));  // The last one's end is not known.
  QVERIFY(!looksLikeIsotrakStream(""));
  QVERIFY(!looksLikeIsotrakStream(std::string(500, '\xB0')));
  std::string without_head;
  for (int i = 0; i < 8; ++i)
    without_head += isotrakPacked("0" + std::string(1, static_cast<char>('3' + i)) + " record");
  QVERIFY(!looksLikeIsotrakStream(without_head));
}

void IsotrakTest::outputList() { QCOMPARE(encode(isotrak::outputList(kIsotrakPose)), std::string("O2,11\r")); }

FIELDTRUE_TEST(IsotrakTest)
#include "isotrak_test.moc"
