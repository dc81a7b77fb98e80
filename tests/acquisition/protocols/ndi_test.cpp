#include "acquisition/protocols/ndi.h"

#include <QTest>
#include <random>

#include "acquisition/protocols/sample_status.h"
#include "calib/core/units.h"
#include "tests/acquisition/protocols/fastrak_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// Handle 0A at (254, -127, 63.5) mm with error 0.12 mm, handle 0B missing, frame 100; IEEE-754 and CRCs written out by
/// another program.
constexpr std::string_view kBxReply =
    "<C4A5 3700 3B23 02 0A01 3E97713F F5D941BE 72331C3D 8D7D893E 00007E43 0000FEC2 00007E42 8FC2F53D 31000000 64000000 "
    "0B02 31000000 64000000 0000 68B1>";
constexpr std::string_view kTxText =
    "020A+09437-01893+00381+02685+025400-012700+006350+001200000003100000064\n0BMISSING0000003100000064\n0000";
const Pose kToolPose{{0.254, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536)};

NdiStreamSettings streamOf(bool binary) {
  NdiStreamSettings settings;
  settings.binary = binary;
  settings.sensors = {{0x0A, 0}, {0x0B, 1}};
  settings.frame_hz = kNdiAuroraRate_hz;
  settings.gate = {2.0, true};
  return settings;
}

/// Replies of the frames first, first + 1, ... with handle 0A at x = frame mm.
std::string replies(bool binary, unsigned first, int n) {
  std::string all;
  for (unsigned frame = first; frame < first + static_cast<unsigned>(n); ++frame) {
    NdiTool tool;
    tool.handle = 0x0A;
    tool.state = NdiState::kValid;
    tool.quaternion_wxyz = {1.0, 0.0, 0.0, 0.0};
    tool.position_mm = {static_cast<double>(frame), -127.0, 63.5};
    tool.error_mm = 0.12;
    tool.port_status = 0x31;
    tool.frame = frame;
    const NdiFrame whole{{tool}, 0};
    all += binary ? encodeNdiBx(whole) : encodeNdiReply(encodeNdiTx(whole));
  }
  return all;
}

std::vector<int> framesOf(const std::vector<Reading>& readings) {
  std::vector<int> frames;
  for (const Reading& reading : readings) {
    frames.push_back(static_cast<int>(std::lround(reading.sample.tracker_from_sensor.position_m.x() * 1e3)));
  }
  return frames;
}

std::vector<Reading> parsed(NdiParser& parser, const std::vector<std::string>& pieces) {
  std::vector<Reading> readings;
  for (const std::string& piece : pieces) parser.add(piece, readings);
  return readings;
}

std::string statusOf(const NdiTool& tool, const NdiGate& gate = {2.0, true}) {
  return ndiReading(tool, 0, 40.0, gate).sample.status;
}

}  // namespace

class NdiTest : public QObject {
  Q_OBJECT
 private slots:
  void crcs_data();
  void crcs();
  void commandsByHand();
  void repliesByHand();
  void handlesByHand();
  void toolInformationByHand();
  void rates();
  void textByHand();
  void textStates();
  void badText_data();
  void badText();
  void binaryByHand();
  void binaryStates();
  void badBinary();
  void gates();
  void forms_data();
  void unpluggedIsToldOnce_data() { forms_data(); }
  void unpluggedIsToldOnce();
  void cutAtEveryOffset_data() { forms_data(); }
  void cutAtEveryOffset();
  void byteByByte_data() { forms_data(); }
  void byteByByte();
  void garbageFirst_data() { forms_data(); }
  void garbageFirst();
  void everyChangedBit_data() { forms_data(); }
  void everyChangedBit();
  void everyLostByte_data() { forms_data(); }
  void everyLostByte();
  void neverBelievesNoise_data() { forms_data(); }
  void neverBelievesNoise();
  void sameFrameIsNoReading_data() { forms_data(); }
  void sameFrameIsNoReading();
  void errorsAreAnswers_data() { forms_data(); }
  void errorsAreAnswers();
  void romChunks();
  void meanings();
};

void NdiTest::crcs_data() {
  QTest::addColumn<QByteArray>("text");
  QTest::addColumn<QByteArray>("crc");
  // From the wire and from the documents of others; the last two are an exchange with a Polaris Vicra.
  for (const auto& [text, crc] :
       {std::pair{"INIT:", "E3A5"},
        {"OKAY", "A896"},
        {"RESET", "BE6F"},
        {"VER:0", "65EE"},
        {"TSTART:", "5423"},
        {"TSTART:80", "1B0B"},
        {"TX:0001", "031A"},
        {"PHSR:02", "E17E"},
        {"COMM:50000", "0048"},
        {"BEEP:1", "8404"},
        {"GETINFO:Features.Firmware.Version", "0492"},
        {"Features.Firmware.Version=007.000.012;3;1;0;12;;Current firmware revision number", "99A8"}}) {
    QTest::newRow(text) << QByteArray(text) << QByteArray(crc);
  }
}

