#include <QTest>
#include <random>

#include "acquisition/emulators/fastrak_emulator_core.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

constexpr double kRadPerDeg = 0.017453292519943295;

/// Station n of the exchange with VRPN stands at (0.254 n, -0.127, 0.0635 n) m, az el roll (30 n, 10, -20) deg.
std::vector<Pose> vrpnPoses(int stations) {
  std::vector<Pose> poses;
  for (int n = 1; n <= stations; ++n) {
    poses.push_back(
        {{0.254 * n, -0.127, 0.0635 * n}, rotationFromEuler(Eigen::Vector3d(30.0 * n, 10.0, -20.0) * kRadPerDeg)});
  }
  return poses;
}

FastrakEmulatorCore standing(std::vector<Pose> poses, EmulatorFaults faults = {}) {
  FastrakEmulatorOptions options;
  options.faults = faults;
  return FastrakEmulatorCore(std::make_unique<StandingSource>(std::move(poses)), options);
}

std::string replies(FastrakEmulatorCore& core, std::string_view bytes, double time_s = 0.0) {
  std::vector<EmulatedOutput> out;
  core.receive(bytes, time_s, out);
  std::string all;
  for (const auto& piece : out) all += piece.bytes;
  return all;
}

std::vector<EmulatedOutput> until(FastrakEmulatorCore& core, double time_s) {
  std::vector<EmulatedOutput> out;
  while (core.tick(time_s, out)) {
  }
  return out;
}

/// Position and rotation a polled record of station 1 reports, in the list 2,11,0.
Pose polled(FastrakEmulatorCore& core) {
  replies(core, "fO1,2,11,0\r");
  const std::string record = replies(core, "P").substr(0, 32);
  const auto layout = *fastrakLayout(std::vector{2, 11, 0}, FastrakFormat::kBinary);
  const auto decoded = decodeRecord(record, layout, core.status().unit);
  FT_CHECK(decoded.has_value());
  return toSample(*decoded, 0.0).tracker_from_sensor;
}

}  // namespace

class FastrakEmulatorTest : public QObject {
  Q_OBJECT
 private slots:
  void takesWhatVrpnSends_data();
  void takesWhatVrpnSends();
  void powerUpState();
  void rateIsShared_data();
  void rateIsShared();
  void neitherDriftsNorDrops();
  void pollsOneRecordOfEachStation();
  void stationsSwitchOff();
  void hemisphereMirrors();
  void boresightZeroes();
  void alignmentTurnsTheFrame();
  void tipOffsetMoves();
  void incrementHoldsBack();
  void envelopesMark();
  void unitsConvertSettings();
  void resetIsSilentAndForgets();
  void flowControlHolds();
  void readsSettingsBack_data();
  void readsSettingsBack();
  void refuses_data();
  void refuses();
  void replaysEachRowOnce();
  void faultList();
  void badFaultLists_data();
  void badFaultLists();
};

void FastrakEmulatorTest::takesWhatVrpnSends_data() {
  QTest::addColumn<bool>("binary");
  QTest::newRow("binary") << true;
  QTest::newRow("ASCII") << false;
}

void FastrakEmulatorTest::takesWhatVrpnSends() {
  QFETCH(bool, binary);
  auto core = standing(vrpnPoses(4));
  QVERIFY(replies(core, "c").empty());
  QCOMPARE(replies(core, "S").size(), std::size_t{55});
  const std::string setup =
      replies(core, "O1,2,11,0\rO2,2,11,0\rO3,2,11,0\rO4,2,11,0\rx0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\re1,0\r");
  QVERIFY2(setup.empty(), setup.c_str());
  QVERIFY(replies(core,
                  "\r"
                  "tY")
              .empty());
  QVERIFY(replies(core, binary ? "f" : "F").empty());
  QVERIFY(replies(core, "C").empty());

  FastrakStreamSettings settings;
  settings.format = binary ? FastrakFormat::kBinary : FastrakFormat::kAscii;
  settings.unit = FastrakUnit::kInch;
  settings.items.fill({2, 11, 0});
  auto parser = *FastrakParser::make(settings);
  std::vector<FastrakRecord> records;
  for (const auto& piece : until(core, 0.5)) parser.add(piece.bytes, records);
  QVERIFY(records.size() >= 60);
  QCOMPARE(parser.dropped_bytes(), std::uint64_t{0});
  // The quaternion VRPN printed.
  const Pose expected{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};
  QCOMPARE(records[0].station, 1);
  FT_VERIFY_MATCH(
      near(toSample(records[0], 0.0).tracker_from_sensor, expected, binary ? 1e-7 : 1e-6, binary ? 2e-6 : 2e-4));
}

