#include "acquisition/emulators/liberty_emulator.h"

#include <QTest>

#include "acquisition/protocols/little_endian.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

constexpr double kRadPerDegree = 0.017453292519943295;

/// Station n of the exchange with VRPN stands at (0.254 n, -0.127, 0.0635 n) m, az el roll (30 n, 10, -20) deg.
std::vector<Pose> vrpnPlaces(int stations) {
  std::vector<Pose> poses;
  for (int n = 1; n <= stations; ++n) {
    poses.push_back(
        {{0.254 * n, -0.127, 0.0635 * n}, rotationFromEuler(Eigen::Vector3d(30.0 * n, 10.0, -20.0) * kRadPerDegree)});
  }
  return poses;
}

LibertyEmulator unitAt(std::vector<Pose> poses, const char* make = "liberty", EmulatorFaults faults = {}) {
  LibertyEmulatorOptions options(libertyMake(make));
  options.faults = faults;
  return LibertyEmulator(std::make_unique<StandingSource>(std::move(poses), libertyMake(make).rate_hz), options);
}

std::string said(LibertyEmulator& unit, std::string_view bytes, double time_s = 0.0) {
  std::vector<EmulatedOutput> out;
  unit.receive(bytes, time_s, out);
  std::string all;
  for (const auto& piece : out) all += piece.bytes;
  return all;
}

std::vector<EmulatedOutput> sentUntil(LibertyEmulator& unit, double time_s) {
  std::vector<EmulatedOutput> out;
  while (unit.tick(time_s, out)) {
  }
  return out;
}

const std::vector<int> kPoseItems = {2, 7, 8, 0};

LibertyRecord polledRecord(LibertyEmulator& unit) {
  said(unit, "F1\rO*,2,7,8,0\r");
  const auto frame = findLibertyFrame(said(unit, "P"), 'P');
  FT_CHECK(frame.has_value());
  return *decodeLibertyRecord(*frame, kPoseItems, unit.isMetric() ? 0.01 : 0.0254);
}

Pose polledPose(LibertyEmulator& unit) { return sampleOfNumbers(polledRecord(unit), 0, {}).tracker_from_sensor; }

}  // namespace

class LibertyEmulatorTest : public QObject {
  Q_OBJECT
 private slots:
  void takesWhatVrpnSends();
  void powerUpState();
  void everyStationHasTheWholeRate_data();
  void everyStationHasTheWholeRate();
  void pointStopsTheStream();
  void stampsAreItsOwnClock();
  void stationsSwitchOff();
  void hemisphereMirrors();
  void boresightAndAlignment();
  void tipOffset();
  void readsSettingsBack();
  void resetIsSilentAndForgets();
  void refuses_data();
  void refuses();
  void replaysWithOtherSensors();
};

void LibertyEmulatorTest::takesWhatVrpnSends() {
  auto unit = unitAt(vrpnPlaces(8));
  // One character at a time, two seconds apart.
  double time_s = 0.0;
  std::string answers;
  for (const char c : std::string("\rF0\rP")) answers += said(unit, std::string(1, c), time_s += 2.0);
  QCOMPARE(answers.substr(0, 2), std::string("01"));
  const std::string who = said(unit, "\x16\r", 20.0);
  QCOMPARE(who.size(), std::size_t{196});
  QCOMPARE(who[0], '0');
  QCOMPARE(who.back(), '\n');
  std::string setup;
  for (int station = 1; station <= 8; ++station)
    setup += said(unit, "O" + std::to_string(station) + ",2,7,8,0\r", 21.0);
  setup += said(unit,
                "X0.2,0.2,0.8,0.8\r"
                "Y0.2,0.2,0.8,0.8\r"
                "F1\rC\r"
                "Q0\r",
                22.0);
  QCOMPARE(setup, std::string());
  const auto out = sentUntil(unit, 22.0);
  QCOMPARE(out.size(), std::size_t{8});
  // As VRPN reads it: tag, station, 41 bytes, a blank at the end; inches; w, x, y, z; milliseconds since Q0.
  const std::string& record = out[0].bytes;
  QCOMPARE(record.size(), std::size_t{41});
  QCOMPARE(record.substr(0, 3), std::string("LY\x01"));
  QCOMPARE(record.back(), ' ');
  QCOMPARE(littleEndianFloat(record.data() + 8), 10.0);
  FT_VERIFY_MATCH(near(littleEndianFloat(record.data() + 20), 0.943714, 1e-6));
  QCOMPARE(littleEndian32(record.data() + 36), 0u);
}

void LibertyEmulatorTest::powerUpState() {
  auto unit = unitAt(vrpnPlaces(2));
  QVERIFY(!unit.isBinary() && !unit.isMetric() && !unit.streaming());
  QCOMPARE(said(unit, "P"), std::string("01     10.000   -5.000    2.500   30.000   10.000  -20.000\r\n"
                                        "02     20.000   -5.000    5.000   60.000   10.000  -20.000\r\n"));
}

