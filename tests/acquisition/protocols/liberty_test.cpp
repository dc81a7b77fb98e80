#include "acquisition/protocols/liberty.h"

#include <QTest>
#include <random>

#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

const std::vector<int> kItems = {8, 2, 7, 1};

/// A frame as noted from a line analyser: station, command C, no error, 34 bytes of payload; 1000 ms, then 10, -5, 2.5
/// and the quaternion of az 30, el 10, roll -20 deg as floats written out by another program, carriage return, line
/// feed.
std::string handMade(int station = 1, char error = ' ', std::string_view tag = "LY", unsigned time_ms = 1000) {
  std::string frame = bytes(
      "<0000 43 20 00 2200 00000000 00002041 0000A0C0 00002040 "
      "3E97713F F5D941BE 72331C3D 8D7D893E 0D0A>");
  frame.replace(0, 1, tag);
  frame[2] = static_cast<char>(station);
  frame[4] = error;
  for (std::size_t i = 0; i < 4; ++i) frame[8 + i] = static_cast<char>(time_ms >> (8 * i) & 0xFFu);
  return frame;
}

/// The pose in it, where the unit is inches.
const Pose kVrpnPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};

LibertyParser parserFor(std::vector<int> stations, std::string tag = "LY", std::vector<int> items = kItems) {
  return *LibertyParser::make({std::move(tag), std::move(stations), std::move(items), 0.0254});
}

std::vector<Reading> parsed(LibertyParser parser, const std::vector<std::string>& pieces) {
  std::vector<Reading> readings;
  for (const auto& piece : pieces) parser.add(piece, readings);
  return readings;
}

/// Frames whose time stamps count up from 1.
std::string numbered(int frames, int stations = 1) {
  std::string all;
  for (int i = 1; i <= frames; ++i) {
    for (int station = 1; station <= stations; ++station) all += handMade(station, ' ', "LY", static_cast<unsigned>(i));
  }
  return all;
}

std::vector<int> numbersOf(const std::vector<Reading>& readings) {
  std::vector<int> numbers;
  for (const Reading& reading : readings) numbers.push_back(static_cast<int>(std::lround(*reading.unit_s * 1000.0)));
  return numbers;
}

}  // namespace

class LibertyTest : public QObject {
  Q_OBJECT
 private slots:
  void handMadeFrame();
  void cutAtEveryOffset();
  void byteByByte();
  void garbageFirst();
  void everyStation();
  void onlyWhatIsSwitchedOn();
  void wrongLengths();
  void wrongEndMark();
  void otherMake();
  void oneLostByteCostsOneRecord();
  void neverBelievesNoise();
  void errorLettersAreKept();
  void damagedNumbersAreMarked();
  void everyItem_data();
  void everyItem();
  void refusesWhatCannotBe();
  void textRecord();
  void whoIsThere();
  void refusals();
  void commands();
  void readsCommands();
};

void LibertyTest::handMadeFrame() {
  QCOMPARE(handMade().size(), std::size_t{42});
  const auto readings = parsed(parserFor({1}), {handMade()});
  QCOMPARE(readings.size(), std::size_t{1});
  QCOMPARE(readings[0].sample.sensor, 0);
  QCOMPARE(readings[0].sample.status, std::string());
  QCOMPARE(*readings[0].unit_s, 1.0);
  FT_VERIFY_MATCH(near(readings[0].sample.tracker_from_sensor, kVrpnPose, 1e-7, 2e-6));
  // And the emulator's side writes these very bytes.
  const auto frame = findLibertyFrame(handMade(), 'C');
  const auto record = decodeLibertyRecord(*frame, kItems, 0.0254);
  QCOMPARE(encode(LibertyFrame{"LY", 1, 'C', ' ', encodeLibertyPayload(*record, kItems, 0.0254)}), handMade());
}

void LibertyTest::cutAtEveryOffset() {
  const std::string all = numbered(4);
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    QCOMPARE(numbersOf(parsed(parserFor({1}), {all.substr(0, cut), all.substr(cut)})), (std::vector{1, 2, 3, 4}));
  }
}