void FastrakEmulatorTest::powerUpState() {
  auto core = standing(vrpnPoses(2));
  const auto status = findStatus(replies(core, "S"));
  QCOMPARE(status->format, FastrakFormat::kAscii);
  QCOMPARE(status->unit, FastrakUnit::kInch);
  QCOMPARE(status->continuous, false);
  QCOMPARE(status->sensors, 3u);
  QCOMPARE(replies(core, "P"), std::string("01   10.00  -5.00   2.50  30.00  10.00 -20.00\r\n"
                                           "02   20.00  -5.00   5.00  60.00  10.00 -20.00\r\n"));
}

void FastrakEmulatorTest::rateIsShared_data() {
  QTest::addColumn<int>("stations");
  for (const int n : {1, 2, 4}) QTest::addRow("%d", n) << n;
}

void FastrakEmulatorTest::rateIsShared() {
  QFETCH(int, stations);
  auto core = standing(vrpnPoses(stations));
  replies(core, "C", 5.0);
  const auto out = until(core, 5.999);
  QCOMPARE(out.size(), std::size_t{120});
  for (std::size_t i = 0; i < out.size(); ++i) {
    QCOMPARE(out[i].bytes[1] - '1', static_cast<int>(i) % stations);
    QVERIFY(out[i].record);
  }
}

