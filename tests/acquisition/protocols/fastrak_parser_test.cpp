#include <QTest>
#include <random>

#include "acquisition/protocols/fastrak.h"
#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

FastrakStreamSettings settingsOf(FastrakFormat format, const std::vector<int>& items, int stations = 1) {
  FastrakStreamSettings settings;
  settings.format = format;
  for (int i = 0; i < stations; ++i) settings.items[static_cast<std::size_t>(i)] = items;
  return settings;
}

std::vector<FastrakRecord> parse(FastrakParser parser, const std::vector<std::string>& pieces) {
  std::vector<FastrakRecord> records;
  for (const auto& piece : pieces) parser.add(piece, records);
  return records;
}

/// Position x of each record in centimetres, which the test streams count up in.
std::vector<int> counts(const std::vector<FastrakRecord>& records) {
  std::vector<int> result;
  for (const auto& record : records) result.push_back(static_cast<int>(std::lround(record.position_m->x() * 100.0)));
  return result;
}

/// Records numbered first, first + 1, ... in x, in the driver's list.
std::string stream(FastrakFormat format, const std::vector<int>& items, int first, int n, int stations = 1) {
  std::string bytes_out;
  const auto layout = *fastrakLayout(items, format);
  for (int i = first; i < first + n; ++i) {
    const Pose pose{{i * 0.01, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};
    for (int station = 1; station <= stations; ++station) {
      bytes_out += encodeRecord(recordOfPose(station, ' ', pose), layout, FastrakUnit::kCentimetre);
    }
  }
  return bytes_out;
}

const std::vector<int> kDriverItems = {2, 11, 16, 1};
const std::vector<int> kAsciiItems = {2, 4, 1};

}  // namespace

class FastrakParserTest : public QObject {
  Q_OBJECT
 private slots:
  void formats_data();
  void cutAtEveryOffset_data() { formats_data(); }
  void cutAtEveryOffset();
  void byteByByte_data() { formats_data(); }
  void byteByByte();
  void recordedBytes();
  void garbageFirst_data() { formats_data(); }
  void garbageFirst();
  void needsTwoRecordsInARow();
  void oneLostByteCostsOneRecord_data() { formats_data(); }
  void oneLostByteCostsOneRecord();
  void everyLostByteEverywhere();
  void neverBelievesNoise();
  void severalStations();
  void stationsWithTheirOwnLists();
  void refusesNoStation();
};

void FastrakParserTest::formats_data() {
  QTest::addColumn<bool>("binary");
  QTest::newRow("ASCII") << false;
  QTest::newRow("binary") << true;
}

void FastrakParserTest::cutAtEveryOffset() {
  QFETCH(bool, binary);
  const auto format = binary ? FastrakFormat::kBinary : FastrakFormat::kAscii;
  const auto& items = binary ? kDriverItems : kAsciiItems;
  const std::string all = stream(format, items, 1, 4);
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    const auto parser = *FastrakParser::make(settingsOf(format, items));
    const auto records = parse(parser, {all.substr(0, cut), all.substr(cut)});
    QCOMPARE(counts(records), (std::vector{1, 2, 3, 4}));
  }
}

void FastrakParserTest::byteByByte() {
  QFETCH(bool, binary);
  const auto format = binary ? FastrakFormat::kBinary : FastrakFormat::kAscii;
  const auto& items = binary ? kDriverItems : kAsciiItems;
  std::vector<std::string> pieces;
  for (const char c : stream(format, items, 1, 5)) pieces.emplace_back(1, c);
  QCOMPARE(counts(parse(*FastrakParser::make(settingsOf(format, items)), pieces)), (std::vector{1, 2, 3, 4, 5}));
}

void FastrakParserTest::recordedBytes() {
  auto settings = settingsOf(FastrakFormat::kBinary, {2, 11, 0});
  settings.unit = FastrakUnit::kInch;
  const std::string record = bytes(kVrpnBinary);
  QCOMPARE(record.size(), std::size_t{32});
  const auto records = parse(*FastrakParser::make(settings), {record + record});
  QCOMPARE(records.size(), std::size_t{2});
  const Pose expected{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};
  for (const auto& read : records) FT_VERIFY_MATCH(near(toSample(read, 0.0).tracker_from_sensor, expected, 1e-7, 2e-6));
}

void FastrakParserTest::garbageFirst() {
  QFETCH(bool, binary);
  const auto format = binary ? FastrakFormat::kBinary : FastrakFormat::kAscii;
  const auto& items = binary ? kDriverItems : kAsciiItems;
  std::mt19937 random(3);
  for (std::size_t length = 1; length < 120; ++length) {
    std::string garbage(length, '\0');
    for (char& c : garbage) c = "01 k\r\n\xFFS2"[random() % 9];
    const auto records =
        parse(*FastrakParser::make(settingsOf(format, items)), {garbage + stream(format, items, 1, 4)});
    QCOMPARE(counts(records), (std::vector{1, 2, 3, 4}));
  }
}