void NdiTest::crcs() {
  QFETCH(QByteArray, text);
  QFETCH(QByteArray, crc);
  QCOMPARE(QByteArray::fromStdString(ndiHex(ndiCrc(text.toStdString()), 4)), crc);
}

void NdiTest::commandsByHand() {
  QCOMPARE(ndiCommand("INIT"), std::string("INIT:E3A5\r"));
  QCOMPARE(ndiCommand("COMM", "50000"), std::string("COMM:500000048\r"));
  QCOMPARE(ndiCommand("TX", "0001"), std::string("TX:0001031A\r"));
}

void NdiTest::repliesByHand() {
  QVERIFY(findNdiReply("OKAYA896\r")->isOkay());
  QCOMPARE(findNdiReply("RESETBE6F\r")->text, std::string("RESET"));
  QVERIFY(!findNdiReply("OKAYA896"));
  QVERIFY(!findNdiReply("OKAYA897\r"));
  QVERIFY(!findNdiReply("\r"));
  // What was left on the line is passed over.
  QVERIFY(findNdiReply("\x01xyz\rKAYA896\rOKAYA896\r")->isOkay());
  const auto error = findNdiReply(encodeNdiReply("ERROR13"));
  QCOMPARE(error->error, std::optional(0x13));
  QVERIFY(!error->isOkay());
  QVERIFY(!findNdiReply("OKAYA896\r")->error);
}

void NdiTest::handlesByHand() {
  const auto handles = decodeNdiHandles("020A0010B031");
  QCOMPARE(handles->size(), std::size_t{2});
  QCOMPARE((*handles)[0].handle, 0x0A);
  QCOMPARE((*handles)[0].status, 0x001u);
  QCOMPARE((*handles)[1].handle, 0x0B);
  QCOMPARE((*handles)[1].status, 0x031u);
  QCOMPARE(encodeNdiHandles(*handles), std::string("020A0010B031"));
  QCOMPARE(decodeNdiHandles("00")->size(), std::size_t{0});
  for (const char* bad : {"", "0", "01", "010A00", "010A0010", "0G", "OKAY"}) QVERIFY2(!decodeNdiHandles(bad), bad);
}

void NdiTest::toolInformationByHand() {
  const auto tool = decodeNdiToolInformation(
      "02000000NDI         00134801401"
      "31");
  QCOMPARE(tool->type, std::string("02000000"));
  QCOMPARE(tool->manufacturer, std::string("NDI"));
  QCOMPARE(tool->revision, std::string("001"));
  QCOMPARE(tool->serial, std::string("34801401"));
  QCOMPARE(tool->status, 0x31u);
  QCOMPARE(encodeNdiToolInformation(*tool).size(), std::size_t{33});
  QVERIFY(!decodeNdiToolInformation("UNOCCUPIED"));
}

void NdiTest::rates() {
  for (const auto& [digit, baud] : {std::pair{'0', 9600},
                                    {'1', 14400},
                                    {'2', 19200},
                                    {'3', 38400},
                                    {'4', 57600},
                                    {'5', 115200},
                                    {'6', 921600},
                                    {'7', 1228739},
                                    {'A', 230400}}) {
    QCOMPARE(*ndiRateDigit(baud), digit);
    QCOMPARE(ndiRateOfDigit(digit), baud);
  }
  QVERIFY(!ndiRateDigit(4800));
  QCOMPARE(ndiRateOfDigit('9'), 0);
}

void NdiTest::textByHand() {
  const auto frame = decodeNdiTx(kTxText);
  QVERIFY(frame.has_value());
  QCOMPARE(frame->tools.size(), std::size_t{2});
  const NdiTool& seen = frame->tools[0];
  QCOMPARE(seen.handle, 0x0A);
  QVERIFY(seen.state == NdiState::kValid);
  FT_VERIFY_MATCH(near(seen.position_mm, Eigen::Vector3d(254.0, -127.0, 63.5), 1e-9));
  FT_VERIFY_MATCH(near(seen.error_mm, 0.012, 1e-9));
  QCOMPARE(seen.port_status, 0x31u);
  QCOMPARE(seen.frame, std::uint32_t{100});
  QVERIFY(frame->tools[1].state == NdiState::kMissing);
  QCOMPARE(frame->tools[1].frame, std::uint32_t{100});
  QCOMPARE(encodeNdiTx(*frame), std::string(kTxText));
  const Reading reading = ndiReading(seen, 3, 40.0, {2.0, true});
  QCOMPARE(reading.sample.sensor, 3);
  QCOMPARE(reading.sample.status, std::string());
  QCOMPARE(*reading.unit_s, 2.5);
  FT_VERIFY_MATCH(near(reading.sample.tracker_from_sensor, kToolPose, 1e-9, 2e-4));
}