void FastrakEmulatorTest::neitherDriftsNorDrops() {
  auto core = standing(vrpnPoses(1));
  replies(core, "C", 0.0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> step(0.0, 0.05);
  double time_s = 0.0;
  std::size_t sent = 0;
  while (time_s < 100.0) {
    time_s += step(random);
    sent += until(core, time_s).size();
    QCOMPARE(sent, static_cast<std::size_t>(time_s * 120.0) + 1);
  }
  // A long pause is made up for in pieces.
  std::vector<EmulatedOutput> out;
  QVERIFY(core.tick(time_s + 10.0, out, 100));
  QCOMPARE(out.size(), std::size_t{100});
  QCOMPARE(out.size() + until(core, time_s + 10.0).size() + sent,
           static_cast<std::size_t>((time_s + 10.0) * 120.0) + 1);
}

void FastrakEmulatorTest::pollsOneRecordOfEachStation() {
  auto core = standing(vrpnPoses(3));
  std::vector<EmulatedOutput> out;
  core.receive("PP", 0.0, out);
  QCOMPARE(out.size(), std::size_t{6});
  QCOMPARE(core.records(), std::uint64_t{6});
}

void FastrakEmulatorTest::stationsSwitchOff() {
  auto core = standing(vrpnPoses(2));
  QCOMPARE(replies(core, "l1\r"), std::string("21l1100\r\n"));
  replies(core, "l1,0\rl3,1\r");
  QCOMPARE(replies(core, "l1\r"), std::string("21l0100\r\n"));
  QCOMPARE(replies(core, "P").substr(0, 2), std::string("02"));
}

void FastrakEmulatorTest::hemisphereMirrors() {
  const Pose behind{{-0.3, 0.1, 0.2}, Eigen::Quaterniond::Identity()};
  auto core = standing({behind});
  FT_VERIFY_MATCH(near(polled(core).position_m, Eigen::Vector3d(0.3, -0.1, -0.2), 1e-6));
  replies(core, "H1,-1,0,0\r");
  FT_VERIFY_MATCH(near(polled(core), behind, 1e-6, 1e-6));
  replies(core, "H1,0,0,0\r");
  FT_VERIFY_MATCH(near(polled(core), behind, 1e-6, 1e-6));
}

void FastrakEmulatorTest::boresightZeroes() {
  auto core = standing(vrpnPoses(1));
  replies(core, "B1\r");
  FT_VERIFY_MATCH(near(polled(core).orientation, Eigen::Quaterniond::Identity(), 1e-6));
  // Turning the sensor about the transmitter's Z then reads as azimuth alone.
  auto& source = dynamic_cast<StandingSource&>(core.source());
  Pose turned = vrpnPoses(1)[0];
  const Eigen::Quaterniond about_z = rotationFromEuler(Eigen::Vector3d(0.5, 0.0, 0.0));
  turned.orientation = about_z * turned.orientation;
  source.put(0, turned);
  FT_VERIFY_MATCH(near(polled(core).orientation, about_z, 1e-6));
  replies(core, "b1\r");
  FT_VERIFY_MATCH(near(polled(core).orientation, turned.orientation, 1e-6));
}

void FastrakEmulatorTest::alignmentTurnsTheFrame() {
  auto core = standing({{{0.3, 0.2, 0.1}, Eigen::Quaterniond::Identity()}});
  // In centimetres: origin (10, 0, 0), X towards +y, Y towards -x.
  replies(core, "uA1,10,0,0,10,10,0,0,0,0\r");
  const Pose pose = polled(core);
  FT_VERIFY_MATCH(near(pose.position_m, Eigen::Vector3d(0.2, -0.2, 0.1), 1e-6));
  FT_VERIFY_MATCH(near(eulerFromRotation_rad(pose.orientation).x(), -90.0 * kRadPerDeg, 1e-6));
  replies(core, "R1\r");
  FT_VERIFY_MATCH(near(polled(core).position_m, Eigen::Vector3d(0.3, 0.2, 0.1), 1e-6));
}

void FastrakEmulatorTest::tipOffsetMoves() {
  auto core = standing({{{0.3, 0.0, 0.0}, rotationFromEuler(Eigen::Vector3d(90.0 * kRadPerDeg, 0.0, 0.0))}});
  replies(core, "uN1,10,0,0\r");
  FT_VERIFY_MATCH(near(polled(core).position_m, Eigen::Vector3d(0.3, 0.1, 0.0), 1e-6));
}

void FastrakEmulatorTest::incrementHoldsBack() {
  auto core = standing({{{0.3, 0.0, 0.0}, Eigen::Quaterniond::Identity()}});
  replies(core, "uI1,2.5\rC");
  QCOMPARE(until(core, 1.0).size(), std::size_t{1});
  dynamic_cast<StandingSource&>(core.source()).put(0, {{0.32, 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  QCOMPARE(until(core, 2.0).size(), std::size_t{0});
  dynamic_cast<StandingSource&>(core.source()).put(0, {{0.33, 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  QCOMPARE(until(core, 3.0).size(), std::size_t{1});
}

void FastrakEmulatorTest::envelopesMark() {
  auto core = standing({{{0.3, 0.0, 0.0}, Eigen::Quaterniond::Identity()}});
  replies(core, "uV1,20,20,20,-20,-20,-20\r");
  QCOMPARE(replies(core, "P")[2], 'x');
  replies(core, "V1,40\rQ1,180,90,180,10,-90,-180\r");
  QCOMPARE(replies(core, "P")[2], 'y');
}

void FastrakEmulatorTest::unitsConvertSettings() {
  auto core = standing(vrpnPoses(1));
  replies(core, "I1,2\ru");
  QCOMPARE(core.numbers('I', 1)[0], 5.08);
  QCOMPARE(replies(core, "I1\r"), std::string("21I   5.08\r\n"));
  QCOMPARE(core.numbers('H', 1)[0], 1.0);
}

void FastrakEmulatorTest::resetIsSilentAndForgets() {
  auto core = standing(vrpnPoses(1));
  replies(core, "uO1,2,1\r\x0B", 0.0);
  replies(core, "fUO1,4,1\rC", 1.0);
  QVERIFY(!replies(core, "S", 1.5).empty());
  QVERIFY(replies(core,
                  "\x19"
                  "S",
                  2.0)
              .empty());
  QVERIFY(replies(core, "S", 11.9).empty());
  QVERIFY(until(core, 11.9).empty());
  const auto status = findStatus(replies(core, "S", 12.1));
  QVERIFY(status && !status->continuous && status->unit == FastrakUnit::kCentimetre);
  QCOMPARE(status->format, FastrakFormat::kAscii);
  QCOMPARE(core.outputList(1), (std::vector{2, 1}));
  replies(core, "W", 13.0);
  QCOMPARE(core.outputList(1), (std::vector{2, 4, 1}));
}

void FastrakEmulatorTest::flowControlHolds() {
  auto core = standing(vrpnPoses(1));
  replies(core, "C");
  replies(core, "\x13");
  QVERIFY(until(core, 0.5).empty());
  replies(core, "\x11", 0.5);
  QCOMPARE(until(core, 0.5).size(), std::size_t{61});
}

void FastrakEmulatorTest::readsSettingsBack_data() {
  QTest::addColumn<QByteArray>("set");
  QTest::addColumn<QByteArray>("ask");
  QTest::addColumn<QByteArray>("answer");
  const auto row = [](const char* set, const char* ask, const char* answer) {
    QTest::newRow(ask) << QByteArray(set) << QByteArray(ask) << QByteArray(answer);
  };
  row("O2,2,11,16,1\r", "O2\r", "22O 21116 1\r\n");
  row("H3,0,-1,0\r", "H3\r", "23H   0.00  -1.00   0.00\r\n");
  row("I1,.5\r", "I1\r", "21I   0.50\r\n");
  row("x,1\r", "x\r", "21x  0.200  1.000  0.800  0.950\r\n");
  row("v2\r", "v\r", "21v  0.000  1.000  0.000  0.000\r\n");
  row("V1,1,2,3,,,-9\r", "V1\r", "21V   1.00   2.00   3.00-390.00-390.00  -9.00\r\n");
}

void FastrakEmulatorTest::readsSettingsBack() {
  QFETCH(QByteArray, set);
  QFETCH(QByteArray, ask);
  auto core = standing(vrpnPoses(4));
  QVERIFY(replies(core, set.toStdString()).empty());
  QTEST(QByteArray::fromStdString(replies(core, ask.toStdString())), "answer");
}

void FastrakEmulatorTest::refuses_data() {
  QTest::addColumn<QByteArray>("command");
  QTest::addColumn<int>("code");
  QTest::newRow("no station") << QByteArray("O\r") << -1;
  QTest::newRow("station 5") << QByteArray("O5,2\r") << -3;
  QTest::newRow("not numeric") << QByteArray("H1,a,0,0\r") << -2;
  QTest::newRow("unknown item") << QByteArray("O1,2,9\r") << -3;
  QTest::newRow("too many numbers") << QByteArray("I1,1,2\r") << -3;
  QTest::newRow("station neither on nor off") << QByteArray("l1,2\r") << -3;
  QTest::newRow("unknown letter") << QByteArray("z1\r") << -99;
  QTest::newRow("overlong") << QByteArray("O1" + QByteArray(300, ',') + "\r") << -5;
}

void FastrakEmulatorTest::refuses() {
  QFETCH(QByteArray, command);
  auto core = standing(vrpnPoses(1));
  const auto refusal = findRefusal(replies(core, command.toStdString()));
  QVERIFY(refusal.has_value());
  QTEST(refusal->code, "code");
  QCOMPARE(core.outputList(1), (std::vector{2, 4, 1}));
}

void FastrakEmulatorTest::replaysEachRowOnce() {
  SampleTable table;
  for (int i = 0; i < 50; ++i) {
    Sample sample{3.0 + i * 0.01, i % 2, {{-0.01 * i, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, i == 7 ? "j" : ""};
    table.rows.push_back({-1, 0, sample});
  }
  auto source = std::make_unique<ReplaySource>(table);
  QCOMPARE(source->rate_hz(), 100.0);
  QCOMPARE(source->sensors(), 3u);
  FastrakEmulatorCore core(std::move(source));
  replies(core, "uO1,2,1\rO2,2,1\rC", 8.0);
  QCOMPARE(until(core, 8.205).size(), std::size_t{21});
  const auto rest = until(core, 20.0);
  QCOMPARE(rest.size(), std::size_t{29});
  QCOMPARE(rest.back().bytes, std::string("02  -49.00   0.00   0.00\r\n"));
  // Switched on again it plays again, in the hemisphere that was recorded.
  replies(core, "cC", 30.0);
  const auto again = until(core, 40.0);
  QCOMPARE(again.size(), std::size_t{50});
  QCOMPARE(again[7].bytes.substr(0, 3), std::string("02j"));
}

void FastrakEmulatorTest::faultList() {
  for (const auto& row : emulatorFaults()) {
    QVERIFY(!row.help.empty());
    FT_VERIFY_OK(parseFaults(row.id + (row.needs_count ? "=5" : "")));
  }
  const auto faults = parseFaults("lost_bytes,unplug_after=500,outliers");
  QVERIFY(faults && faults->lost_bytes && faults->outliers && !faults->silence);
  QCOMPARE(faults->unplug_after, std::uint64_t{500});
  FT_VERIFY_OK(parseFaults(""));
}

void FastrakEmulatorTest::badFaultLists_data() {
  QTest::addColumn<QByteArray>("list");
  QTest::addColumn<QByteArray>("fragment");
  QTest::newRow("unknown") << QByteArray("lost_byte") << QByteArray("garbage_at_open");
  QTest::newRow("no count") << QByteArray("unplug_after") << QByteArray("unplug_after=500");
  QTest::newRow("zero count") << QByteArray("unplug_after=0") << QByteArray("at least 1");
  QTest::newRow("count not asked for") << QByteArray("silence=1") << QByteArray("no value");
}

void FastrakEmulatorTest::badFaultLists() {
  QFETCH(QByteArray, list);
  QFETCH(QByteArray, fragment);
  const auto faults = parseFaults(list.toStdString());
  QVERIFY(!faults);
  FT_VERIFY_MATCH(holdsAll(faults.error().message, {fragment}));
}

FIELDTRUE_TEST(FastrakEmulatorTest)
#include "fastrak_emulator_test.moc"
