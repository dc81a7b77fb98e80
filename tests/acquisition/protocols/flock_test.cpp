#include "acquisition/protocols/flock.h"

#include <QTest>
#include <random>

#include "acquisition/protocols/flock_commands.h"
#include "calib/core/units.h"
#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

FlockLayout layoutOf(const char* mode, bool group = false, double range_m = kFlockRange36_m) {
  FlockLayout layout;
  layout.mode = findFlockMode(mode);
  layout.group = group;
  layout.range_m = range_m;
  return layout;
}

FlockStreamSettings settingsOf(const FlockLayout& layout, const std::vector<int>& addresses = {1}) {
  FlockStreamSettings settings;
  settings.layout = layout;
  settings.sensors.clear();
  for (const int address : addresses) settings.sensors[address] = address - 1;
  return settings;
}

/// 18 in, -9 in and one step; a third of a turn about (1, 1, 1). Of bird 2.
constexpr std::string_view kGroupRecord = "<80 20 00 70 01 00  00 20 00 20 00 20 00 20  02>";

/// Position records of bird 2 in group mode: x counts up in steps of 100, so that no two are the same.
std::string countingStream(int first, int n) {
  std::string all;
  for (int i = first; i < first + n; ++i) {
    const unsigned word = static_cast<unsigned>(100 * i);
    all += static_cast<char>(0x80u | (word & 0x7Fu));
    all += static_cast<char>(word >> 7);
    all += bytes("<00 70 01 00 02>");
  }
  return all;
}

std::vector<int> counted(const std::vector<Reading>& readings) {
  std::vector<int> counts;
  for (const Reading& reading : readings) {
    const double steps = reading.sample.tracker_from_sensor.position_m.x() / kFlockRange36_m * 8192.0;
    counts.push_back(static_cast<int>(std::lround(steps / 100.0)));
  }
  return counts;
}

std::vector<Reading> parse(FlockParser& parser, const std::vector<std::string>& pieces) {
  std::vector<Reading> readings;
  for (const std::string& piece : pieces) parser.add(piece, readings);
  return readings;
}

FlockParser countingParser() { return FlockParser(settingsOf(layoutOf("position", true), {2})); }

}  // namespace

class FlockTest : public QObject {
  Q_OBJECT
 private slots:
  void words_data();
  void words();
  void recordsByHand_data();
  void recordsByHand();
  void stepsOfTheRanges();
  void everyModeComesBack_data();
  void everyModeComesBack();
  void conventionsByHand();
  void badRecords();
  void cutAtEveryOffset();
  void byteByByte();
  void garbageFirst();
  void everyLostByteCostsOneRecord();
  void everyChangedPhasingBit();
  void neverBelievesNoise();
  void strangersAreNoise();
  void repeatsAreDropped();
  void repeatsCanBeKept();
  void saysWhenStuck();
  void commandsByHand_data();
  void commandsByHand();
  void readsGluedCommands();
  void addressingModes();
  void hemispheres();
  void statusWordByHand();
  void unitsByHand();
  void rateFormula();
  void meanings();
};

void FlockTest::words_data() {
  QTest::addColumn<double>("part");
  QTest::addColumn<QByteArray>("word");
  const auto row = [](const char* name, double part, std::string_view word) {
    QTest::newRow(name) << part << QByteArray::fromStdString(bytes(word));
  };
  // 16-bit words 0, 4, -4, 0x4000, 0xE000, 0x7FFC, 0x8000: bits 8 to 2, then 15 to 9.
  row("zero", 0.0, "<00 00>");
  row("a step", 1.0 / 8192.0, "<01 00>");
  row("a step down", -1.0 / 8192.0, "<7F 7F>");
  row("half", 0.5, "<00 20>");
  row("minus a quarter", -0.25, "<00 70>");
  row("most", 8191.0 / 8192.0, "<7F 3F>");
  row("least", -1.0, "<00 40>");
}

void FlockTest::words() {
  QFETCH(double, part);
  QFETCH(QByteArray, word);
  QCOMPARE(QByteArray::fromStdString(encodeFlockWord(part)), word);
  QCOMPARE(decodeFlockWord(static_cast<unsigned char>(word[0]), static_cast<unsigned char>(word[1])), part);
  // With the phasing bit it says the same.
  QCOMPARE(decodeFlockWord(static_cast<unsigned char>(word[0] | 0x80), static_cast<unsigned char>(word[1])), part);
  QCOMPARE(encodeFlockWord(1.0), bytes("<7F 3F>"));
  QCOMPARE(encodeFlockWord(-3.0), bytes("<00 40>"));
}