void NdiTest::textStates() {
  const auto frame =
      decodeNdiTx("040AUNOCCUPIED\n0BDISABLED0000001100000064\n0CDISABLED\n0DMISSING00000031000000C8\n0081");
  QVERIFY(frame.has_value());
  QVERIFY(frame->tools[0].state == NdiState::kUnoccupied);
  QVERIFY(frame->tools[1].state == NdiState::kDisabled);
  QVERIFY(frame->tools[2].state == NdiState::kDisabled);
  QVERIFY(frame->tools[3].state == NdiState::kMissing);
  QCOMPARE(frame->tools[3].frame, std::uint32_t{200});
  QCOMPARE(frame->system_status, 0x81u);
  // Too far for seven columns: a tool that cannot be told is MISSING.
  NdiTool far;
  far.state = NdiState::kValid;
  far.quaternion_wxyz = {1.0, 0.0, 0.0, 0.0};
  far.position_mm = {12345.6, 0.0, 0.0};
  QVERIFY(encodeNdiTx({{far}, 0}).find("MISSING") != std::string::npos);
}

void NdiTest::badText_data() {
  QTest::addColumn<QByteArray>("text");
  for (const char* text : {"", "0", "01", "010A", "010AMISSING00000031\n0000", "010AMISSING0000003100000064\n",
                           "010AMISSING0000003100000064\n00000", "010AMISSING00000031000000640000",
                           "010A+09437-01893+00381 02685+025400-012700+006350+001200000003100000064\n0000",
                           "010A+09437-01893+00381+026X5+025400-012700+006350+001200000003100000064\n0000", "OKAY",
                           "020AMISSING0000003100000064\n0000"}) {
    QTest::newRow(text) << QByteArray(text);
  }
}

void NdiTest::badText() {
  QFETCH(QByteArray, text);
  QVERIFY(!decodeNdiTx(text.toStdString()));
}

void NdiTest::binaryByHand() {
  const std::string reply = bytes(kBxReply);
  QCOMPARE(*ndiBxLength(reply), reply.size());
  const auto frame = decodeNdiBx(reply);
  QVERIFY(frame.has_value());
  QCOMPARE(frame->tools.size(), std::size_t{2});
  FT_VERIFY_MATCH(near(frame->tools[0].error_mm, 0.12, 1e-7));
  QCOMPARE(frame->tools[0].port_status, 0x31u);
  QCOMPARE(frame->tools[1].frame, std::uint32_t{100});
  QVERIFY(frame->tools[1].state == NdiState::kMissing);
  const Reading reading = ndiReading(frame->tools[0], 0, 40.0, {2.0, true});
  FT_VERIFY_MATCH(near(reading.sample.tracker_from_sensor, kToolPose, 1e-7, 2e-6));
  QCOMPARE(encodeNdiBx(*frame), reply);
}

void NdiTest::binaryStates() {
  NdiTool disabled;
  disabled.handle = 3;
  disabled.state = NdiState::kDisabled;
  const auto frame = decodeNdiBx(encodeNdiBx({{disabled, disabled}, 0x80}));
  QCOMPARE(frame->tools.size(), std::size_t{2});
  QVERIFY(frame->tools[1].state == NdiState::kDisabled);
  QCOMPARE(frame->system_status, 0x80u);
}

void NdiTest::badBinary() {
  const std::string reply = bytes(kBxReply);
  for (std::size_t i = 0; i < reply.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string wrong = reply;
      wrong[i] = static_cast<char>(wrong[i] ^ (1 << bit));
      QVERIFY(!decodeNdiBx(wrong));
    }
  }
  QVERIFY(!decodeNdiBx(reply.substr(0, reply.size() - 1)));
  QVERIFY(!decodeNdiBx(reply + "x"));
}

