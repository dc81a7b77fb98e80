#include <QTest>
#include <atomic>
#include <thread>

#include "calib/calibration/alignment.h"
#include "calib/evaluation/comparison.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// Dense fits ask for their memory before they take it.
using namespace fieldtrue;
using namespace fieldtrue::evaluation;

namespace {

CalibrationTable tableOf(std::array<int, 3> counts) {
  testing::SyntheticOptions options;
  options.counts = counts;
  options.smooth_distortion_m = 0.02;
  testing::SyntheticNoise noise;
  noise.position_sd_m = 0.0005;
  return testing::syntheticTable(options, noise);
}

void setAvailable_mib(int mib) { qputenv("FIELDTRUE_MEMORY_MIB", QByteArray::number(mib)); }

Result<calibration::Corrector> fitted(const CalibrationTable& table, const std::string& position,
                                      const std::string& orientation) {
  const auto choice = calibration::parseCorrectorChoice(position, orientation);
  FT_CHECK(choice.has_value());
  return calibration::Corrector::fit(table.nodes, table.metadata, *choice, calibration::AlignMode::kRigid);
}

RunControl sideBySide() {
  RunControl control;
  control.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    std::atomic<std::size_t> next = 0;
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (std::size_t i = next++; i < count; i = next++) body(i);
      });
  };
  return control;
}

}  // namespace

class FitMemoryTest : public QObject {
  Q_OBJECT
 private slots:
  void cleanup() { qunsetenv("FIELDTRUE_MEMORY_MIB"); }

  void aFitIsRefusedWithBothFigures_data() {
    QTest::addColumn<QString>("position");
    QTest::addColumn<QString>("orientation");
    for (const char* id : {"hmq", "rbf", "gaussian_process", "harmonic_field"})
      QTest::newRow(id) << QString(id) << QString("none");
    QTest::newRow("hmq_matrix") << QString("none") << QString("hmq_matrix");
  }
  void aFitIsRefusedWithBothFigures() {
    QFETCH(QString, position);
    QFETCH(QString, orientation);
    const CalibrationTable table = tableOf({8, 8, 7});
    setAvailable_mib(1);
    const auto refused = fitted(table, position.toStdString(), orientation.toStdString());
    QVERIFY(!refused);
    QVERIFY(refused.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(testing::holdsAll(refused.error().message, {"MiB of memory", "80 % of the 1 MiB"}));
    QVERIFY2(fitted(table, "polynomial", "none").has_value(), "others are not refused");
  }

  void theComparisonSkipsThem() {
    const CalibrationTable table = tableOf({8, 8, 7});
    setAvailable_mib(3);
    ComparisonOptions options;
    options.position_methods = {{"none", {}}, {"polynomial", {}}, {"hmq", {}}, {"rbf", {}}};
    options.orientation_methods = {{"none", {}}};
    options.with_surroundings = false;
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    QVERIFY(!comparison->position[0].skipped && !comparison->position[1].skipped);
    for (const std::size_t i : {2u, 3u}) {
      QVERIFY(comparison->position[i].skipped.has_value());
      FT_VERIFY_MATCH(testing::holdsAll(*comparison->position[i].skipped, {"MiB of memory", "of the 3 MiB"}));
    }
  }

  /// One fit fits, four side by side do not: they wait for each other, and the figures are those of one thread.
  void threadsChangeNothing() {
    const CalibrationTable table = tableOf({6, 6, 5});
    ComparisonOptions options;
    options.position_methods = {{"hmq", {}}, {"hmq", {{"r2_cm2", "100"}}}, {"rbf", {}}};
    options.orientation_methods = {{"none", {}}, {"hmq_matrix", {}}};
    options.validation = Validation{ValidationKind::kFolds, 5};
    options.closed_form = false;
    options.with_surroundings = false;
    const auto free = compareMethods(table, options);
    FT_VERIFY_OK(free);
    setAvailable_mib(3);
    const auto tight = compareMethods(table, options, sideBySide());
    FT_VERIFY_OK(tight);
    for (std::size_t i = 0; i < free->position.size(); ++i) {
      QVERIFY2(!tight->position[i].skipped, tight->position[i].skipped.value_or("").c_str());
      QVERIFY(free->position[i].place_errors == tight->position[i].place_errors);
    }
    QVERIFY(!tight->orientation[1].skipped);
  }
};

FIELDTRUE_TEST(FitMemoryTest)
#include "fit_memory_test.moc"
