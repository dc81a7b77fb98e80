#include "acquisition/protocols/fastrak_commands.h"

#include <QTest>
#include <set>

#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

Q_DECLARE_METATYPE(FastrakCommand)

class FastrakCommandsTest : public QObject {
  Q_OBJECT
 private slots:
  void roundTrip_data();
  void roundTrip();
  void everyLetterIsTried();
  void readsWhateverTheChunks();
  void carriageReturnAloneIsNothing();
  void omittedFieldsStayEmpty();
  void controlCharactersActInsideALine();
  void unknownLettersAreKept();
  void longLinesAreCut();
};

namespace {

struct Example {
  FastrakCommand command;
  const char* bytes;
};

const std::vector<Example>& examples() {
  using namespace fastrak;
  static const std::vector<int> kItems = {2, 11, 16, 1};
  static const std::vector<Example> kExamples = {
      {point(), "P"},
      {continuous(true), "C"},
      {continuous(false), "c"},
      {format(FastrakFormat::kAscii), "F"},
      {format(FastrakFormat::kBinary), "f"},
      {units(FastrakUnit::kInch), "U"},
      {units(FastrakUnit::kCentimetre), "u"},
      {status(), "S"},
      {compensation(true), "D"},
      {compensation(false), "d"},
      {reinitialise(), "\x19"},
      {saveToMemory(), "\x0B"},
      {factoryDefaults(), "W"},
      {pauseOutput(), "\x13"},
      {resumeOutput(), "\x11"},
      {selfTest(), "T"},
      {{'t', {}, {}, {}}, "t"},
      {{'Y', {}, {}, {}}, "Y"},
      {outputList(1, kItems), "O1,2,11,16,1\r"},
      {stationActive(3, true), "l3,1\r"},
      {stationActive(2, false), "l2,0\r"},
      {hemisphere(1, {0, 0, 0}), "H1,0,0,0\r"},
      {hemisphere(4, {0, 0, -1}), "H4,0,0,-1\r"},
      {boresight(2), "B2\r"},
      {unBoresight(2), "b2\r"},
      {boresightReference(1, {10, -20.5, 30}), "G1,10,-20.5,30\r"},
      {alignment(1, {0, 0, 0}, {10, 0, 0}, {0, 10.25, 0}), "A1,0,0,0,10,0,0,0,10.25,0\r"},
      {resetAlignment(1), "R1\r"},
      {transmitterMounting(1, {0, 90, 0}), "r1,0,90,0\r"},
      {tipOffset(1, {2.523, 0.004, -0.018}), "N1,2.523,0.004,-0.018\r"},
      {stylusButton(1, true), "e1,1\r"},
      {stylusButton(1, false), "e1,0\r"},
      {increment(1, 0.0), "I1,0\r"},
      {positionEnvelope(1, {100, 100, 100}, {-100, -50, 0}), "V1,100,100,100,-100,-50,0\r"},
      {angularEnvelope(1, {180, 90, 180}, {-180, -90, -180}), "Q1,180,90,180,-180,-90,-180\r"},
      {attitudeFilter({0.2, 0.2, 0.8, 0.8}), "v0.2,0.2,0.8,0.8\r"},
      {positionFilter({0.2, 0.2, 0.8, 0.95}), "x0.2,0.2,0.8,0.95\r"},
      {attitudeFilterOff(), "v,1\r"},
      {positionFilterOff(), "x,1\r"},
      {attitudeFilterMacro(2), "v2\r"},
      {positionFilterMacro(5), "x5\r"},
      {identification("cellar, unit 2"), "Xcellar, unit 2\r"},
      {lineRate(19200), "o192,N,8,0\r"},
      {lineRate(115200, 'E', 7, true), "o1152,E,7,1\r"},
      {readBack('l', 1), "l1\r"},
      {{'y', {}, {"1"}, {}}, "y1\r"},
  };
  return kExamples;
}

std::vector<FastrakCommand> read(std::string_view bytes) {
  FastrakCommandReader reader;
  std::vector<FastrakCommand> commands;
  reader.add(bytes, commands);
  return commands;
}

}  // namespace

void FastrakCommandsTest::roundTrip_data() {
  QTest::addColumn<int>("index");
  for (std::size_t i = 0; i < examples().size(); ++i) {
    QTest::addRow("%zu %s", i, QByteArray(examples()[i].bytes).toPercentEncoding(" ,.-").constData())
        << static_cast<int>(i);
  }
}

void FastrakCommandsTest::roundTrip() {
  QFETCH(int, index);
  const Example& example = examples()[static_cast<std::size_t>(index)];
  QCOMPARE(encode(example.command), std::string(example.bytes));
  const auto commands = read(example.bytes);
  QCOMPARE(commands.size(), std::size_t{1});
  QVERIFY(commands[0] == example.command);
}

void FastrakCommandsTest::everyLetterIsTried() {
  std::set<char> tried;
  for (const auto& example : examples()) tried.insert(example.command.letter);
  for (const auto& kind : fastrakCommandKinds()) QVERIFY2(tried.contains(kind.letter), kind.meaning);
}

void FastrakCommandsTest::readsWhateverTheChunks() {
  std::string all;
  for (const auto& example : examples()) all += example.bytes;
  const auto whole = read(all);
  QCOMPARE(whole.size(), examples().size());
  FastrakCommandReader reader;
  std::vector<FastrakCommand> pieces;
  for (const char c : all) reader.add({&c, 1}, pieces);
  QVERIFY(pieces == whole);
  for (std::size_t i = 0; i < whole.size(); ++i) QVERIFY(whole[i] == examples()[i].command);
}

void FastrakCommandsTest::carriageReturnAloneIsNothing() {
  QVERIFY(read("\r\r\n\n").empty());
  QCOMPARE(read("O1,2\r\nS").size(), std::size_t{2});
}

void FastrakCommandsTest::omittedFieldsStayEmpty() {
  const auto commands = read("O1,,4\r");
  QCOMPARE(commands[0].station, std::optional(1));
  QCOMPARE(commands[0].fields, (std::vector<std::string>{"", "4"}));
}

void FastrakCommandsTest::controlCharactersActInsideALine() {
  const auto commands = read(
      "O1,2\x19"
      "c");
  QCOMPARE(commands.size(), std::size_t{2});
  QCOMPARE(commands[0].letter, kFastrakReinitialise);
  QCOMPARE(commands[1].letter, 'c');
}

void FastrakCommandsTest::unknownLettersAreKept() {
  const auto commands = read("z12\rS");
  QCOMPARE(commands.size(), std::size_t{2});
  QCOMPARE(commands[0].letter, 'z');
  QCOMPARE(commands[0].text, std::string("12"));
}

void FastrakCommandsTest::longLinesAreCut() {
  const auto commands = read("O" + std::string(400, '1') + "\r");
  QCOMPARE(commands.size(), std::size_t{2});
  QCOMPARE(commands[0].text.size() + 1, std::size_t{256});
}

FIELDTRUE_TEST(FastrakCommandsTest)
#include "fastrak_commands_test.moc"