void FastrakParserTest::needsTwoRecordsInARow() {
  auto parser = *FastrakParser::make(settingsOf(FastrakFormat::kBinary, kDriverItems));
  const std::string one = stream(FastrakFormat::kBinary, kDriverItems, 1, 1);
  std::vector<FastrakRecord> records;
  parser.add(one + "xxx", records);
  QVERIFY(records.empty() && !parser.locked());
  parser.add(stream(FastrakFormat::kBinary, kDriverItems, 7, 2), records);
  QVERIFY(parser.locked());
  QCOMPARE(counts(records), (std::vector{7, 8}));
  QCOMPARE(parser.dropped_bytes(), one.size() + 3);

  auto settings = settingsOf(FastrakFormat::kBinary, kDriverItems);
  settings.records_to_lock = 1;
  QCOMPARE(counts(parse(*FastrakParser::make(settings), {one})), (std::vector{1}));
}

void FastrakParserTest::oneLostByteCostsOneRecord() {
  QFETCH(bool, binary);
  const auto format = binary ? FastrakFormat::kBinary : FastrakFormat::kAscii;
  const auto& items = binary ? kDriverItems : kAsciiItems;
  const std::size_t length = fastrakLayout(items, format)->bytes;
  for (std::size_t lost = 0; lost < length; ++lost) {
    std::string all = stream(format, items, 1, 6);
    all.erase(2 * length + lost, 1);
    auto parser = *FastrakParser::make(settingsOf(format, items));
    std::vector<FastrakRecord> records;
    parser.add(all, records);
    QCOMPARE(counts(records), (std::vector{1, 2, 4, 5, 6}));
    QCOMPARE(parser.losses_of_lock(), std::uint64_t{1});
  }
}

void FastrakParserTest::everyLostByteEverywhere() {
  std::mt19937 random(11);
  std::string all = stream(FastrakFormat::kBinary, kDriverItems, 0, 2000);
  std::string damaged;
  for (const char c : all) {
    if (random() % 400 != 0) damaged += c;
  }
  const auto records = parse(*FastrakParser::make(settingsOf(FastrakFormat::kBinary, kDriverItems)), {damaged});
  QVERIFY(records.size() > 1500);
  for (const auto& record : records) {
    const Sample sample = toSample(record, 0.0);
    QCOMPARE(sample.status, std::string());
    QCOMPARE(sample.tracker_from_sensor.position_m.y(), static_cast<double>(-12.7f) * 0.01);
  }
  const auto numbers = counts(records);
  QVERIFY(std::is_sorted(numbers.begin(), numbers.end()));
}

void FastrakParserTest::neverBelievesNoise() {
  std::mt19937 random(5);
  std::string noise(200000, '\0');
  for (char& c : noise) c = static_cast<char>(random() & 0xFF);
  auto parser = *FastrakParser::make(settingsOf(FastrakFormat::kBinary, kDriverItems));
  std::vector<FastrakRecord> records;
  parser.add(noise, records);
  parser.add(std::string(5000, '\xFF'), records);
  QVERIFY(records.empty());
  QVERIFY(parser.dropped_bytes() > 200000);
}

void FastrakParserTest::severalStations() {
  const auto all = stream(FastrakFormat::kBinary, kDriverItems, 1, 3, 4);
  const auto records = parse(*FastrakParser::make(settingsOf(FastrakFormat::kBinary, kDriverItems, 4)), {all});
  QCOMPARE(records.size(), std::size_t{12});
  for (std::size_t i = 0; i < records.size(); ++i) QCOMPARE(records[i].station, static_cast<int>(i % 4) + 1);
  // A station that is off is noise.
  QVERIFY(parse(*FastrakParser::make(settingsOf(FastrakFormat::kBinary, kDriverItems, 1)), {all}).empty());
}

void FastrakParserTest::stationsWithTheirOwnLists() {
  FastrakStreamSettings settings = settingsOf(FastrakFormat::kAscii, {2, 1});
  settings.items[2] = {2, 16, 1};
  const std::string all = "01    1.00   0.00   0.00\r\n03    2.00   0.00   0.00 1\r\n01    3.00   0.00   0.00\r\n";
  const auto records = parse(*FastrakParser::make(settings), {all});
  QCOMPARE(counts(records), (std::vector{1, 2, 3}));
  QCOMPARE(records[1].stylus_pressed, std::optional(true));
}

void FastrakParserTest::refusesNoStation() {
  FT_VERIFY_MATCH(holdsAll(FastrakParser::make({}).error().message, {"station"}));
}

FIELDTRUE_TEST(FastrakParserTest)
#include "fastrak_parser_test.moc"
