#include "acquisition/protocols/openigtlink_parser.h"

#include <QTest>
#include <random>

#include "tests/acquisition/protocols/openigtlink_bytes.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// Of message number n: x is n mm.
Pose numberedPose(int n) {
  return {{n * 0.001, -0.127, 0.0635}, Eigen::Quaterniond(0.943714, -0.189308, 0.038135, 0.268536).normalized()};
}

std::string messageNumber(int n, bool states_crc = true) {
  const Pose pose = numberedPose(n);
  std::string message = encodeIgtl("TRANSFORM", "Probe", igtlStampOf(1.7e9 + n), encodeTransformBody(pose));
  if (!states_crc) std::fill_n(message.begin() + 50, 8, '\0');
  return message;
}

std::string stream(int first, int count, bool states_crc = true) {
  std::string all;
  for (int n = first; n < first + count; ++n) all += messageNumber(n, states_crc);
  return all;
}

/// The numbers of the messages that came, by x; each must be whole.
std::vector<int> numbersOf(const std::vector<IgtlMessage>& messages) {
  std::vector<int> numbers;
  for (const IgtlMessage& message : messages) {
    const auto readings = readingsOf(message.header, message.body);
    FT_CHECK(readings && readings->size() == 1 && readings->front().status.empty());
    const Pose& pose = readings->front().tracker_from_sensor;
    numbers.push_back(static_cast<int>(std::lround(pose.position_m.x() * 1000.0)));
    FT_CHECK(near(pose, numberedPose(numbers.back()), 1e-6, 1e-6).ok);
  }
  return numbers;
}

std::vector<int> parsed(const std::vector<std::string>& pieces) {
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  for (const std::string& piece : pieces) parser.add(piece, messages);
  return numbersOf(messages);
}

}  // namespace

class OpenigtlinkParserTest : public QObject {
  Q_OBJECT
 private slots:
  void handMadeBytes();
  void cutAtEveryOffset();
  void byteByByte();
  void garbageFirst();
  void everyLostByteEverywhere();
  void everyChangedByteEverywhere();
  void neverBelievesNoise();
  void wrongCrc();
  void withoutCrcOneMessageLate();
  void withoutCrcNothingIsInvented();
  void otherTypesArePassedOver();
  void largeImagesAreNotKept();
  void absurdLengths();
};

void OpenigtlinkParserTest::handMadeBytes() {
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  parser.add(kIgtlTransform + kIgtlTransform, messages);
  QCOMPARE(messages.size(), std::size_t{2});
  QCOMPARE(messages[0].header.device, std::string("Probe"));
  QCOMPARE(messages[0].body, kIgtlQuarterTurn);
  QCOMPARE(parser.dropped_bytes(), std::uint64_t{0});
}

void OpenigtlinkParserTest::cutAtEveryOffset() {
  const std::string all = stream(1, 3);
  for (std::size_t cut = 0; cut <= all.size(); ++cut) {
    QCOMPARE(parsed({all.substr(0, cut), all.substr(cut)}), (std::vector{1, 2, 3}));
  }
}

void OpenigtlinkParserTest::byteByByte() {
  std::vector<std::string> pieces;
  for (const char c : stream(1, 5)) pieces.emplace_back(1, c);
  QCOMPARE(parsed(pieces), (std::vector{1, 2, 3, 4, 5}));
}

void OpenigtlinkParserTest::garbageFirst() {
  std::mt19937 random(5);
  for (std::size_t length = 1; length <= 200; ++length) {
    std::string garbage(length, '\0');
    for (char& c : garbage) c = static_cast<char>(random());
    QCOMPARE(parsed({garbage + stream(1, 3)}), (std::vector{1, 2, 3}));
    // The rest of a message that began before anybody listened.
    QCOMPARE(parsed({messageNumber(9).substr(std::min<std::size_t>(length, 105)) + stream(1, 3)}),
             (std::vector{1, 2, 3}));
  }
}

void OpenigtlinkParserTest::everyLostByteEverywhere() {
  const std::string one = messageNumber(2);
  for (std::size_t lost = 0; lost < one.size(); ++lost) {
    std::string cut = one;
    cut.erase(lost, 1);
    const auto numbers = parsed({messageNumber(1) + cut + messageNumber(3) + messageNumber(4)});
    // Bodies end and messages begin with a zero: where the last is lost, the next message's serves.
    QVERIFY2(numbers == (std::vector{1, 3, 4}) || (lost + 2 >= one.size() && numbers == (std::vector{1, 2, 4})),
             qPrintable(QString::number(lost)));
  }
}

