#include "acquisition/emulators/ndi_emulator.h"

#include <QTest>

#include "calib/core/units.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

std::vector<Pose> toolPoses(int tools) {
  std::vector<Pose> poses;
  for (int n = 1; n <= tools; ++n) {
    poses.push_back(
        {{0.254 * n, -0.127, 0.0635 * n}, rotationFromEuler(Eigen::Vector3d(30.0 * n, 10.0, -20.0) * kRadPerDeg)});
  }
  return poses;
}

NdiEmulatorCore standingNdi(int tools, const NdiEmulatorOptions& options = {}) {
  return NdiEmulatorCore(std::make_unique<StandingSource>(toolPoses(tools), options.rate_hz), options);
}

std::string raw(NdiEmulatorCore& core, const std::string& said, double time_s = 0.0) {
  std::vector<EmulatedOutput> out;
  core.receive(said, time_s, out);
  std::string all;
  for (const auto& piece : out) all += piece.bytes;
  return all;
}

/// The text of its reply to a command.
std::string told(NdiEmulatorCore& core, const std::string& name, const std::string& arguments = {},
                 double time_s = 0.0) {
  const auto reply = findNdiReply(raw(core, ndiCommand(name, arguments), time_s));
  return reply ? reply->text : "nothing";
}

/// Two wired tools, tracking.
NdiEmulatorCore trackingNdi(int tools, const NdiEmulatorOptions& options = {}) {
  auto core = standingNdi(tools, options);
  told(core, "INIT");
  for (int handle = 0x0A; handle < 0x0A + tools; ++handle) {
    told(core, "PINIT", ndiHex(static_cast<unsigned>(handle), 2));
    told(core, "PENA", ndiHex(static_cast<unsigned>(handle), 2) + "D");
  }
  FT_CHECK(told(core, "TSTART", "80") == "OKAY");
  return core;
}

NdiEmulatorOptions spoiled(const char* fault) {
  NdiEmulatorOptions options;
  options.faults = *parseFaults(fault, "ndi");
  return options;
}

NdiFrame textFrame(NdiEmulatorCore& core, double time_s) {
  const auto frame = decodeNdiTx(told(core, "TX", "0001", time_s));
  FT_CHECK(frame.has_value());
  return *frame;
}

}  // namespace

class NdiEmulatorTest : public QObject {
  Q_OBJECT
 private slots:
  void takesWhatNdicapiSends();
  void commandsWithoutCrc();
  void refuses_data();
  void refuses();
  void bothFormsSayTheSame();
  void framesCountAtItsRate();
  void wirelessToolNeedsItsDefinition();
  void resetIsSilentAndForgets();
  void oldFirmwareHasNoBx();
  void recordingIsItsOwnClock();
  void faultsOfItsOwn();
};

void NdiEmulatorTest::takesWhatNdicapiSends() {
  auto core = standingNdi(2);
  QCOMPARE(raw(core, "INIT:E3A5\r"), std::string("OKAYA896\r"));
  // Its probe wants 84 characters at least.
  const std::string version = raw(core, "GETINFO:Features.Firmware.Version0492\r");
  QVERIFY(version.size() >= 84);
  QCOMPARE(version,
           std::string("Features.Firmware.Version=007.000.012;3;1;0;12;;Current firmware revision number99A8\r"));
  QVERIFY(told(core, "VER", "0").find("Aurora") != std::string::npos);
  QCOMPARE(raw(core, "COMM:500000048\r"), std::string("OKAYA896\r"));
  QCOMPARE(core.baud(), 115200);
  QCOMPARE(told(core, "PHSR", "02"), std::string("020A0010B001"));
  for (const char* handle : {"0A", "0B"}) QCOMPARE(told(core, "PINIT", handle), std::string("OKAY"));
  QCOMPARE(told(core, "PHSR", "02"), std::string("00"));
  QCOMPARE(told(core, "PHSR", "03"), std::string("020A0110B011"));
  for (const char* handle : {"0A", "0B"}) {
    const std::string information = told(core, "PHINF", std::string(handle) + "0001");
    QCOMPARE(information.size(), std::size_t{33});
    QCOMPARE(told(core, "PHINF", std::string(handle) + "0025").size(), std::size_t{33 + 20 + 14});
    QCOMPARE(told(core, "PENA", std::string(handle) + "D"), std::string("OKAY"));
  }
  QCOMPARE(told(core, "PHSR", "04"), std::string("020A0310B031"));
  QCOMPARE(told(core, "TSTART", ""), std::string("OKAY"));
  QVERIFY(core.tracking());
  // The quaternion that ndicapi read of this pose.
  const NdiFrame frame = textFrame(core, 1.0);
  QCOMPARE(frame.tools.size(), std::size_t{2});
  const Reading reading = ndiReading(frame.tools[0], 0, 40.0, {2.0, true});
  FT_VERIFY_MATCH(near(reading.sample.tracker_from_sensor,
                       {{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)}, 6e-6,
                       3e-4));
  QCOMPARE(told(core, "TSTOP", "", 2.0), std::string("OKAY"));
  QVERIFY(!core.tracking());
}