void LibertyEmulatorTest::everyStationHasTheWholeRate_data() {
  QTest::addColumn<QByteArray>("make");
  QTest::addColumn<int>("stations");
  QTest::addColumn<int>("rate_hz");
  QTest::newRow("Liberty, 1") << QByteArray("liberty") << 1 << 240;
  QTest::newRow("Liberty, 16") << QByteArray("liberty") << 16 << 240;
  QTest::newRow("Patriot, 1") << QByteArray("patriot") << 1 << 60;
  QTest::newRow("Patriot, 2") << QByteArray("patriot") << 2 << 60;
}

void LibertyEmulatorTest::everyStationHasTheWholeRate() {
  QFETCH(QByteArray, make);
  QFETCH(int, stations);
  QFETCH(int, rate_hz);
  auto unit = unitAt(vrpnPlaces(stations), make.constData());
  said(unit, "F1\rC\r", 5.0);
  const auto out = sentUntil(unit, 6.999);
  QCOMPARE(out.size(), static_cast<std::size_t>(2 * rate_hz * stations));
  for (std::size_t i = 0; i < out.size(); ++i) {
    QCOMPARE(static_cast<int>(out[i].bytes[2]), static_cast<int>(i) % stations + 1);
    QVERIFY(out[i].record);
  }
}

void LibertyEmulatorTest::pointStopsTheStream() {
  auto unit = unitAt(vrpnPlaces(1));
  said(unit, "C\r");
  QVERIFY(unit.streaming());
  QVERIFY(said(unit, "P").empty());
  QVERIFY(!unit.streaming());
  QVERIFY(!said(unit, "P").empty());
}

void LibertyEmulatorTest::stampsAreItsOwnClock() {
  auto unit = unitAt(vrpnPlaces(2));
  said(unit, "F1\rO*,8,9,1\rQ0\r", 3.0);
  said(unit, "C\r", 10.0);
  const auto out = sentUntil(unit, 11.0);
  QCOMPARE(out.size(), std::size_t{482});
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto record = decodeLibertyRecord(*findLibertyFrame(out[i].bytes, 'C'), std::vector{8, 9, 1}, 1.0);
    // Both stations of a cycle have one stamp: whole milliseconds since Q0.
    const auto cycle = static_cast<double>(i / 2);
    QCOMPARE(record->time_ms, static_cast<std::uint32_t>(7000.0 + std::floor(cycle * 1000.0 / 240.0 + 1e-6)));
    QCOMPARE(record->frame, static_cast<std::uint32_t>(i / 2 + 1));
  }
}

void LibertyEmulatorTest::stationsSwitchOff() {
  auto unit = unitAt(vrpnPlaces(3));
  said(unit, std::string("F1\r\x15") + "2,0\r");
  const auto state = findLibertyFrame(said(unit, std::string("\x15") + "0\r"), kLibertyStations);
  QCOMPARE(state->payload, std::string("\x07\x00\x05\x00", 4));
  QCOMPARE(said(unit, "P").size(), std::size_t{2 * (8 + 24 + 2)});
}

void LibertyEmulatorTest::hemisphereMirrors() {
  const Pose behind{{-0.3, 0.1, 0.2}, Eigen::Quaterniond::Identity()};
  auto unit = unitAt({behind});
  FT_VERIFY_MATCH(near(polledPose(unit).position_m, Eigen::Vector3d(0.3, -0.1, -0.2), 1e-6));
  said(unit, "H1,-1,0,0\r");
  FT_VERIFY_MATCH(near(polledPose(unit), behind, 1e-6, 1e-6));
  said(unit, "H*,0,0,0\r");
  FT_VERIFY_MATCH(near(polledPose(unit), behind, 1e-6, 1e-6));
}

void LibertyEmulatorTest::boresightAndAlignment() {
  auto unit = unitAt({{{0.3, 0.2, 0.1}, rotationFromEuler(Eigen::Vector3d(0.4, 0.1, 0.0))}});
  said(unit, "B1\r");
  FT_VERIFY_MATCH(near(polledPose(unit).orientation, Eigen::Quaterniond::Identity(), 1e-6));
  said(unit, "\x02*\r");
  FT_VERIFY_MATCH(near(polledPose(unit).orientation, rotationFromEuler(Eigen::Vector3d(0.4, 0.1, 0.0)), 1e-6));
  // In centimetres: origin (10, 0, 0), X towards +y, Y towards -x.
  said(unit, "U1\rA1,10,0,0,10,10,0,0,0,0\r");
  FT_VERIFY_MATCH(near(polledPose(unit).position_m, Eigen::Vector3d(0.2, -0.2, 0.1), 1e-6));
  said(unit, "R*\r");
  FT_VERIFY_MATCH(near(polledPose(unit).position_m, Eigen::Vector3d(0.3, 0.2, 0.1), 1e-6));
}

