#include "acquisition/protocols/plain_number.h"

#include <QTest>
#include <clocale>
#include <cstdio>
#include <cstdlib>

#include "tests/support/test_main.h"

namespace fieldtrue::acquisition {

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
    ::setenv("LOCPATH", FIELDTRUE_COMMA_LOCALES, 1);
    if (!std::setlocale(LC_NUMERIC, "de_DE.UTF-8")) QSKIP("there is no German locale: install the package locales");
    char with_comma[8];
    std::snprintf(with_comma, sizeof with_comma, "%.2f", 1.5);
    const std::string fixed = fixedText(1.5, 2);
    const std::string exponent = exponentText(-0.00123, 5);
    std::setlocale(LC_NUMERIC, "C");
    QCOMPARE(std::string(with_comma), std::string("1,50"));
    QCOMPARE(fixed, std::string("1.50"));
    QCOMPARE(exponent, std::string("-1.23000E-03"));
  }
};

}  // namespace fieldtrue::acquisition

FIELDTRUE_TEST(fieldtrue::acquisition::PlainNumberTest)
#include "plain_number_test.moc"
