#include "acquisition/emulators/isotrak_emulator.h"

#include <QTest>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

constexpr double kDegree_rad = 0.017453292519943295;

/// Station n of the exchange with VRPN stands at (0.254 n, -0.127, 0.0635 n) m, az el roll (30 n, 10, -20) deg.
std::vector<Pose> standingAt(int stations) {
  std::vector<Pose> poses;
  for (int n = 1; n <= stations; ++n) {
    poses.push_back(
        {{0.254 * n, -0.127, 0.0635 * n}, rotationFromEuler(Eigen::Vector3d(30.0 * n, 10.0, -20.0) * kDegree_rad)});
  }
  return poses;
}

IsotrakEmulator isotrakAt(std::vector<Pose> poses) {
  return IsotrakEmulator(std::make_unique<StandingSource>(std::move(poses), kIsotrakRate_hz));
}

std::string saidBy(IsotrakEmulator& unit, std::string_view bytes, double time_s = 0.0) {
  std::vector<EmulatedOutput> out;
  unit.receive(bytes, time_s, out);
  std::string all;
  for (const auto& piece : out) all += piece.bytes;
  return all;
}

std::vector<EmulatedOutput> isotrakSentUntil(IsotrakEmulator& unit, double time_s) {
  std::vector<EmulatedOutput> out;
  while (unit.tick(time_s, out)) {
  }
  return out;
}

}  // namespace

class IsotrakEmulatorTest : public QObject {
  Q_OBJECT
 private slots:
  void takesWhatVrpnSends();
  void powerUpState();
  void stationsShareTheRate_data();
  void stationsShareTheRate();
  void oneListForBothStations();
  void tellsItsStations();
  void hemisphereMirrors();
  void positionsComeInSteps();
  void resetIsSilentAndForgets();
  void refuses_data();
  void refuses();
  void whatCannotBeEmulated();
};

void IsotrakEmulatorTest::takesWhatVrpnSends() {
  IsotrakEmulator unit = isotrakAt(standingAt(1));
  QCOMPARE(saidBy(unit, "c", 2.0), std::string());
  const std::string status = saidBy(unit, "S", 4.0);
  QCOMPARE(status.size(), std::size_t{21});
  QCOMPARE(status.front(), '2');
  QCOMPARE(status.back(), '\n');
  QCOMPARE(saidBy(unit, "O2,11\rx0.2,0.2,0.8,0.8\rv0.2,0.2,0.8,0.8\rR1\rb1\rufC", 6.0), std::string());
  const auto out = isotrakSentUntil(unit, 6.0);
  QCOMPARE(out.size(), std::size_t{1});
  // As VRPN reads it: 20 bytes, bit 7 in the first alone; words low byte first, the highest bits in the eighth byte.
  const std::string& record = out[0].bytes;
  QCOMPARE(record.size(), std::size_t{20});
  for (std::size_t i = 0; i < record.size(); ++i) {
    QCOMPARE((static_cast<unsigned char>(record[i]) & 0x80u) != 0, i == 0);
  }
  QCOMPARE(record[1], '1');
  const unsigned x = static_cast<unsigned>(record[3]) + ((record[7] & 0x08) != 0 ? 128u : 0u) +
                     256u * static_cast<unsigned>(record[4]);
  FT_VERIFY_MATCH(near(x * 1.6632 / 32767.0, 0.254, 0.5 * 1.6632 / 32767.0));
}

void IsotrakEmulatorTest::powerUpState() {
  IsotrakEmulator unit = isotrakAt(standingAt(2));
  QVERIFY(!unit.streaming());
  QCOMPARE(saidBy(unit, "P"), std::string("01   10.00  -5.00   2.50  30.00  10.00 -20.00\r\n"
                                          "02   20.00  -5.00   5.00  60.00  10.00 -20.00\r\n"));
}

void IsotrakEmulatorTest::stationsShareTheRate_data() {
  QTest::addColumn<int>("stations");
  QTest::newRow("one") << 1;
  QTest::newRow("two") << 2;
}

void IsotrakEmulatorTest::stationsShareTheRate() {
  QFETCH(int, stations);
  IsotrakEmulator unit = isotrakAt(standingAt(stations));
  saidBy(unit, "fC", 5.0);
  // 60 records a second in all, in the order of the stations.
  const auto out = isotrakSentUntil(unit, 6.999);
  QCOMPARE(out.size(), std::size_t{120});
  for (std::size_t i = 0; i < out.size(); ++i) {
    QCOMPARE(static_cast<int>(out[i].bytes[1]) - '0', static_cast<int>(i) % stations + 1);
    QVERIFY(out[i].record);
  }
}