void NdiTest::gates() {
  NdiTool tool = decodeNdiTx(kTxText)->tools[0];
  QCOMPARE(statusOf(tool), std::string());
  tool.error_mm = 2.01;
  QCOMPARE(statusOf(tool), std::string(kStatusErrorValue));
  QCOMPARE(statusOf(tool, {0.0, true}), std::string());
  tool.error_mm = std::nan("");
  QCOMPARE(statusOf(tool), std::string(kStatusErrorValue));
  tool.error_mm = 0.1;
  tool.port_status |= ndi_port::kOutOfVolume;
  QCOMPARE(statusOf(tool), std::string(kStatusOutOfVolume));
  QCOMPARE(statusOf(tool, {2.0, false}), std::string());
  tool.port_status = 0x31 | ndi_port::kPartlyOutOfVolume;
  QCOMPARE(statusOf(tool), std::string(kStatusPartlyOutOfVolume));
  // Bits above the eighth say nothing that counts: clients disagree on them.
  tool.port_status = 0xFFFFFF31u;
  QCOMPARE(statusOf(tool), std::string());
  // No pose, no number that could be taken for one.
  tool.state = NdiState::kMissing;
  const Reading missing = ndiReading(tool, 0, 40.0, {2.0, true});
  QCOMPARE(missing.sample.status, std::string(kStatusMissing));
  FT_VERIFY_MATCH(near(missing.sample.tracker_from_sensor, Pose{}, 0.0, 0.0));
  tool.state = NdiState::kUnoccupied;
  QCOMPARE(statusOf(tool), std::string(kStatusUnplugged));
  QVERIFY(!ndiReading(tool, 0, 40.0, {}).unit_s);
  tool.state = NdiState::kValid;
  tool.port_status = 0x31;
  tool.quaternion_wxyz *= 0.9;
  QCOMPARE(statusOf(tool), std::string(kStatusDamaged));
}

void NdiTest::forms_data() {
  QTest::addColumn<bool>("binary");
  QTest::newRow("BX") << true;
  QTest::newRow("TX") << false;
}

void NdiTest::unpluggedIsToldOnce() {
  QFETCH(bool, binary);
  const NdiStreamSettings settings = streamOf(binary);
  NdiParser parser(settings);
  NdiTool there, gone;
  there.handle = gone.handle = settings.sensors.begin()->first;
  gone.state = NdiState::kUnoccupied;
  const auto readingsOf = [&](const NdiTool& tool) {
    return parsed(parser, {binary ? encodeNdiBx({{tool}, 0}) : encodeNdiReply(encodeNdiTx({{tool}, 0}))});
  };
  for (there.frame = 7; there.frame < 9; ++there.frame) {
    QCOMPARE(readingsOf(there).size(), std::size_t{1});
    const std::vector<Reading> first = readingsOf(gone);
    QCOMPARE(first.size(), std::size_t{1});
    QCOMPARE(first[0].sample.status, std::string(kStatusUnplugged));
    QVERIFY(readingsOf(gone).empty() && readingsOf(gone).empty());
  }
}

void NdiTest::cutAtEveryOffset() {
  QFETCH(bool, binary);
  const std::string all = replies(binary, 1, 4);
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    NdiParser parser(streamOf(binary));
    QCOMPARE(framesOf(parsed(parser, {all.substr(0, cut), all.substr(cut)})), (std::vector{1, 2, 3, 4}));
    QCOMPARE(parser.answers(), std::uint64_t{4});
    QCOMPARE(parser.dropped_bytes(), std::uint64_t{0});
  }
}

void NdiTest::byteByByte() {
  QFETCH(bool, binary);
  std::vector<std::string> pieces;
  for (const char c : replies(binary, 1, 5)) pieces.emplace_back(1, c);
  NdiParser parser(streamOf(binary));
  QCOMPARE(framesOf(parsed(parser, pieces)), (std::vector{1, 2, 3, 4, 5}));
}

void NdiTest::garbageFirst() {
  QFETCH(bool, binary);
  std::mt19937 random(3);
  for (std::size_t length = 1; length < 120; ++length) {
    std::string garbage(length, '\0');
    for (char& c : garbage) c = static_cast<char>(random() & 0xFF);
    NdiParser parser(streamOf(binary));
    const auto frames = framesOf(parsed(parser, {garbage + replies(binary, 1, 4)}));
    // A line of text that begins with garbage is lost with it.
    const bool lost = !binary && garbage.back() != '\r';
    QCOMPARE(frames, lost ? (std::vector{2, 3, 4}) : (std::vector{1, 2, 3, 4}));
  }
}

