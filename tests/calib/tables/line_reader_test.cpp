#include "calib/tables/line_reader.h"

#include <QTest>
#include <sstream>
#include <vector>

#include "calib/tables/table_io.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

/// Lines of a text, and that none of them may be endless.
class LineReaderTest : public QObject {
  Q_OBJECT
 private slots:
  void readsLines_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QList<QByteArray>>("lines");
    QTest::addColumn<bool>("has_newline");
    using Lines = QList<QByteArray>;
    QTest::newRow("nothing") << QByteArray() << Lines{} << true;
    QTest::newRow("one blank line") << QByteArray("\n") << Lines{""} << true;
    QTest::newRow("two") << QByteArray("a\nb\n") << Lines{"a", "b"} << true;
    QTest::newRow("no end") << QByteArray("a\n\nb") << Lines{"a", "", "b"} << false;
    QTest::newRow("CRLF") << QByteArray("a\r\n\r\nb\r\n") << Lines{"a", "", "b"} << true;
    QTest::newRow("byte-order mark") << QByteArray(
                                            "\xEF\xBB\xBF"
                                            "a\n\xEF\xBB\xBF"
                                            "b\n")
                                     << Lines{"a",
                                              "\xEF\xBB\xBF"
                                              "b"}
                                     << true;
    const QByteArray longest(static_cast<qsizetype>(kLongestLine), 'x');
    QTest::newRow("longest") << longest + "\nb\n" << Lines{longest, "b"} << true;
    QTest::newRow("longest, no end") << longest << Lines{longest} << false;
    QTest::newRow("longest, mark and CRLF") << "\xEF\xBB\xBF" + longest + "\r\nb" << Lines{longest, "b"} << false;
  }
  void readsLines() {
    QFETCH(QByteArray, text);
    QFETCH(QList<QByteArray>, lines);
    QFETCH(bool, has_newline);
    std::istringstream in(text.toStdString());
    LineReader reader(in, "a.csv");
    QList<QByteArray> seen;
    for (std::string line;;) {
      const auto more = reader.next(line);
      FT_VERIFY_OK(more);
      if (!*more) break;
      seen.append(QByteArray::fromStdString(line));
      QCOMPARE(reader.number(), static_cast<int>(seen.size()));
    }
    QVERIFY(seen == lines);
    if (!lines.isEmpty()) QCOMPARE(reader.hasNewline(), has_newline);
  }

  void refusesALongerLine_data() {
    QTest::addColumn<QByteArray>("tail");
    QTest::addColumn<int>("excess");
    for (const int excess : {1, 2, 10, 1000000}) {
      QTest::addRow("%d, more follows", excess) << QByteArray("\nb\n") << excess;
      QTest::addRow("%d, CRLF", excess) << QByteArray("\r\nb\n") << excess;
      QTest::addRow("%d, the end", excess) << QByteArray() << excess;
    }
  }
  void refusesALongerLine() {
    QFETCH(QByteArray, tail);
    QFETCH(int, excess);
    std::istringstream in("a\n" + std::string(kLongestLine + static_cast<std::size_t>(excess), 'x') +
                          tail.toStdString());
    LineReader reader(in, "a.csv");
    std::string line;
    FT_VERIFY_OK(reader.next(line));
    const auto more = reader.next(line);
    QVERIFY(!more);
    QCOMPARE(more.error().code, ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(more.error().message, {"a.csv, line 2", QByteArray::number(kLongestLine)}));
  }

  void tablesRefuseIt_data() {
    QTest::addColumn<QByteArray>("text");
    const QByteArray longer(static_cast<qsizetype>(kLongestLine) + 1, '1');
    const QByteArray header = "node,t_s,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n";
    QTest::newRow("header") << longer;
    QTest::newRow("comment") << "# " + longer + "\n" + header + "0,0,0,0,0,0,0,0\n";
    QTest::newRow("row") << header + "0,0,0,0,0,0,0," + longer + "\n";
    QTest::newRow("quoted") << header + "0,0,0,0,0,0,0,\"" + longer + "\"\n";
  }
  void tablesRefuseIt() {
    QFETCH(QByteArray, text);
    std::istringstream nodes_in(text.toStdString()), samples_in(text.toStdString());
    const auto nodes = readNodeTable(nodes_in, "a.csv");
    QVERIFY(!nodes);
    FT_VERIFY_MATCH(holdsAll(nodes.error().message, {"a.csv, line ", "longer than", QByteArray::number(kLongestLine)}));
    const auto samples = readSampleTable(samples_in, "a.csv");
    QVERIFY(!samples);
    QCOMPARE(samples.error().message, nodes.error().message);
  }
};

FIELDTRUE_TEST(LineReaderTest)
#include "line_reader_test.moc"
