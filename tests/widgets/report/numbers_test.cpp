#include "widgets/report/numbers.h"

#include <QTest>
#include <cmath>
#include <limits>

#include "calib/core/number_text.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;

class NumbersTest : public QObject {
  Q_OBJECT
 private slots:
  void significantDigits_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<int>("digits");
    QTest::addColumn<QString>("text");
    QTest::newRow("zero") << 0.0 << 3 << "0";
    QTest::newRow("trailing zero kept") << 3.2 << 3 << "3.20";
    QTest::newRow("small") << 0.0123456 << 3 << "0.0123";
    QTest::newRow("tiny without exponent") << 1.5e-7 << 3 << "0.000000150";
    QTest::newRow("hundreds") << 123.456 << 3 << "123";
    QTest::newRow("large rounds to its digits") << 1236.0 << 3 << "1240";
    QTest::newRow("rounding adds a digit before the point") << 9.996 << 3 << "10.0";
    QTest::newRow("rounding to one") << 0.9996 << 3 << "1.00";
    QTest::newRow("negative") << -41.26 << 3 << "-41.3";
    QTest::newRow("one digit") << 0.055 << 1 << "0.06";
    QTest::newRow("nan") << std::nan("") << 3 << "n/a";
    QTest::newRow("infinity") << std::numeric_limits<double>::infinity() << 3 << "n/a";
  }

  void significantDigits() {
    QFETCH(double, value);
    QFETCH(int, digits);
    QCOMPARE(QString::fromStdString(significantText(value, digits)), expectedText());
  }

  void errorsAreNeverRoundingNoise() {
    QCOMPARE(errorFigure(2.65e-13), std::string("<0.001"));
    QCOMPARE(errorFigure(0.0), std::string("0"));
    QCOMPARE(errorFigure(0.00104), std::string("0.00104"));
    QCOMPARE(errorFigure(41.26), std::string("41.3"));
  }

  void decimals_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<int>("count");
    QTest::addColumn<QString>("text");
    QTest::newRow("rounds") << 1.2346 << 3 << "1.235";
    QTest::newRow("no minus zero") << -0.0004 << 3 << "0.000";
    QTest::newRow("no decimals") << 12.6 << 0 << "13";
    QTest::newRow("nan") << std::nan("") << 2 << "n/a";
  }

  void decimals() {
    QFETCH(double, value);
    QFETCH(int, count);
    QCOMPARE(QString::fromStdString(fixedText(value, count)), expectedText());
  }

  void durations_data() {
    QTest::addColumn<double>("seconds");
    QTest::addColumn<QString>("text");
    QTest::newRow("ns") << 280e-9 << "280 ns";
    QTest::newRow("us") << 3.1e-6 << "3.10 us";
    QTest::newRow("ms") << 0.012 << "12.0 ms";
    QTest::newRow("s") << 2.4 << "2.40 s";
  }

  void durations() {
    QFETCH(double, seconds);
    QCOMPARE(QString::fromStdString(durationText(seconds)), expectedText());
  }

 private:
  static QString expectedText() {
    QFETCH(QString, text);
    return text;
  }
};

FIELDTRUE_TEST(NumbersTest)
#include "numbers_test.moc"