void LibertyTest::byteByByte() {
  std::vector<std::string> pieces;
  for (const char c : numbered(5)) pieces.emplace_back(1, c);
  QCOMPARE(numbersOf(parsed(parserFor({1}), pieces)), (std::vector{1, 2, 3, 4, 5}));
}

void LibertyTest::garbageFirst() {
  std::mt19937 random(3);
  for (std::size_t length = 1; length < 120; ++length) {
    std::string garbage(length, '\0');
    for (char& c : garbage) c = "LYPA\x01\x43 \0\x22\r\n"[random() % 11];
    const auto readings = parsed(parserFor({1}), {garbage + numbered(3)});
    QCOMPARE(numbersOf(readings), (std::vector{1, 2, 3}));
  }
}

void LibertyTest::everyStation() {
  std::vector<int> stations;
  for (int station = 1; station <= 16; ++station) stations.push_back(station);
  const auto readings = parsed(parserFor(stations), {numbered(2, 16)});
  QCOMPARE(readings.size(), std::size_t{32});
  for (std::size_t i = 0; i < readings.size(); ++i) QCOMPARE(readings[i].sample.sensor, static_cast<int>(i % 16));
}

void LibertyTest::onlyWhatIsSwitchedOn() {
  QCOMPARE(parsed(parserFor({2}), {numbered(3, 3)}).size(), std::size_t{3});
  QVERIFY(parsed(parserFor({1}), {handMade(0) + handMade(17) + handMade(255)}).empty());
}

void LibertyTest::wrongLengths() {
  for (const int length : {0, 33, 35, 42, 0xFFFF}) {
    std::string wrong = handMade();
    wrong[6] = static_cast<char>(length & 0xFF);
    wrong[7] = static_cast<char>(length >> 8);
    QCOMPARE(numbersOf(parsed(parserFor({1}), {wrong + numbered(2)})), (std::vector{1, 2}));
  }
}

void LibertyTest::wrongEndMark() {
  std::string wrong = handMade();
  wrong.back() = ' ';
  QCOMPARE(numbersOf(parsed(parserFor({1}), {wrong + numbered(2)})), (std::vector{1, 2}));
}

void LibertyTest::otherMake() {
  const std::string patriot = handMade(1, ' ', "PA");
  QVERIFY(parsed(parserFor({1}), {patriot}).empty());
  QCOMPARE(parsed(parserFor({1}, "PA"), {patriot}).size(), std::size_t{1});
}

void LibertyTest::oneLostByteCostsOneRecord() {
  const std::size_t length = handMade().size();
  for (std::size_t lost = 0; lost < length; ++lost) {
    std::string all = numbered(6);
    all.erase(2 * length + lost, 1);
    QCOMPARE(numbersOf(parsed(parserFor({1}), {all})), (std::vector{1, 2, 4, 5, 6}));
  }
}

void LibertyTest::neverBelievesNoise() {
  std::mt19937 random(5);
  std::string noise(200000, '\0');
  for (char& c : noise) c = static_cast<char>(random() & 0xFF);
  auto parser = parserFor({1, 2, 3, 4});
  std::vector<Reading> readings;
  parser.add(noise, readings);
  parser.add(std::string(5000, '\xFF'), readings);
  QVERIFY(readings.empty());
  QCOMPARE(parser.droppedBytes(), std::uint64_t{205000});
}

void LibertyTest::errorLettersAreKept() {
  QCOMPARE(parsed(parserFor({1}), {handMade(1, 'k')}).at(0).sample.status, std::string("k"));
  // Some firmware writes a zero where nothing is wrong.
  QCOMPARE(parsed(parserFor({1}), {handMade(1, '\0')}).at(0).sample.status, std::string());
  FT_VERIFY_MATCH(holdsAll(libertyStatusMeaning("k"), {"error k", "manual"}));
  FT_VERIFY_MATCH(holdsAll(libertyStatusMeaning("flipped"), {"hemisphere"}));
}

