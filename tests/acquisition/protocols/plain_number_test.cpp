#include "acquisition/protocols/plain_number.h"

#include <QTest>
#include <clocale>

namespace fieldtrue {

class PlainNumberTest : public QObject {
  Q_OBJECT

 private slots:
  void fixed_data() {
    QTest::addColumn<double>("value");
    QTest::addColumn<int>("decimals");
    QTest::addColumn<int>("width");
    QTest::addColumn<QString>("text");
    QTest::newRow("padded") << 1.5 << 2 << 7 << "   1.50";
    QTest::newRow("negative") << -123.456 << 2 << 7 << "-123.46";
    QTest::newRow("no width") << 0.25 << 4 << 0 << "0.2500";
    QTest::newRow("wider than the column") << 12345.678 << 2 << 7 << "12345.68";
  }
  void fixed() {
    QFETCH(double, value);
    QFETCH(int, decimals);
    QFETCH(int, width);
    QTEST(QString::fromStdString(fixedText(value, decimals, width)), "text");
  }

  void exponent() {
    QCOMPARE(exponentText(123.4567, 5), std::string(" 1.23457E+02"));
    QCOMPARE(exponentText(-0.00123, 5), std::string("-1.23000E-03"));
  }

  void ignoresTheLocale() {
    for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "nl_NL.UTF-8"}) {
      if (!std::setlocale(LC_NUMERIC, name)) continue;
      QCOMPARE(fixedText(1.5, 2), std::string("1.50"));
      std::setlocale(LC_NUMERIC, "C");
      return;
    }
    QSKIP("no locale with a decimal comma is installed here");
  }
};

}  // namespace fieldtrue

QTEST_GUILESS_MAIN(fieldtrue::PlainNumberTest)
#include "plain_number_test.moc"
