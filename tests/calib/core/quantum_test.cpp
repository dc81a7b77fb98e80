#include "calib/core/quantum.h"

#include <QTest>
#include <cmath>
#include <fstream>
#include <random>

#include "calib/core/statistics.h"
#include "calib/tables/csv_reader.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

constexpr double kAscension_m = 36.0 * 0.0254 / 8192.0;

/// Readings of several axes around different places.
std::vector<double> continuous_m(int count, double sd_m, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal(0.0, sd_m);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(0.31 - 0.17 * (i % 3) + normal(engine));
  return values;
}

std::vector<double> rounded(std::vector<double> values, double step) {
  for (double& value : values) value = std::round(value / step) * step;
  return values;
}

}  // namespace

class QuantumTest : public QObject {
  Q_OBJECT

 private slots:
  void findsLattice_data() {
    QTest::addColumn<double>("quantum_m");
    QTest::addColumn<double>("printed_m");
    QTest::addColumn<double>("sd_m");
    QTest::addColumn<int>("count");
    QTest::newRow("exact, moving") << kAscension_m << 0.0 << 0.05 << 300;
    QTest::newRow("exact, still") << kAscension_m << 0.0 << 1e-4 << 180;
    QTest::newRow("printed to 1e-5 mm") << kAscension_m << 1e-8 << 0.01 << 3000;
    QTest::newRow("printed to 1e-5 mm, still") << kAscension_m << 1e-8 << 1e-4 << 180;
    QTest::newRow("printed to 1e-3 mm") << kAscension_m << 1e-6 << 5e-4 << 600;
    QTest::newRow("half a millimetre") << 5e-4 << 0.0 << 0.01 << 100;
    QTest::newRow("hundredth of an inch") << 0.01 * 0.0254 * 2.0 << 0.0 << 0.01 << 200;
    QTest::newRow("fine") << 7.7e-6 << 0.0 << 1e-4 << 200;
  }
  void findsLattice() {
    QFETCH(double, quantum_m);
    QFETCH(double, printed_m);
    QFETCH(double, sd_m);
    QFETCH(int, count);
    for (unsigned seed = 1; seed <= 20; ++seed) {
      std::vector<double> values_m = rounded(continuous_m(count, sd_m, seed), quantum_m);
      if (printed_m > 0.0) values_m = rounded(values_m, printed_m);
      const std::optional<double> found_m = findQuantum_m(values_m);
      QVERIFY2(found_m, QByteArray("nothing found with seed ") + QByteArray::number(seed));
      FT_VERIFY_MATCH(near(*found_m, quantum_m, std::max(1e-9 * quantum_m, 0.1 * printed_m)));
    }
  }

  void inventsNone_data() {
    QTest::addColumn<double>("printed_m");
    QTest::addColumn<double>("sd_m");
    QTest::addColumn<int>("count");
    QTest::newRow("doubles") << 0.0 << 1e-3 << 180;
    QTest::newRow("doubles, many") << 0.0 << 0.1 << 3000;
    QTest::newRow("printed to 1e-5 mm") << 1e-8 << 1e-3 << 180;
    QTest::newRow("printed to 1e-3 mm") << 1e-6 << 1e-4 << 180;
    QTest::newRow("printed to 1e-3 mm, few") << 1e-6 << 1e-2 << 30;
    QTest::newRow("printed to 0.01 mm") << 1e-5 << 5e-4 << 600;
  }
  void inventsNone() {
    QFETCH(double, printed_m);
    QFETCH(double, sd_m);
    QFETCH(int, count);
    for (unsigned seed = 1; seed <= 100; ++seed) {
      std::vector<double> values_m = continuous_m(count, sd_m, seed);
      if (printed_m > 0.0) values_m = rounded(values_m, printed_m);
      const std::optional<double> found_m = findQuantum_m(values_m);
      QVERIFY2(!found_m, QByteArray("invented ") + QByteArray::number(found_m.value_or(0.0)));
    }
  }

  void needsEnoughReadings() {
    QVERIFY(!findQuantum_m(std::vector<double>{}));
    QVERIFY(!findQuantum_m(std::vector<double>{0.1, 0.2, 0.3}));
    QVERIFY(!findQuantum_m(std::vector<double>(100, 0.125)));
  }

  void passesOverMarks() {
    std::vector<double> values_m = rounded(continuous_m(300, 0.01, 1), kAscension_m);
    values_m[7] = -3.7e28;
    values_m[8] = std::nan("");
    const std::optional<double> found_m = findQuantum_m(values_m);
    QVERIFY(found_m);
    FT_VERIFY_MATCH(near(*found_m, kAscension_m, 1e-12));
  }

  void realRecording_data() {
    QTest::addColumn<QByteArray>("body");
    QTest::addColumn<bool>("on_lattice");
    QTest::newRow("stylus") << QByteArray("stylus") << true;
    QTest::newRow("reference") << QByteArray("ref") << true;
    QTest::newRow("computed tip") << QByteArray("tip") << false;
  }
  void realRecording() {
    FT_REQUIRE_REAL_DATA();
    QFETCH(QByteArray, body);
    QFETCH(bool, on_lattice);
    std::ifstream in(*realData("pluslib_fcal/samples.csv"));
    auto reader = CsvReader::open(in, "samples.csv");
    FT_VERIFY_OK(reader);
    std::vector<double> values_m;
    while (reader->next().value()) {
      for (const char* axis : {"_x_mm", "_y_mm", "_z_mm"}) {
        values_m.push_back(1e-3 * reader->number(*reader->find(body.toStdString() + axis)));
      }
    }
    QCOMPARE(values_m.size(), std::size_t{3000});
    const std::optional<double> found_m = findQuantum_m(values_m);
    QCOMPARE(found_m.has_value(), on_lattice);
    if (found_m) FT_VERIFY_MATCH(near(*found_m, kAscension_m, 1e-10));
  }
};

FIELDTRUE_TEST(QuantumTest)
#include "quantum_test.moc"