void NdiEmulatorTest::commandsWithoutCrc() {
  auto core = standingNdi(1);
  QCOMPARE(raw(core, "INIT \r"), std::string("OKAYA896\r"));
  QCOMPARE(raw(core, "BEEP 1\r"), std::string("OKAYA896\r"));
  QCOMPARE(raw(core, "PHSR 02\r"), encodeNdiReply("010A001"));
  // Cut anywhere, and several in one write.
  QVERIFY(raw(core, "INIT:E3").empty());
  QCOMPARE(raw(core, "A5\rINIT:E3A5\r"), std::string("OKAYA896\rOKAYA896\r"));
}

void NdiEmulatorTest::refuses_data() {
  QTest::addColumn<QByteArray>("command");
  QTest::addColumn<QByteArray>("reply");
  const auto row = [](const std::string& command, const char* reply) {
    QTest::newRow(command.c_str()) << QByteArray::fromStdString(command) << QByteArray(reply);
  };
  row("INIT:E3A6\r", "ERROR04");
  row("HELLO \r", "ERROR01");
  row("BX2 --6d=tools\r", "ERROR01");
  row("PHSR 02\r", "ERROR10");
  row("TSTART \r", "ERROR10");
  row("TX 0001\r", "ERROR0C");
  row("INIT \rPENA 0AD\r", "ERROR0E");
  row("INIT \rPENA 0AX\r", "ERROR09");
  row("INIT \rPINIT 0F\r", "ERROR2B");
  row("INIT \rPHRQ *********1****\rPINIT 0B\r", "ERROR13");
  row("COMM 90000\r", "ERROR06");
  row("PVWR 0A0000\r", "ERROR03");
}

void NdiEmulatorTest::refuses() {
  QFETCH(QByteArray, command);
  QFETCH(QByteArray, reply);
  auto core = standingNdi(1);
  const std::string all = raw(core, command.toStdString());
  QVERIFY2(QByteArray::fromStdString(all).endsWith(QByteArray::fromStdString(encodeNdiReply(reply.toStdString()))),
           all.c_str());
}

void NdiEmulatorTest::bothFormsSayTheSame() {
  auto core = trackingNdi(2);
  const NdiFrame text = textFrame(core, 1.0);
  const auto binary = decodeNdiBx(raw(core, ndiCommand("BX", "0001"), 1.0));
  QVERIFY(binary.has_value());
  for (std::size_t i = 0; i < 2; ++i) {
    QCOMPARE(text.tools[i].frame, binary->tools[i].frame);
    QCOMPARE(text.tools[i].handle, binary->tools[i].handle);
    QCOMPARE(text.tools[i].port_status, 0x31u);
    FT_VERIFY_MATCH(near(binary->tools[i].position_mm, toolPoses(2)[i].position_m * 1e3, 1e-4));
    FT_VERIFY_MATCH(near(text.tools[i].position_mm, binary->tools[i].position_mm, 0.00501));
    FT_VERIFY_MATCH(near(text.tools[i].error_mm, binary->tools[i].error_mm, 5.1e-5));
  }
}

void NdiEmulatorTest::framesCountAtItsRate() {
  NdiEmulatorOptions polaris;
  polaris.rate_hz = kNdiPolarisRate_hz;
  for (const auto& options : {NdiEmulatorOptions{}, polaris}) {
    auto core = trackingNdi(1, options);
    QCOMPARE(textFrame(core, 0.001).tools[0].frame, std::uint32_t{0});
    const double late_s = 100.0 + 0.5 / options.rate_hz;
    QCOMPARE(textFrame(core, late_s).tools[0].frame, static_cast<std::uint32_t>(100.0 * options.rate_hz));
    // Asked twice in a frame, it says the same frame twice.
    QCOMPARE(textFrame(core, late_s + 0.001).tools[0].frame, static_cast<std::uint32_t>(100.0 * options.rate_hz));
  }
}

