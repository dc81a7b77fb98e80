#include <Eigen/Dense>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/comparison.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

CalibrationTable readCondition(const std::string& condition) {
  const importers::Importer& importer = *importers::findImporter("anser").value();
  const Settings settings = resolveSettings("anser", importer.settings, {{"condition", condition}}).value();
  return importer.read(*realData("anser_duplo/nodes.csv"), std::nullopt, settings).value().table.value();
}

double rms(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

double gain(const std::vector<double>& before, const std::vector<double>& after) {
  return 1.0 - rms(after) / rms(before);
}

/// 95 % point of Student's t, by Simpson's rule over its density and bisection.
double studentPoint95(double degrees) {
  const double scale =
      std::exp(std::lgamma(0.5 * (degrees + 1.0)) - std::lgamma(0.5 * degrees)) / std::sqrt(degrees * std::acos(-1.0));
  const auto aboveMedian = [&](double x) {
    constexpr int kSteps = 2000;
    double sum = 0.0;
    for (int i = 0; i <= kSteps; ++i) {
      const double at = x * i / kSteps;
      const double weight = i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
      sum += weight * scale * std::pow(1.0 + at * at / degrees, -0.5 * (degrees + 1.0));
    }
    return sum * x / (3.0 * kSteps);
  };
  double low = 0.0, high = 50.0;
  for (int i = 0; i < 60; ++i) (aboveMedian(0.5 * (low + high)) < 0.45 ? low : high) = 0.5 * (low + high);
  return low;
}

/// Low end of the gain's 90 % interval as the guide states it, by bisection.
double lowGain(const std::vector<double>& before, const std::vector<double>& after, const FitFreedom& freedom) {
  const auto n = static_cast<double>(before.size());
  const auto variance = [&](double of_after, double of_before, double mean) {
    double squares = 0.0;
    for (std::size_t i = 0; i < before.size(); ++i)
      squares += std::pow(of_after * after[i] * after[i] - of_before * before[i] * before[i] - mean, 2);
    return squares / (n - 1.0);
  };
  const double a_mean = std::pow(rms(after), 2), b_mean = std::pow(rms(before), 2);
  const double n_free = std::max(1.0, n * (1.0 - freedom.coefficients_a_place));
  const double reach = 1.75 * (freedom.is_tuned ? 1.3 : 1.0) * studentPoint95(n_free - 1.0);
  const double most = a_mean / b_mean * std::exp(reach * std::sqrt(variance(1.0 / a_mean, 1.0 / b_mean, 0.0) / n_free));
  double low = a_mean / b_mean, high = 1e4 * low;
  for (int i = 0; i < 200; ++i) {
    const double ratio = 0.5 * (low + high);
    const double mean = a_mean - ratio * b_mean;
    (-mean <= reach * std::sqrt(variance(1.0, ratio, mean) / n_free) ? low : high) = ratio;
  }
  return 1.0 - std::sqrt(std::min(low, most));
}

/// The rule of application, computed by itself from held-out errors.
bool ruleSaysApply(const std::vector<double>& before, const std::vector<double>& after, const FitFreedom& freedom) {
  std::vector<double> lowest_before;
  std::vector<double> lowest_after;
  double lowest = HUGE_VAL;
  for (std::size_t out = 0; out < before.size(); ++out) {
    std::vector<double> b = before;
    std::vector<double> a = after;
    b.erase(b.begin() + static_cast<std::ptrdiff_t>(out));
    a.erase(a.begin() + static_cast<std::ptrdiff_t>(out));
    if (gain(b, a) >= lowest) continue;
    lowest = gain(b, a);
    lowest_before = b;
    lowest_after = a;
  }
  const double low_with = lowGain(before, after, freedom);
  const double low_without = lowGain(lowest_before, lowest_after, freedom);
  if (gain(before, after) < 0.10 || lowest < 0.10) return false;
  return low_with > 0.0 && low_without > 0.0;
}

}  // namespace

/// Six real recordings of 41 hand-placed points on a flat board (Anser EMT, data/README.md).
class AnserComparisonTest : public QObject {
  Q_OBJECT
 private slots:
  void conditions_data() {
    QTest::addColumn<QByteArray>("condition");
    QTest::addColumn<double>("in_sample_mm");
    QTest::addColumn<double>("leave_one_out_mm");
    QTest::newRow("standard") << QByteArray("standard_data_grid") << 2.26 << 2.34;
    QTest::newRow("interpolate") << QByteArray("interpolate_data_grid") << 2.08 << 2.16;
    QTest::newRow("probe_calibrate") << QByteArray("interpolate_data_grid_probe_calibrate") << 2.40 << 2.50;
    QTest::newRow("finer_points") << QByteArray("finer_mesh_points") << 4.53 << 4.72;
    QTest::newRow("finer_3axis") << QByteArray("finer_mesh_3axis") << 2.46 << 2.57;
    QTest::newRow("steel_shield") << QByteArray("steel_shield") << 5.21 << 5.39;
  }
  void conditions() {
    FT_REQUIRE_REAL_DATA();
    QFETCH(QByteArray, condition);
    QFETCH(double, in_sample_mm);
    QFETCH(double, leave_one_out_mm);
    const CalibrationTable table = readCondition(condition.toStdString());
    QCOMPARE(table.nodes.size(), std::size_t{41});
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata,
                                                       calibration::parseCorrectorChoice("none", "none").value(),
                                                       calibration::AlignMode::kRigid);
    FT_VERIFY_OK(corrector);
    FT_VERIFY_MATCH(near(corrector->report().rms_before_mm, in_sample_mm, 0.01));
    FT_VERIFY_MATCH(near(1000.0 * corrector->report().rms_m, in_sample_mm, 0.01));