void FlockTest::recordsByHand_data() {
  QTest::addColumn<QByteArray>("mode");
  QTest::addColumn<QByteArray>("record");
  const auto row = [](const char* mode, std::string_view record) {
    QTest::newRow(mode) << QByteArray(mode) << QByteArray::fromStdString(bytes(record));
  };
  // 18 in, -9 in, one step; azimuth 90, elevation 0, roll 45 deg: rows (0 -r r), (1 0 0), (0 r r), r = 0.7071.
  row("position", "<80 20 00 70 01 00>");
  row("angles", "<80 20 00 00 00 10>");
  row("position_angles", "<80 20 00 70 01 00 00 20 00 00 00 10>");
  // 0.7071 * 8192 = 5792.6: 5793 = 45 * 128 + 33; -5793 = 16384 - 10591 = 82 * 128 + 95.
  row("matrix", "<80 00 5F 52 21 2D  7F 3F 00 00 00 00  00 00 21 2D 21 2D>");
  row("position_matrix", "<80 20 00 70 01 00  00 00 5F 52 21 2D  7F 3F 00 00 00 00  00 00 21 2D 21 2D>");
  // cos 45 cos 22.5 = 0.65328, sin 22.5 cos 45 = 0.27060, the same, sin 45 cos 22.5: 5352, 2217, 2217, 5352.
  row("quaternion", "<E8 29 29 11 29 11 68 29>");
  row("position_quaternion", "<80 20 00 70 01 00 68 29 29 11 29 11 68 29>");
}

void FlockTest::recordsByHand() {
  QFETCH(QByteArray, mode);
  QFETCH(QByteArray, record);
  const FlockLayout layout = layoutOf(mode.constData());
  const Pose pose{{18.0 * 0.0254, -9.0 * 0.0254, kFlockRange36_m / 8192.0},
                  rotationFromEuler(Eigen::Vector3d(90.0, 0.0, 45.0) * kRadPerDeg)};
  QCOMPARE(QByteArray::fromStdString(encodeFlockRecord(1, pose, layout)), record);
  const auto decoded = decodeFlockRecord({record.constData(), static_cast<std::size_t>(record.size())}, layout);
  QVERIFY(decoded.has_value());
  const Sample sample = toSample(*decoded, 2);
  QCOMPARE(sample.status, std::string());
  QCOMPARE(sample.sensor, 2);
  const Pose& read = sample.tracker_from_sensor;
  if (layout.mode->position) FT_VERIFY_MATCH(near(read.position_m, pose.position_m, 1e-12));
  if (layout.mode->orientation != FlockOrientation::kNone)
    FT_VERIFY_MATCH(near(read.orientation, pose.orientation, 3e-4));
}

void FlockTest::stepsOfTheRanges() {
  const std::string record = bytes("<81 00 00 00 00 00>");
  const auto x_mm = [&record](double range_m) {
    return decodeFlockRecord(record, layoutOf("position", false, range_m))->pose.position_m->x() * 1e3;
  };
  FT_VERIFY_MATCH(near(x_mm(kFlockRange36_m), 914.4 / 8192.0, 1e-12));
  FT_VERIFY_MATCH(near(x_mm(kFlockRange36_m), 0.1116, 5e-5));
  FT_VERIFY_MATCH(near(x_mm(kFlockRange72_m), 0.2232, 5e-5));
  FT_VERIFY_MATCH(near(x_mm(kFlockRange144_m), 0.4465, 5e-5));
}

void FlockTest::everyModeComesBack_data() {
  QTest::addColumn<QByteArray>("mode");
  QTest::addColumn<bool>("columns");
  QTest::addColumn<bool>("inverted");
  QTest::addColumn<char>("mirrored");
  for (const FlockMode& mode : flockModes()) {
    for (const char mirrored : {'\0', 'x', 'y', 'z'}) {
      QTest::addRow("%s %c", mode.id, mirrored ? mirrored : '-') << QByteArray(mode.id) << false << false << mirrored;
      QTest::addRow("%s %c other", mode.id, mirrored ? mirrored : '-')
          << QByteArray(mode.id) << true << true << mirrored;
    }
  }
}