void LibertyTest::damagedNumbersAreMarked() {
  // The quaternion's scalar is 4 instead of 0.94.
  std::string frame = handMade();
  frame.replace(24, 4, bytes("<00008040>"));
  QCOMPARE(parsed(parserFor({1}), {frame}).at(0).sample.status, std::string("damaged"));
  // A marker of a missing reading, and not a number.
  frame.replace(12, 4, bytes("<0000F0F0>"));
  frame.replace(24, 4, handMade().substr(24, 4));
  QCOMPARE(parsed(parserFor({1}), {frame}).at(0).sample.status, std::string("missing"));
  frame.replace(12, 4, bytes("<0000C07F>"));
  QCOMPARE(parsed(parserFor({1}), {frame}).at(0).sample.status, std::string("missing"));
}

void LibertyTest::everyItem_data() {
  QTest::addColumn<int>("item");
  QTest::addColumn<QByteArray>("payload");
  QTest::addColumn<QList<double>>("values");
  const auto row = [](const char* name, int item, const char* hex, const QList<double>& values) {
    QTest::newRow(name) << item << QByteArray::fromStdString(bytes(hex)) << values;
  };
  // 10, -5, 2.5 as float32.
  row("position", 2, "<00002041 0000A0C0 00002040>", {10.0, -5.0, 2.5});
  row("position, more digits", 3, "<00002041 0000A0C0 00002040>", {10.0, -5.0, 2.5});
  row("angles", 4, "<00002041 0000A0C0 00002040>", {10.0, -5.0, 2.5});
  row("angles, more digits", 5, "<00002041 0000A0C0 00002040>", {10.0, -5.0, 2.5});
  row("cosines", 6, "<0000803F 00000000 00000000 00000000 0000803F 00000000 00000000 00000000 000080BF>",
      {1, 0, 0, 0, 1, 0, 0, 0, -1});
  row("quaternion", 7, "<0000803F 00000000 0000003F 000000BF>", {1.0, 0.0, 0.5, -0.5});
  row("time", 8, "<FFFFFFFF>", {4294967295.0});
  row("frame", 9, "<00000001>", {16777216.0});
  row("stylus", 10, "<01000000>", {1.0});
  row("distortion", 11, "<FEFFFFFF>", {-2.0});
}

void LibertyTest::everyItem() {
  QFETCH(int, item);
  QFETCH(QByteArray, payload);
  QFETCH(QList<double>, values);
  const std::vector list = {item};
  const LibertyFrame frame{"LY", 1, 'P', ' ', payload.toStdString()};
  const auto record = decodeLibertyRecord(frame, list, 1.0);
  QVERIFY(record.has_value());
  QList<double> read;
  const auto take = [&read](const auto& vector) {
    for (const double x : vector) read << x;
  };
  if (item == 2 || item == 3) take(*record->position_m);
  if (item == 4 || item == 5) take(*record->euler_deg);
  if (item == 6) {
    for (const auto& line : record->direction_cosines) take(*line);
  }
  if (item == 7) take(*record->quaternion_wxyz);
  if (item == 8) read << record->time_ms;
  if (item == 9) read << record->frame;
  if (item == 10) read << record->stylus;
  if (item == 11) read << record->distortion;
  QCOMPARE(read, values);
  QCOMPARE(encodeLibertyPayload(*record, list, 1.0), frame.payload);
  QVERIFY(!decodeLibertyRecord({"LY", 1, 'P', ' ', frame.payload + " "}, list, 1.0));
}

void LibertyTest::refusesWhatCannotBe() {
  FT_VERIFY_MATCH(holdsAll(LibertyParser::make({"LY", {}, kItems, 0.01}).error().message, {"station"}));
  FT_VERIFY_MATCH(holdsAll(LibertyParser::make({"LY", {1}, {2, 40}, 0.01}).error().message, {"item 40"}));
}