void OpenigtlinkParserTest::everyChangedByteEverywhere() {
  // The body and its CRC are protected; what names the message is not, but it cannot change a pose.
  const std::string one = messageNumber(2);
  for (std::size_t changed = 42; changed < one.size(); ++changed) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string wrong = one;
      wrong[changed] = static_cast<char>(wrong[changed] ^ 1 << bit);
      const auto numbers = parsed({messageNumber(1) + wrong + stream(3, 60)});
      QVERIFY(std::find(numbers.begin(), numbers.end(), 2) == numbers.end());
      QCOMPARE(numbers.front(), 1);
      QVERIFY2(numbers.back() == 62 || changed < 50, "a changed length may swallow what follows, nothing else");
    }
  }
}

void OpenigtlinkParserTest::neverBelievesNoise() {
  std::mt19937_64 random(11);
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  for (int i = 0; i < 2000; ++i) {
    std::string noise(512, '\0');
    for (char& c : noise) c = static_cast<char>(random() & 0xFF);
    parser.add(noise, messages);
  }
  QVERIFY(messages.empty());
  QVERIFY(parser.dropped_bytes() > 1000000);
}

void OpenigtlinkParserTest::wrongCrc() {
  std::string wrong = messageNumber(2);
  wrong.back() = static_cast<char>(wrong.back() ^ 1);
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  parser.add(messageNumber(1) + wrong + messageNumber(3), messages);
  QCOMPARE(numbersOf(messages), (std::vector{1, 3}));
  QCOMPARE(parser.wrong_crcs(), std::uint64_t{1});
  QCOMPARE(parser.dropped_bytes(), std::uint64_t{wrong.size()});
}

void OpenigtlinkParserTest::withoutCrcOneMessageLate() {
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  parser.add(messageNumber(1, false), messages);
  QVERIFY(messages.empty());
  parser.add(messageNumber(2, false), messages);
  QCOMPARE(numbersOf(messages), std::vector{1});
}

void OpenigtlinkParserTest::withoutCrcNothingIsInvented() {
  const std::string one = messageNumber(2, false);
  for (std::size_t lost = 0; lost < one.size(); ++lost) {
    std::string cut = one;
    cut.erase(lost, 1);
    const auto numbers = parsed({messageNumber(1, false) + cut + stream(3, 4, false)});
    // The poses are right (numbersOf looks); without its first zero, the one that ends the message before serves.
    QVERIFY2(numbers == (std::vector{1, 3, 4, 5}) || numbers == (std::vector{3, 4, 5}) ||
                 (lost == 0 && numbers == (std::vector{2, 3, 4, 5})),
             qPrintable(QString::number(lost)));
  }
}

void OpenigtlinkParserTest::otherTypesArePassedOver() {
  const std::string image = encodeIgtl("IMAGE", "Camera", 0, std::string(5000, '\1'));
  const std::string all = image + messageNumber(1) + encodeIgtl("NEWTYPE", "", 0, "") + messageNumber(2) + image;
  for (std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{1000}, all.size()}) {
    IgtlParser parser;
    std::vector<IgtlMessage> messages;
    for (std::size_t at = 0; at < all.size(); at += piece) parser.add(all.substr(at, piece), messages);
    QCOMPARE(numbersOf(messages), (std::vector{1, 2}));
    QCOMPARE(parser.passedOver().at("IMAGE"), std::uint64_t{2});
    QCOMPARE(parser.passedOver().at("NEWTYPE"), std::uint64_t{1});
    QCOMPARE(parser.dropped_bytes(), std::uint64_t{0});
  }
}

void OpenigtlinkParserTest::largeImagesAreNotKept() {
  // 3 GiB announced; what follows is its body until then, and no memory is taken for it.
  std::string header = encodeIgtl("IMAGE", "Camera", 0, "");
  header[46] = static_cast<char>(0xC0);
  IgtlParser parser;
  std::vector<IgtlMessage> messages;
  parser.add(header, messages);
  const std::string block(1 << 20, '\1');
  for (int i = 0; i < 3 * 1024; ++i) parser.add(block, messages);
  parser.add(messageNumber(1), messages);
  QCOMPARE(numbersOf(messages), std::vector{1});
}

void OpenigtlinkParserTest::absurdLengths() {
  // A pose of 3 GiB is none: its header is dropped, and what follows is read.
  std::string header = messageNumber(1);
  header[46] = static_cast<char>(0xC0);
  QCOMPARE(parsed({header + stream(2, 2)}), (std::vector{2, 3}));
}

FIELDTRUE_TEST(OpenigtlinkParserTest)
#include "openigtlink_parser_test.moc"