void FlockTest::everyModeComesBack() {
  QFETCH(QByteArray, mode);
  QFETCH(bool, columns);
  QFETCH(bool, inverted);
  QFETCH(char, mirrored);
  FlockLayout layout = layoutOf(mode.constData(), true);
  layout.conventions = {columns, inverted, mirrored};
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const Pose pose{{0.9 * unit(random), 0.9 * unit(random), 0.9 * unit(random)},
                    rotationFromVector(3.0 * Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized())};
    const std::string record = encodeFlockRecord(3, pose, layout);
    QCOMPARE(record.size(), layout.bytes());
    QCOMPARE(record.size(), 2 * layout.mode->words + 1);
    const auto decoded = decodeFlockRecord(record, layout);
    QVERIFY(decoded.has_value());
    QCOMPARE(decoded->address, 3);
    const Sample sample = toSample(*decoded, 2);
    QCOMPARE(sample.status, std::string());
    QCOMPARE(sample.sensor, 2);
    const double half_step_m = 0.5 * kFlockRange36_m / 8192.0;
    if (layout.mode->position) {
      for (int axis = 0; axis < 3; ++axis) {
        FT_VERIFY_MATCH(near(sample.tracker_from_sensor.position_m[axis], pose.position_m[axis], half_step_m + 1e-12));
      }
    }
    if (layout.mode->orientation != FlockOrientation::kNone)
      FT_VERIFY_MATCH(near(sample.tracker_from_sensor.orientation, pose.orientation, 1e-3));
  }
}

void FlockTest::conventionsByHand() {
  const auto orientationOf = [](const FlockLayout& layout, std::string_view record) {
    return toSample(*decodeFlockRecord(bytes(record), layout), 0).tracker_from_sensor;
  };
  // Rows (0 -1 0), (1 0 0), (0 0 1) are a quarter turn to the left about z; read by columns to the right.
  FlockLayout matrix = layoutOf("matrix");
  constexpr std::string_view kQuarter = "<80 00 00 40 00 00  7F 3F 00 00 00 00  00 00 00 00 7F 3F>";
  const Eigen::Quaterniond left = rotationFromEuler(Eigen::Vector3d(kPi / 2, 0, 0));
  FT_VERIFY_MATCH(near(orientationOf(matrix, kQuarter).orientation, left, 3e-4));
  matrix.conventions.matrix_by_columns = true;
  FT_VERIFY_MATCH(near(orientationOf(matrix, kQuarter).orientation, left.conjugate(), 3e-4));
  FlockLayout quaternion = layoutOf("quaternion");
  quaternion.conventions.inverted_quaternion = true;
  FT_VERIFY_MATCH(near(orientationOf(quaternion, "<A1 2D 00 00 00 00 21 2D>").orientation, left.conjugate(), 3e-4));
  // Mirrored in x: x, azimuth and elevation turn over, roll stays.
  FlockLayout mirrored = layoutOf("position_angles");
  mirrored.conventions.mirrored = 'x';
  const Pose pose = orientationOf(mirrored, "<80 20 00 20 00 20  00 10 00 08 00 04>");
  FT_VERIFY_MATCH(near(pose.position_m, Eigen::Vector3d(-0.4572, 0.4572, 0.4572), 1e-9));
  const Eigen::Vector3d angles_deg = eulerFromRotation_rad(pose.orientation) * kDegPerRad;
  FT_VERIFY_MATCH(near(angles_deg, Eigen::Vector3d(-45.0, -22.5, 11.25), 1e-9));
}

void FlockTest::badRecords() {
  const FlockLayout layout = layoutOf("position_quaternion", true);
  const std::string good = bytes(kGroupRecord);
  QCOMPARE(good.size(), std::size_t{15});
  QVERIFY(decodeFlockRecord(good, layout).has_value());
  QVERIFY(!decodeFlockRecord(good.substr(1), layout));
  QVERIFY(!decodeFlockRecord(good + "x", layout));
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string wrong = good;
    wrong[i] = static_cast<char>(wrong[i] ^ 0x80);
    QVERIFY2(!decodeFlockRecord(wrong, layout), qPrintable(QString::number(i)));
  }
  std::string nobody = good;
  nobody.back() = '\0';
  QVERIFY(!decodeFlockRecord(nobody, layout));
  // A quaternion of length 0.87 is none: bytes were changed.
  std::string short_quaternion = good;
  short_quaternion[7] = 0x00;
  QCOMPARE(toSample(*decodeFlockRecord(short_quaternion, layout), 0).status, std::string(kStatusDamaged));
}