    ComparisonOptions one_by_one;
    one_by_one.position_methods = {{"none", {}}, {"rigid", {}}};
    one_by_one.orientation_methods = {{"none", {}}};  // Tuned ones would ask for folds.
    one_by_one.with_surroundings = false;
    const auto baselines = compareMethods(table, one_by_one);
    FT_VERIFY_OK(baselines);
    QCOMPARE(baselines->align, calibration::AlignMode::kRigid);
    FT_VERIFY_MATCH(near(baselines->before_position_mm.rms, leave_one_out_mm, 0.01));
    FT_VERIFY_MATCH(near(baselines->position.front().stats.rms, leave_one_out_mm, 0.01));
    FT_VERIFY_MATCH(near(baselines->position.front().in_sample_rms, in_sample_mm, 0.01));
    // A rigid fit after the rigid alignment has nothing left to do.
    FT_VERIFY_MATCH(near(baselines->position.back().stats.rms, baselines->before_position_mm.rms, 1e-6));

    const auto comparison = compareMethods(table, {});
    FT_VERIFY_OK(comparison);
    QCOMPARE(toText(comparison->validation), std::string("kfold:10"));
    QCOMPARE(comparison->validation_places, 41);
    double least_mm = comparison->before_position_mm.rms, auto_mm = 0.0;
    for (const MethodScore& score : comparison->position) {
      if (score.method == "auto") auto_mm = score.stats.rms;
      if (!score.skipped) least_mm = std::min(least_mm, score.stats.rms);
    }
    QVERIFY2(auto_mm > 0.0 && auto_mm <= 1.15 * least_mm,
             qPrintable(QString("auto %1 mm, least %2 mm").arg(auto_mm).arg(least_mm)));
    const auto best = comparison->best_position_row;
    if (best) {
      const MethodScore& score = comparison->position[*best];
      for (const MethodScore& other : comparison->position)
        QVERIFY(other.skipped || other.stats.rms >= score.stats.rms - 1e-6);
      QCOMPARE(comparison->verdict.apply_position,
               ruleSaysApply(comparison->before_place_mm, score.place_errors, score.freedom));
    } else {
      QVERIFY(!comparison->verdict.apply_position);
    }
    qInfo("%s", comparison->verdict.text.c_str());
  }

  void theBoardIsSeenToBeFlat() {
    FT_REQUIRE_REAL_DATA();
    const CalibrationTable table = readCondition("steel_shield");
    const auto comparison = compareMethods(table, {});
    FT_VERIFY_OK(comparison);
    FT_VERIFY_MATCH(holdsAll(comparison->notes.front(), {"one plane", "nothing is claimed off it"}));
    for (const MethodScore& score : comparison->position) {
      if (score.method == "none" || score.skipped) continue;
      QVERIFY(!score.notes.empty());
      FT_VERIFY_MATCH(holdsAll(score.notes.front(), {"one plane"}));
    }
    for (const std::string method : {"affine", "polynomial:degree=2", "hmq"}) {
      const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata,
                                                         calibration::parseCorrectorChoice(method, "none").value(),
                                                         calibration::AlignMode::kRigid);
      FT_VERIFY_OK(corrector);
      const Eigen::Vector3d p_m = table.nodes[12].tracker_from_sensor.position_m;
      QVERIFY(corrector->covers(p_m));
      // The board is level in the tracker frame to a few degrees: 50 mm above and below nothing was measured.
      QVERIFY(!corrector->covers(p_m + Eigen::Vector3d(0, 0, 0.05)));
      QVERIFY(!corrector->covers(p_m - Eigen::Vector3d(0, 0, 0.05)));
    }
  }

  void aPlanarPolynomialGainsLittle() {
    FT_REQUIRE_REAL_DATA();
    // data/README.md: second degree in the plane gains at most 12 % and worsens three of the six; one more is within 1
    // %.
    int n_worse = 0;
    for (const char* condition :
         {"standard_data_grid", "interpolate_data_grid", "interpolate_data_grid_probe_calibrate", "finer_mesh_points",
          "finer_mesh_3axis", "steel_shield"}) {
      ComparisonOptions options;
      options.position_methods = {{"polynomial", {{"degree", "2"}}}};
      const auto comparison = compareMethods(readCondition(condition), options);
      FT_VERIFY_OK(comparison);
      const double gained = gain(comparison->before_place_mm, comparison->position.front().place_errors);
      QVERIFY2(gained < 0.125, condition);
      n_worse += gained < 0.0;
    }
    QVERIFY(n_worse == 3 || n_worse == 4);
  }
};

FIELDTRUE_TEST(AnserComparisonTest)
#include "anser_comparison_test.moc"