void LibertyTest::textRecord() {
  LibertyRecord record;
  static_cast<PoseNumbers&>(record) =
      numbersOfPose({{0.1, -0.25, 1.5}, rotationFromEuler(Eigen::Vector3d(0.5, 0.25, -0.125))});
  record.station = 12;
  QCOMPARE(encodeLibertyText(record, std::vector{2, 4, 1}, 0.01),
           std::string("12     10.000  -25.000  150.000   28.648   14.324   -7.162\r\n"));
}

void LibertyTest::whoIsThere() {
  const std::string frame = bytes("LY<00 16 20 00 1E00 10 00 000000000000>Liberty 2.01<0D0A>S/N 12345");
  const auto who = findLibertyFrame("noise" + frame, kLibertyWho);
  QVERIFY(who.has_value());
  QCOMPARE(libertyIdentity(*who), std::string("Liberty 2.01, S/N 1234"));
  for (std::size_t n = 0; n < frame.size() - 1; ++n) QVERIFY(!findLibertyFrame(frame.substr(0, n), kLibertyWho));
  const auto stations = findLibertyFrame(bytes("LY<00 15 20 00 0400 0580 0100>"), kLibertyStations);
  QCOMPARE(libertyPlugged(*stations), std::optional(0x8005u));
  QVERIFY(!libertyPlugged(*findLibertyFrame(bytes("LY<00 15 20 00 0100 05>"), kLibertyStations)));
}

void LibertyTest::refusals() {
  const auto refusal = findLibertyRefusal(bytes("LY<00>Za<00 0D00>*ERROR* no<0D0A>?"));
  QVERIFY(refusal.has_value());
  QCOMPARE(refusal->command, 'Z');
  // A record with an error letter is none.
  QVERIFY(!findLibertyRefusal(handMade(1, 'k')));
}

void LibertyTest::commands() {
  QCOMPARE(liberty::point(), std::string("P"));
  QCOMPARE(liberty::continuous(), std::string("C\r"));
  QCOMPARE(liberty::binary(true) + liberty::binary(false), std::string("F1\rF0\r"));
  QCOMPARE(liberty::centimetres(true), std::string("U1\r"));
  QCOMPARE(liberty::who(), std::string("\x16\r"));
  QCOMPARE(liberty::stations(), std::string("\x15") + "0\r");
  QCOMPARE(liberty::stationActive(12, false), std::string("\x15") + "12,0\r");
  QCOMPARE(liberty::reinitialise(), std::string("\x19\r"));
  QCOMPARE(liberty::outputList(kItems), std::string("O*,8,2,7,1\r"));
  QCOMPARE(liberty::hemisphere(3, {0.0, -1.0, 0.0}), std::string("H3,0,-1,0\r"));
  QCOMPARE(liberty::resetAlignment(), std::string("R*\r"));
  QCOMPARE(liberty::unBoresight(), std::string("\x02*\r"));
  QCOMPARE(liberty::resetTime(), std::string("Q0\r"));
  QCOMPARE(liberty::filter('X', {0.0, 1.0, 0.0, 0.0}), std::string("X0,1,0,0\r"));
}

void LibertyTest::readsCommands() {
  const std::string all = "\rPp f1\rO*,8, 2\r\x16\r\nH3,0,-1,0\r";
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    LibertyCommandReader reader;
    std::vector<LibertyCommand> commands;
    reader.add(all.substr(0, cut), commands);
    reader.add(all.substr(cut), commands);
    QCOMPARE(commands.size(), std::size_t{6});
    std::string letters;
    for (const auto& command : commands) letters += command.letter;
    QCOMPARE(letters, std::string("PPFO\x16H"));
    QCOMPARE(commands[2].fields, std::vector<std::string>{"1"});
    QCOMPARE(commands[3].fields, (std::vector<std::string>{"*", "8", "2"}));
  }
}

FIELDTRUE_TEST(LibertyTest)
#include "liberty_test.moc"