void LibertyEmulatorTest::tipOffset() {
  auto unit = unitAt({{{0.3, 0.0, 0.0}, rotationFromEuler(Eigen::Vector3d(90.0 * kRadPerDegree, 0.0, 0.0))}});
  said(unit, "U1\rN1,10,0,0\rU0\r");
  FT_VERIFY_MATCH(near(polledPose(unit).position_m, Eigen::Vector3d(0.3, 0.1, 0.0), 1e-6));
}

void LibertyEmulatorTest::readsSettingsBack() {
  auto unit = unitAt(vrpnPlaces(2));
  QCOMPARE(said(unit, "H2,0,-1,0\rH2\r"), std::string("02H      0.000   -1.000    0.000\r\n"));
  QCOMPARE(said(unit, "X0,1,0,0\rX\r"), std::string("00X      0.000    1.000    0.000    0.000\r\n"));
  QCOMPARE(said(unit, std::string("\x15") + "0\r"), std::string("00u  3,3\r\n"));
}

void LibertyEmulatorTest::resetIsSilentAndForgets() {
  auto unit = unitAt(vrpnPlaces(1));
  said(unit, "F1\rU1\rO*,8,1\rC\r", 1.0);
  QVERIFY(said(unit, "\x19\r\x16\r", 2.0).empty());
  QVERIFY(said(unit, "\x16\r", 11.9).empty());
  QVERIFY(sentUntil(unit, 11.9).empty());
  QCOMPARE(said(unit, "\x16\r", 12.1).size(), std::size_t{196});
  QVERIFY(!unit.isBinary() && !unit.isMetric() && !unit.streaming());
  QCOMPARE(unit.outputList(1), (std::vector{2, 4, 1}));
}

void LibertyEmulatorTest::refuses_data() {
  QTest::addColumn<QByteArray>("command");
  QTest::addColumn<QByteArray>("why");
  QTest::newRow("unknown letter") << QByteArray("S\r") << QByteArray("Invalid Command");
  QTest::newRow("station that is not there") << QByteArray("H5,1,0,0\r") << QByteArray("Invalid Station");
  QTest::newRow("no station") << QByteArray("O\r") << QByteArray("Invalid");
  QTest::newRow("not numeric") << QByteArray("H1,a,0,0\r") << QByteArray("Invalid Parameter");
  QTest::newRow("unknown item") << QByteArray("O1,2,40\r") << QByteArray("Invalid Parameter");
  QTest::newRow("neither on nor off") << QByteArray("F2\r") << QByteArray("Invalid Parameter");
}

void LibertyEmulatorTest::refuses() {
  QFETCH(QByteArray, command);
  QFETCH(QByteArray, why);
  auto unit = unitAt(vrpnPlaces(1));
  FT_VERIFY_MATCH(holdsAll(said(unit, command.toStdString()), {"*ERROR*", why}));
  said(unit, "F1\r");
  const auto refusal = findLibertyRefusal(said(unit, command.toStdString()));
  QVERIFY(refusal.has_value());
  QCOMPARE(refusal->command, command[0]);
  QCOMPARE(unit.outputList(1), (std::vector{2, 4, 1}));
}

void LibertyEmulatorTest::replaysWithOtherSensors() {
  SampleTable table;
  for (int i = 0; i < 50; ++i) {
    table.rows.push_back(
        {-1, 0, Sample{3.0 + i * 0.01, 7 + i % 2, {{-0.01 * i, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, ""}});
  }
  LibertyEmulator unit(std::make_unique<ReplaySource>(table));
  said(unit, "F1\rU1\rO*,8,2,1\rC\r", 8.0);
  const auto out = sentUntil(unit, 20.0);
  QCOMPARE(out.size(), std::size_t{50});
  const auto last = decodeLibertyRecord(*findLibertyFrame(out.back().bytes, 'C'), std::vector{8, 2, 1}, 0.01);
  QCOMPARE(last->station, 9);
  FT_VERIFY_MATCH(near(*last->position_m, Eigen::Vector3d(-0.49, 0.0, 0.0), 1e-7));
  QCOMPARE(last->time_ms, 8489u + 1u);
  // A Patriot has two sensors.
  Emulation emulation;
  emulation.tcp_port = 0;
  emulation.replay = table;
  FT_VERIFY_MATCH(holdsAll(makePatriotEmulator(emulation).error().message, {"sensor 7", "Patriot", "0 to 1"}));
  emulation.replay.reset();
  emulation.sensors = 3;
  FT_VERIFY_MATCH(holdsAll(makePatriotEmulator(emulation).error().message, {"1 to 2", "3"}));
  FT_VERIFY_OK(makeLibertyEmulator(emulation));
}

FIELDTRUE_TEST(LibertyEmulatorTest)
#include "liberty_emulator_test.moc"