void FlockTest::cutAtEveryOffset() {
  const std::string all = countingStream(1, 5);
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    FlockParser parser = countingParser();
    QCOMPARE(counted(parse(parser, {all.substr(0, cut), all.substr(cut)})), (std::vector{1, 2, 3, 4, 5}));
    QCOMPARE(parser.answers(), std::uint64_t{5});
  }
}

void FlockTest::byteByByte() {
  std::vector<std::string> pieces;
  for (const char c : countingStream(1, 6)) pieces.emplace_back(1, c);
  FlockParser parser = countingParser();
  QCOMPARE(counted(parse(parser, pieces)), (std::vector{1, 2, 3, 4, 5, 6}));
}

void FlockTest::garbageFirst() {
  std::mt19937 random(3);
  for (std::size_t length = 1; length < 120; ++length) {
    std::string garbage(length, '\0');
    for (char& c : garbage) c = static_cast<char>(random() & 0xFF);
    FlockParser parser = countingParser();
    QCOMPARE(counted(parse(parser, {garbage + countingStream(1, 4)})), (std::vector{1, 2, 3, 4}));
    QCOMPARE(parser.dropped_bytes(), std::uint64_t{length});
  }
}

void FlockTest::everyLostByteCostsOneRecord() {
  constexpr std::size_t kLength = 7;
  for (std::size_t lost = 0; lost < kLength; ++lost) {
    std::string all = countingStream(1, 6);
    all.erase(2 * kLength + lost, 1);
    FlockParser parser = countingParser();
    QCOMPARE(counted(parse(parser, {all})), (std::vector{1, 2, 4, 5, 6}));
  }
}

void FlockTest::everyChangedPhasingBit() {
  const std::string good = countingStream(1, 7);
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string all = good;
    all[at] = static_cast<char>(all[at] ^ 0x80);
    FlockParser parser = countingParser();
    const auto counts = counted(parse(parser, {all}));
    // One record is lost, or two where it could not lock at once; none is made up.
    QVERIFY(counts.size() >= 5 && counts.size() <= 6);
    QVERIFY(std::is_sorted(counts.begin(), counts.end()));
    for (const int count : counts) QVERIFY(count != static_cast<int>(at / 7) + 1);
  }
}

void FlockTest::neverBelievesNoise() {
  std::mt19937 random(5);
  std::string noise(200000, '\0');
  for (char& c : noise) c = static_cast<char>(random() & 0xFF);
  FlockParser parser(settingsOf(layoutOf("position_quaternion", true)));
  std::vector<Reading> readings;
  parser.add(noise, readings);
  parser.add(std::string(5000, '\xFF'), readings);
  parser.add(std::string(5000, '\0'), readings);
  QVERIFY(readings.empty());
}

void FlockTest::strangersAreNoise() {
  const std::string all = countingStream(1, 3);
  FlockParser parser(settingsOf(layoutOf("position", true), {1, 3}));
  QVERIFY(parse(parser, {all}).empty());
  // Of two birds both are read, each as its own sensor.
  std::string both;
  for (int i = 0; i < 3; ++i) {
    const std::string one = countingStream(i + 1, 1);
    both += one;
    both += one.substr(0, 6) + '\3';
  }
  FlockParser two(settingsOf(layoutOf("position", true), {2, 3}));
  const auto readings = parse(two, {both});
  QCOMPARE(readings.size(), std::size_t{6});
  for (std::size_t i = 0; i < readings.size(); ++i) QCOMPARE(readings[i].sample.sensor, static_cast<int>(1 + i % 2));
  // One that is not wanted helps to find the records all the same.
  FlockStreamSettings settings = settingsOf(layoutOf("position", true), {2, 3});
  settings.sensors[2] = -1;
  FlockParser one(settings);
  const auto wanted = parse(one, {both});
  QCOMPARE(wanted.size(), std::size_t{3});
  for (const Reading& reading : wanted) QCOMPARE(reading.sample.sensor, 2);
}

void FlockTest::repeatsAreDropped() {
  std::string all;
  for (int i = 1; i <= 4; ++i) all += countingStream(i, 1) + countingStream(i, 1);
  FlockParser parser = countingParser();
  QCOMPARE(counted(parse(parser, {all})), (std::vector{1, 2, 3, 4}));
  QCOMPARE(parser.repeats(), std::uint64_t{4});
  QCOMPARE(parser.answers(), std::uint64_t{8});
  // What was said before and is said again after something else is no repeat.
  FlockParser other = countingParser();
  QCOMPARE(counted(parse(other, {countingStream(1, 2) + countingStream(1, 2)})), (std::vector{1, 2, 1, 2}));
}