void NdiTest::everyChangedBit() {
  QFETCH(bool, binary);
  const std::string good = replies(binary, 1, 4);
  const std::size_t length = good.size() / 4;
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string all = good;
      all[at] = static_cast<char>(all[at] ^ (1 << bit));
      NdiParser parser(streamOf(binary));
      const auto frames = framesOf(parsed(parser, {all + replies(binary, 5, 3)}));
      QVERIFY(std::is_sorted(frames.begin(), frames.end()));
      // The damaged one is lost, and a neighbour where the end of a line or a length was changed.
      QVERIFY(frames.size() >= 5 && frames.size() <= 6);
      const int damaged = static_cast<int>(at / length) + 1;
      QVERIFY(std::find(frames.begin(), frames.end(), damaged) == frames.end());
    }
  }
}

void NdiTest::everyLostByte() {
  QFETCH(bool, binary);
  const std::string good = replies(binary, 1, 4);
  const std::size_t length = good.size() / 4;
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string all = good;
    all.erase(at, 1);
    NdiParser parser(streamOf(binary));
    const auto frames = framesOf(parsed(parser, {all + replies(binary, 5, 3)}));
    QVERIFY(std::is_sorted(frames.begin(), frames.end()));
    QVERIFY(frames.size() >= 5 && frames.size() <= 6);
    QVERIFY(std::find(frames.begin(), frames.end(), static_cast<int>(at / length) + 1) == frames.end());
  }
}

void NdiTest::neverBelievesNoise() {
  QFETCH(bool, binary);
  std::mt19937 random(5);
  std::string noise(200000, '\0');
  for (char& c : noise) c = static_cast<char>(random() & 0xFF);
  NdiParser parser(streamOf(binary));
  QVERIFY(parsed(parser, {noise, std::string(5000, '\xFF'), std::string(5000, '0')}).empty());
}

void NdiTest::sameFrameIsNoReading() {
  QFETCH(bool, binary);
  NdiParser parser(streamOf(binary));
  const std::string all = replies(binary, 1, 1) + replies(binary, 1, 1) + replies(binary, 2, 1) + replies(binary, 2, 1);
  QCOMPARE(framesOf(parsed(parser, {all})), (std::vector{1, 2}));
  QCOMPARE(parser.answers(), std::uint64_t{4});
}

void NdiTest::errorsAreAnswers() {
  QFETCH(bool, binary);
  NdiParser parser(streamOf(binary));
  QVERIFY(parsed(parser, {encodeNdiReply("ERROR0C")}).empty());
  QCOMPARE(parser.answers(), std::uint64_t{1});
  QCOMPARE(framesOf(parsed(parser, {replies(binary, 1, 2)})), (std::vector{1, 2}));
  // Tools that were not asked for are passed over.
  NdiStreamSettings settings = streamOf(binary);
  settings.sensors = {{0x0C, 0}};
  NdiParser other(settings);
  QVERIFY(parsed(other, {replies(binary, 1, 2)}).empty());
  QCOMPARE(other.answers(), std::uint64_t{2});
}

void NdiTest::romChunks() {
  std::string rom;
  for (int i = 0; i < 130; ++i) rom += static_cast<char>(i);
  const auto commands = ndiWriteRom(0x0B, rom);
  QCOMPARE(commands.size(), std::size_t{3});
  QCOMPARE(commands[0].substr(0, 15), std::string("PVWR:0B00000001"));
  QCOMPARE(commands[1].substr(0, 15), std::string("PVWR:0B00404041"));
  QCOMPARE(commands[2].substr(0, 17), std::string("PVWR:0B0080808100"));
  for (const std::string& command : commands) {
    QCOMPARE(command.size(), std::size_t{5 + 2 + 4 + 128 + 4 + 1});
    QCOMPARE(command.substr(139, 4), ndiHex(ndiCrc(std::string_view(command).substr(0, 139)), 4));
  }
}

void NdiTest::meanings() {
  FT_VERIFY_MATCH(holdsAll(ndiErrorMeaning(0x13), {"rom=FILE"}));
  FT_VERIFY_MATCH(holdsAll(ndiErrorMeaning(0x99), {"99"}));
  QVERIFY(ndiSystemMeaning(0).empty());
  FT_VERIFY_MATCH(holdsAll(ndiSystemMeaning(0x82), {"interference", "unplugged"}));
  for (const char* status : {kStatusMissing, kStatusUnplugged, kStatusOutOfVolume, kStatusPartlyOutOfVolume,
                             kStatusErrorValue, kStatusDamaged, kStatusFlipped}) {
    QVERIFY2(ndiSampleMeaning(status).size() > 15, status);
  }
}

FIELDTRUE_TEST(NdiTest)
#include "ndi_test.moc"