void IsotrakEmulatorTest::oneListForBothStations() {
  IsotrakEmulator unit = isotrakAt(standingAt(2));
  QCOMPARE(saidBy(unit, "O2,11,1\rO\r"), std::string("21O 211 1\r\n"));
  QCOMPARE(unit.outputList(1), (std::vector{2, 11, 1}));
  QCOMPARE(unit.outputList(2), (std::vector{2, 11, 1}));
  QCOMPARE(saidBy(unit, "P").size(), std::size_t{2 * (3 + 21 + 28 + 2)});
}

void IsotrakEmulatorTest::tellsItsStations() {
  IsotrakEmulator both = isotrakAt(standingAt(2)), one = isotrakAt(standingAt(1));
  QCOMPARE(saidBy(both, "l1\r"), std::string("21l11\r\n"));
  QCOMPARE(saidBy(both, "l2,0\rl1\r"), std::string("21l10\r\n"));
  QCOMPARE(saidBy(one, "l2,1\rl1\r"), std::string("21l10\r\n"));
}

void IsotrakEmulatorTest::hemisphereMirrors() {
  IsotrakEmulator unit = isotrakAt({{{-0.3, 0.1, 0.2}, Eigen::Quaterniond::Identity()}});
  const auto place_m = [&unit] {
    return *decodeIsotrakRecord(saidBy(unit, "fO2,11\rP"), std::vector{2, 11})->position_m;
  };
  FT_VERIFY_MATCH(near(place_m(), Eigen::Vector3d(0.3, -0.1, -0.2), 3e-5));
  saidBy(unit, "H1,-1,0,0\r");
  FT_VERIFY_MATCH(near(place_m(), Eigen::Vector3d(-0.3, 0.1, 0.2), 3e-5));
}

void IsotrakEmulatorTest::positionsComeInSteps() {
  constexpr double kStep_m = 1.6632 / 32767.0;
  for (int i = 0; i < 20; ++i) {
    IsotrakEmulator unit = isotrakAt({{{0.3 + 1e-5 * i, 0.0, 0.0}, Eigen::Quaterniond::Identity()}});
    const auto record = decodeIsotrakRecord(saidBy(unit, "fO2,11\rP"), std::vector{2, 11});
    const double steps = record->position_m->x() / kStep_m;
    FT_VERIFY_MATCH(near(steps, std::round(steps), 1e-9));
    FT_VERIFY_MATCH(near(record->position_m->x(), 0.3 + 1e-5 * i, 0.5001 * kStep_m));
  }
}

void IsotrakEmulatorTest::resetIsSilentAndForgets() {
  IsotrakEmulator unit = isotrakAt(standingAt(1));
  saidBy(unit, "fuO2,11\rC", 1.0);
  QVERIFY(saidBy(unit, "\x19S", 2.0).empty());
  QVERIFY(isotrakSentUntil(unit, 11.9).empty());
  QCOMPARE(saidBy(unit, "S", 12.1).size(), std::size_t{21});
  QVERIFY(!unit.streaming());
  QCOMPARE(unit.outputList(1), (std::vector{2, 4, 1}));
}

void IsotrakEmulatorTest::refuses_data() {
  QTest::addColumn<QByteArray>("command");
  QTest::addColumn<int>("code");
  QTest::newRow("a Fastrak's compensation") << QByteArray("d\r") << -99;
  QTest::newRow("a Fastrak's identification") << QByteArray("XLab\r") << -99;
  QTest::newRow("station 3") << QByteArray("l3,1\r") << -3;
  QTest::newRow("an item without a binary form") << QByteArray("O2,5\r") << -3;
  QTest::newRow("a list that is none") << QByteArray("O2,x\r") << -2;
}

void IsotrakEmulatorTest::refuses() {
  QFETCH(QByteArray, command);
  QFETCH(int, code);
  IsotrakEmulator unit = isotrakAt(standingAt(1));
  const auto refusal = findRefusal(saidBy(unit, command.toStdString()));
  QVERIFY(refusal.has_value());
  QCOMPARE(refusal->code, code);
  QCOMPARE(unit.outputList(1), (std::vector{2, 4, 1}));
}

void IsotrakEmulatorTest::whatCannotBeEmulated() {
  Emulation emulation;
  emulation.tcp_port = 0;
  emulation.sensors = 3;
  FT_VERIFY_MATCH(holdsAll(makeIsotrakEmulator(emulation).error().message, {"Isotrak II", "1 to 2", "3"}));
  emulation.sensors = 2;
  FT_VERIFY_OK(makeIsotrakEmulator(emulation));
}

FIELDTRUE_TEST(IsotrakEmulatorTest)
#include "isotrak_emulator_test.moc"