void FlockTest::repeatsCanBeKept() {
  FlockStreamSettings settings = settingsOf(layoutOf("position", true), {2});
  settings.drop_repeats = false;
  FlockParser parser(settings);
  std::string all;
  for (int i = 0; i < 2 * kFlockStuckRecords; ++i) all += countingStream(1, 1);
  const auto readings = parse(parser, {all});
  QCOMPARE(readings.size(), std::size_t{2 * kFlockStuckRecords});
  for (const Reading& reading : readings) QVERIFY(reading.sample.status.empty());
}

void FlockTest::saysWhenStuck() {
  FlockParser parser = countingParser();
  std::string all;
  for (int i = 0; i < kFlockStuckRecords; ++i) all += countingStream(1, 1);
  QCOMPARE(parse(parser, {all}).size(), std::size_t{1});
  const auto stuck = parse(parser, {countingStream(1, 1)});
  QCOMPARE(stuck.size(), std::size_t{1});
  QCOMPARE(stuck[0].sample.status, std::string(kStatusStuck));
  const auto free = parse(parser, {countingStream(2, 1)});
  QCOMPARE(free.size(), std::size_t{1});
  QCOMPARE(free[0].sample.status, std::string());
}

void FlockTest::commandsByHand_data() {
  QTest::addColumn<QByteArray>("command");
  QTest::addColumn<QByteArray>("expected");
  const auto row = [](const std::string& command, std::string_view expected) {
    QTest::newRow(std::string(expected).c_str())
        << QByteArray::fromStdString(command) << QByteArray::fromStdString(bytes(expected));
  };
  row(flock::point(), "<42>");
  row(flock::stream(), "<40>");
  row(flock::run(), "F");
  row(flock::sleep(), "G");
  row(flock::mode(*findFlockMode("position_quaternion")), "<5D>");
  row(flock::mode(*findFlockMode("quaternion")), "<5C>");
  row(flock::reportEveryCycle(), "Q");
  row(flock::groupMode(true), "P<23 01>");
  row(flock::autoConfigure(3), "P<32 03>");
  row(flock::examine(36), "O<24>");
  row(flock::filters(false, false, false), "P<04 07 00>");
  row(flock::filters(true, false, true), "P<04 02 00>");
  row(flock::scale(true), "P<03 01 00>");
  row(flock::clearAngleAlign(), "q<00 00 00 00 00 00>");
  row(flock::toBird(2, "]"), "<F2 5D>");
  row(flock::toBird(0, "]"), "<5D>");
  row(flock::toBird(17, "]", FlockAddressing::kExpanded), "<F1 5D>");
  row(flock::toBird(17, "]", FlockAddressing::kSuperExpanded), "<B1 5D>");
}

void FlockTest::commandsByHand() {
  QFETCH(QByteArray, command);
  QFETCH(QByteArray, expected);
  QCOMPARE(command, expected);
}

void FlockTest::readsGluedCommands() {
  // Group mode, two birds' modes and hemispheres, a parameter, the stream: in one write, and cut anywhere.
  const std::string all = bytes("P<23 01 F2 5D F3 5D F2>L<0C 00 F3>L<0C 01>O<24>P<32 03>z@");
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    FlockCommandReader reader;
    std::vector<FlockCommand> commands;
    reader.add(all.substr(0, cut), commands);
    reader.add(all.substr(cut), commands);
    QCOMPARE(commands.size(), std::size_t{9});
    QCOMPARE(commands[0].parameter, std::optional(35));
    QCOMPARE(commands[0].data, std::string(1, '\1'));
    QCOMPARE(commands[2].address, 3);
    QCOMPARE(commands[2].letter, ']');
    QCOMPARE(commands[3].data, (std::string{'\x0C', '\0'}));
    QCOMPARE(commands[4].address, 3);
    QCOMPARE(commands[5].parameter, std::optional(36));
    QCOMPARE(commands[6].data, std::string(1, '\3'));
    QCOMPARE(commands[7].letter, 'z');
    QCOMPARE(commands[8].letter, '@');
  }
}

void FlockTest::addressingModes() {
  const auto addressOf = [](FlockAddressing addressing, std::string_view command) {
    FlockCommandReader reader(addressing);
    std::vector<FlockCommand> commands;
    reader.add(bytes(command), commands);
    FT_CHECK(commands.size() == 1);
    return commands[0].address;
  };
  QCOMPARE(addressOf(FlockAddressing::kNormal, "<FE>B"), 14);
  QCOMPARE(addressOf(FlockAddressing::kExpanded, "<FE>B"), 30);
  QCOMPARE(addressOf(FlockAddressing::kSuperExpanded, "<FE>B"), 94);
  QCOMPARE(addressOf(FlockAddressing::kNormal, "B"), 0);
}