void NdiEmulatorTest::wirelessToolNeedsItsDefinition() {
  NdiEmulatorOptions options;
  options.wireless = 1;
  auto core = standingNdi(2, options);
  told(core, "INIT");
  QCOMPARE(told(core, "PHSR", "02"), std::string("010A001"));
  QCOMPARE(told(core, "PHRQ", "*********1****"), std::string("0B"));
  QCOMPARE(told(core, "PHSR", "02"), std::string("010A001"));
  std::string rom = "NDI";
  rom.resize(752, '\x5A');
  for (const std::string& command : ndiWriteRom(0x0B, rom)) QCOMPARE(raw(core, command), std::string("OKAYA896\r"));
  QCOMPARE(core.definition(0x0B).substr(0, rom.size()), rom);
  QCOMPARE(told(core, "PHSR", "02"), std::string("020A0010B001"));
  for (const char* handle : {"0A", "0B"}) {
    QCOMPARE(told(core, "PINIT", handle), std::string("OKAY"));
    QCOMPARE(told(core, "PENA", std::string(handle) + "D"), std::string("OKAY"));
  }
  told(core, "TSTART", "80");
  const NdiFrame frame = textFrame(core, 1.0);
  FT_VERIFY_MATCH(near(frame.tools[1].position_mm, toolPoses(2)[1].position_m * 1e3, 0.01));
}

void NdiEmulatorTest::resetIsSilentAndForgets() {
  auto core = trackingNdi(1);
  told(core, "TSTOP", "", 1.0);
  QCOMPARE(raw(core, ndiCommand("RESET", "0"), 1.0), std::string("RESETBE6F\r"));
  QVERIFY(raw(core, "INIT:E3A5\r", 10.9).empty());
  QCOMPARE(raw(core, "INIT:E3A5\r", 11.1), std::string("OKAYA896\r"));
  QCOMPARE(told(core, "PHSR", "02", 11.1), std::string("010A001"));
}

void NdiEmulatorTest::oldFirmwareHasNoBx() {
  NdiEmulatorOptions options;
  options.knows_bx = false;
  auto core = trackingNdi(1, options);
  QCOMPARE(told(core, "BX", "0001", 1.0), std::string("ERROR01"));
  QCOMPARE(textFrame(core, 1.0).tools.size(), std::size_t{1});
}

void NdiEmulatorTest::recordingIsItsOwnClock() {
  SampleTable table;
  for (int i = 0; i < 80; ++i) {
    const Sample sample{5.0 + i / 40.0, i % 2, {{0.001 * i, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, ""};
    table.rows.push_back({-1, 0, sample});
  }
  NdiEmulatorCore core(std::make_unique<ReplaySource>(table));
  told(core, "INIT");
  for (const char* handle : {"0A", "0B"}) {
    told(core, "PINIT", handle);
    told(core, "PENA", std::string(handle) + "D");
  }
  told(core, "TSTART", "80", 2.0);
  const NdiFrame frame = textFrame(core, 2.0 + 41.5 / 40.0);
  QCOMPARE(frame.tools[0].frame, std::uint32_t{40});
  QCOMPARE(frame.tools[1].frame, std::uint32_t{41});
  FT_VERIFY_MATCH(near(frame.tools[0].position_mm.x(), 40.0, 1e-9));
  FT_VERIFY_MATCH(near(frame.tools[1].position_mm.x(), 41.0, 1e-9));
}

void NdiEmulatorTest::faultsOfItsOwn() {
  auto missing = trackingNdi(1, spoiled("missing"));
  QVERIFY(textFrame(missing, 2.5).tools[0].state == NdiState::kValid);
  QVERIFY(textFrame(missing, 3.5).tools[0].state == NdiState::kMissing);
  auto outside = trackingNdi(1, spoiled("out_of_volume"));
  QCOMPARE(textFrame(outside, 2.5).tools[0].port_status & ndi_port::kOutOfVolume, 0u);
  const NdiTool out = textFrame(outside, 3.5).tools[0];
  QVERIFY((out.port_status & ndi_port::kOutOfVolume) != 0);
  QVERIFY((out.position_mm - toolPoses(1)[0].position_m * 1e3).norm() > 50.0);
  auto unplugged = trackingNdi(2, spoiled("tool_unplugged"));
  QVERIFY(textFrame(unplugged, 2.9).tools[1].state == NdiState::kValid);
  const NdiFrame gone = textFrame(unplugged, 3.1);
  QVERIFY(gone.tools[0].state == NdiState::kValid);
  QVERIFY(gone.tools[1].state == NdiState::kUnoccupied);
  QCOMPARE(gone.system_status, 0x80u);
  auto damaged = trackingNdi(1, spoiled("wrong_crc"));
  int wrong = 0;
  for (int i = 0; i < 200; ++i) wrong += told(damaged, "TX", "0001", 1.0 + 0.03 * i) == "nothing" ? 1 : 0;
  QCOMPARE(wrong, 20);
  auto far = trackingNdi(1, spoiled("error_status"));
  FT_VERIFY_MATCH(near(textFrame(far, 3.5).tools[0].error_mm, 9.9, 1e-9));
  QVERIFY(trackingNdi(1).streaming() == false);
}

FIELDTRUE_TEST(NdiEmulatorTest)
#include "ndi_emulator_test.moc"