void FlockTest::hemispheres() {
  // The table of the manual: front, aft, upper, lower, left, right.
  const std::pair<const char*, std::array<unsigned char, 2>> kTable[] = {{"+x", {0x00, 0x00}}, {"-x", {0x00, 0x01}},
                                                                         {"-z", {0x0C, 0x01}}, {"+z", {0x0C, 0x00}},
                                                                         {"-y", {0x06, 0x01}}, {"+y", {0x06, 0x00}}};
  for (const auto& [side, code] : kTable) {
    QVERIFY(flockHemisphere(side) == code);
    const auto axis = flockHemisphereAxis(code[0], code[1]);
    QCOMPARE((*axis)[side[1] - 'x'], side[0] == '-' ? -1.0 : 1.0);
    QCOMPARE(axis->norm(), 1.0);
  }
  QVERIFY(!flockHemisphere("tracked"));
  QVERIFY(!flockHemisphereAxis(0x05, 0));
  QVERIFY(!flockHemisphereAxis(0x12, 0));
}

void FlockTest::statusWordByHand() {
  // Master, initialised, running, position and quaternion.
  const FlockStatus status = decodeFlockStatus(bytes("<10 D0>"));
  QVERIFY(status.master && status.initialised && status.running && !status.error && !status.sleeping);
  QCOMPARE(status.mode, 8);
  QCOMPARE(encodeFlockStatus(status), bytes("<10 D0>"));
  QVERIFY(flockStatusMeaning(status).empty());
  // An error, asleep.
  const FlockStatus bad = decodeFlockStatus(bytes("<20 60>"));
  QVERIFY(bad.error && bad.sleeping && bad.initialised && !bad.running);
  FT_VERIFY_MATCH(holdsAll(flockStatusMeaning(bad), {"error", "asleep", "not running"}));
  for (unsigned word = 0; word < 0x10000; ++word) {
    const std::string code = flockNumberBytes(static_cast<int>(word));
    QCOMPARE(encodeFlockStatus(decodeFlockStatus(code)), code);
  }
}

void FlockTest::unitsByHand() {
  const auto units = decodeFlockUnits(bytes("<D2 E0 A0 00>"));
  QCOMPARE(units.size(), std::size_t{4});
  QVERIFY(units[0].extended_range_controller && units[0].accessible && units[0].running && !units[0].receiver);
  QCOMPARE(units[0].transmitters, 2u);
  QVERIFY(units[1].receiver && units[1].running && !units[1].extended_range_controller);
  QVERIFY(units[2].receiver && !units[2].running);
  QVERIFY(units[3] == FlockUnit{});
  for (unsigned byte = 0; byte < 256; ++byte) {
    QCOMPARE(unsigned{encodeFlockUnit(decodeFlockUnit(static_cast<unsigned char>(byte)))}, byte);
  }
}

void FlockTest::rateFormula() {
  // 4 * 3000 * (8 / 40) / 1000 + 0.3 = 2.7 ms.
  FT_VERIFY_MATCH(near(flockRate_hz(3000, 40), 1000.0 / 2.7, 1e-9));
  for (const double rate_hz : {30.0, 86.1, 103.3, 144.0}) {
    FT_VERIFY_MATCH(near(flockRate_hz(flockRateCount(rate_hz, 25), 25), rate_hz, 0.02));
  }
}

void FlockTest::meanings() {
  QVERIFY(flockErrorMeaning(0).empty());
  FT_VERIFY_MATCH(holdsAll(flockErrorMeaning(32), {"saturated"}));
  FT_VERIFY_MATCH(holdsAll(flockErrorMeaning(13), {"bus"}));
  FT_VERIFY_MATCH(holdsAll(flockErrorMeaning(99), {"99"}));
  for (int code = 1; code <= 35; ++code) QVERIFY(!flockErrorMeaning(code).empty());
  FT_VERIFY_MATCH(holdsAll(flockSampleMeaning(kStatusStuck), {"saturated", "repeats=keep"}));
  FT_VERIFY_MATCH(holdsAll(flockSampleMeaning(kStatusDamaged), {"damaged"}));
}

FIELDTRUE_TEST(FlockTest)
#include "flock_test.moc"
