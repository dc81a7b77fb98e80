#include <QTest>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/method_text.h"
#include "calib/correctors/registry.h"
#include "calib/evaluation/comparison.h"
#include "calib/tables/true_box.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

/// A turned, bent and noisy grid, with two visits a place, so that folds move the alignment and hold several rows out.
CalibrationTable weightedTable() {
  SyntheticOptions options;
  options.counts = {5, 4, 4};
  options.reference_from_tracker = {{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
  options.smooth_distortion_m = 0.04;
  options.orientations = 2;
  CalibrationTable table = syntheticTable(options, {.seed = 4, .position_sd_m = 0.002, .placing_sd_m = 0.001});
  for (Node& node : table.nodes) {
    node.covariance_m2 = Eigen::Matrix3d(Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal());
    node.sd_rot_rad = 0.001;
  }
  return table;
}

/// The method with every setting that would be chosen from the data given a number instead: chosen anew in every fold,
/// the two ways would not be asked the same question.
MethodText withNumbers(const correctors::PositionMethod& method) {
  const std::map<std::string, std::string> numbers = {{"degree", "3"},
                                                      {"r2_cm2", "100"},
                                                      {"shape_mm", "300"},
                                                      {"smoothing", method.id == "rbf" ? "0" : "0.01"},
                                                      {"spans", "3"}};
  MethodText text{method.id, {}};
  for (const Setting& setting : method.settings)
    if (setting.type == SettingType::kAutoNumber && numbers.contains(setting.key))
      text.given[setting.key] = numbers.at(setting.key);
  if (method.id == "tetrahedral") text.given["split"] = "delaunay";  // Cells of a grid are joined anew in every fold.
  return text;
}

/// This finds its scales from all places whatever its settings, and keeps them while some are held out: the two ways
/// are then near and not the same.
bool keepsScales(const std::string& method) { return method == "gaussian_process"; }

}  // namespace

class ClosedFormTest : public QObject {
  Q_OBJECT
 private slots:
  /// Every method that can leave rows out without fitting anew scores each place as a new fit would.
  void agreesWithFittingAnew_data() {
    QTest::addColumn<QByteArray>("method");
    QTest::addColumn<QByteArray>("validate");
    QTest::addColumn<bool>("rigid");
    for (const correctors::PositionMethod& method : correctors::positionMethods()) {
      const MethodText text = withNumbers(method);
      const Settings settings = resolveSettings(text.id, method.settings, text.given).value();
      // One that keeps scales of all rows is fitted anew in every fold unless it is tuned.
      if (!method.hold_out || (method.keeps_scales && !method.tunes(settings))) continue;
      for (const QByteArray validate : {"loo", "kfold:7", "block:8"})
        if (validate == "loo" || method.tuning != correctors::Tuning::kAlways)
          for (const bool rigid : {true, false})
            QTest::addRow("%s, %s, align %s", method.id.c_str(), validate.constData(), rigid ? "rigid" : "none")
                << QByteArray::fromStdString(method.id) << validate << rigid;
    }
  }
  void agreesWithFittingAnew() {
    QFETCH(QByteArray, method);
    QFETCH(QByteArray, validate);
    QFETCH(bool, rigid);
    ComparisonOptions options;
    options.position_methods = {withNumbers(**correctors::findPositionMethod(method.toStdString()))};
    options.orientation_methods = {{"none", {}}};
    options.validation = parseValidation(validate.toStdString()).value();
    options.align = rigid ? calibration::AlignMode::kRigid : calibration::AlignMode::kNone;
    options.with_surroundings = false;
    const CalibrationTable table = weightedTable();
    const auto fast = compareMethods(table, options);
    FT_VERIFY_OK(fast);
    options.closed_form = false;
    const auto slow = compareMethods(table, options);
    FT_VERIFY_OK(slow);
    const MethodScore& seen = fast->position.front();
    const MethodScore& expected = slow->position.front();
    QCOMPARE(seen.skipped.value_or(""), std::string());
    QCOMPARE(expected.skipped.value_or(""), std::string());
    QVERIFY(seen.closed_form && !expected.closed_form);
    QCOMPARE(seen.n_folds, expected.n_folds);
    QCOMPARE(fast->places, slow->places);
    if (keepsScales(method.toStdString())) {
      FT_VERIFY_MATCH(near(seen.stats.rms, expected.stats.rms, 0.05 * expected.stats.rms));
      return;
    }
    for (std::size_t i = 0; i < slow->places.size(); ++i) {
      FT_VERIFY_MATCH(near(seen.place_errors[i], expected.place_errors[i], 1e-6));
      FT_VERIFY_MATCH(near(seen.residual_m[i], expected.residual_m[i], 1e-9));
    }
    QCOMPARE(seen.place_covered, expected.place_covered);
  }

  /// A tuned method is tuned again without the places it is judged at: its errors are those of calibrations that were
  /// fitted, octant by octant, to the rows of the other octants alone.
  void tunedMethodsAreTunedAnewInEveryFold_data() {
    QTest::addColumn<QByteArray>("method");
    for (const char* text : {"rbf", "rbf:shape_mm=300,smoothing=0.1", "hmq:r2_cm2=auto", "polynomial:degree=auto",
                             "bspline", "bspline:spans=2,smoothing=1", "gaussian_process"})
      QTest::newRow(text) << QByteArray(text);
  }
  void tunedMethodsAreTunedAnewInEveryFold() {
    QFETCH(QByteArray, method);
    const CalibrationTable table = weightedTable();
    const auto choice = calibration::parseCorrectorChoice(method.toStdString(), "none");
    FT_VERIFY_OK(choice);
    ComparisonOptions options;
    options.position_methods = {parseMethodText(method.toStdString()).value()};
    options.orientation_methods = {{"none", {}}};
    options.validation = parseValidation("block:8").value();
    options.align = calibration::AlignMode::kRigid;
    options.with_surroundings = false;
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    const MethodScore& score = comparison->position.front();
    QVERIFY(score.tuned_inside && !score.closed_form && score.validated == comparison->validation);

    const Eigen::Vector3d middle_m = trueBox_m(table.nodes).center();
    const auto octant = [&](const Node& node) {
      const Eigen::Vector3d p_m = node.reference_from_sensor.position_m - middle_m;
      return (p_m.x() > 0.0 ? 1 : 0) + (p_m.y() > 0.0 ? 2 : 0) + (p_m.z() > 0.0 ? 4 : 0);
    };
    std::map<int, std::vector<double>> squares_mm2;
    for (int held_out = 0; held_out < 8; ++held_out) {
      std::vector<Node> others;
      for (const Node& node : table.nodes)
        if (octant(node) != held_out) others.push_back(node);
      const auto corrector =
          calibration::Corrector::fit(others, table.metadata, *choice, calibration::AlignMode::kRigid);
      FT_VERIFY_OK(corrector);
      for (const Node& node : table.nodes)
        if (octant(node) == held_out)
          squares_mm2[node.node].push_back(
              1e6 * (corrector->correct(node.tracker_from_sensor).position_m - node.reference_from_sensor.position_m)
                        .squaredNorm());
    }
    for (std::size_t i = 0; i < comparison->places.size(); ++i) {
      const std::vector<double>& rows = squares_mm2.at(comparison->places[i]);
      const double mean_mm2 = std::accumulate(rows.begin(), rows.end(), 0.0) / static_cast<double>(rows.size());
      FT_VERIFY_MATCH(near(score.place_errors[i], std::sqrt(mean_mm2), 1e-6));
    }
  }

  /// Left out one by one a tuned method keeps what all places chose: told, and never called best.
  void aMethodTunedByThePlacesItIsJudgedAtIsNeverBest() {
    ComparisonOptions options;
    options.position_methods = {{"affine", {}}, {"rbf", {}}};
    options.orientation_methods = {{"none", {}}};
    options.with_surroundings = false;
    options.validation = parseValidation("loo").value();
    const auto loo = compareMethods(weightedTable(), options);
    FT_VERIFY_OK(loo);
    QVERIFY(loo->position.front().tuned_inside);
    const MethodScore& tuned = loo->position.back();
    QVERIFY(!tuned.tuned_inside && tuned.closed_form && tuned.stats.rms < loo->position.front().stats.rms);
    QCOMPARE(loo->best_position, std::string("affine"));
    FT_VERIFY_MATCH(holdsAll(tuned.notes.back(), {"chosen on all places"}));
    FT_VERIFY_MATCH(holdsAll(loo->notes.back(), {"Not ranked", "Radial basis functions", "kfold:10"}));
    options.position_methods = {{"rbf", {}}};
    const auto alone = compareMethods(weightedTable(), options);
    FT_VERIFY_OK(alone);
    QCOMPARE(alone->best_position, std::string("none"));
    FT_VERIFY_MATCH(holdsAll(alone->verdict.text, {"Do not apply", "no method that loo can judge"}));

    options.position_methods = {{"affine", {}}, {"rbf", {}}};
    options.validation.reset();
    const auto folds = compareMethods(weightedTable(), options);
    FT_VERIFY_OK(folds);
    QCOMPARE(toText(folds->validation), std::string("kfold:10"));
    QCOMPARE(folds->best_position, std::string("rbf"));
    for (const MethodScore& score : folds->position)
      QVERIFY(score.tuned_inside && score.validated == folds->validation && score.n_folds == 10);
  }

  void whatHasNothingToChooseIsNotTuned_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<bool>("tunes");
    // A cubic and a thin plate have no shape, back-propagation no weight penalty.
    for (const char* text : {"rbf:kernel=cubic,smoothing=0", "rbf:kernel=thin_plate,smoothing=0.1",
                             "rbf:shape_mm=300,smoothing=0", "neural_network:training=back_propagation"})
      QTest::newRow(text) << QByteArray(text) << false;
    for (const char* text : {"rbf:kernel=cubic", "rbf:smoothing=0", "rbf:shape_mm=300", "neural_network"})
      QTest::newRow(text) << QByteArray(text) << true;
  }
  void whatHasNothingToChooseIsNotTuned() {
    QFETCH(QByteArray, text);
    QFETCH(bool, tunes);
    const MethodText method = parseMethodText(text.toStdString()).value();
    const correctors::PositionMethod& row = **correctors::findPositionMethod(method.id);
    QCOMPARE(row.tunes(resolveSettings(method.id, row.settings, method.given).value()), tunes);
    if (row.isCostly()) return;
    ComparisonOptions options;
    options.position_methods = {{"affine", {}}, method};
    options.orientation_methods = {{"none", {}}};
    options.with_surroundings = false;
    const auto comparison = compareMethods(weightedTable(), options);
    FT_VERIFY_OK(comparison);
    QCOMPARE(toText(comparison->validation), std::string(tunes ? "kfold:10" : "loo"));
    QVERIFY(comparison->position.back().tuned_inside);
    QVERIFY(comparison->position.back().stats.rms < comparison->position.front().stats.rms);
    QCOMPARE(comparison->best_position, std::string("rbf"));
  }

  void aCostlyMethodIsHeldOutInTenFoldsAndThenNotBest() {
    int n_scored = 0;
    for (const correctors::PositionMethod& method : correctors::positionMethods()) {
      if (!method.isCostly()) continue;
      ComparisonOptions options;
      options.position_methods = {{method.id, {}}, {"none", {}}};
      options.orientation_methods = {{"none", {}}};
      options.with_surroundings = false;
      options.validation = parseValidation("loo").value();
      SyntheticOptions synthetic;
      synthetic.counts = {3, 3, 3};
      synthetic.smooth_distortion_m = 0.01;
      const auto comparison = compareMethods(syntheticTable(synthetic, {.seed = 2, .position_sd_m = 0.001}), options);
      FT_VERIFY_OK(comparison);
      const MethodScore& score = comparison->position.front();
      if (score.skipped) continue;
      ++n_scored;
      QCOMPARE(score.n_folds, 10);
      QCOMPARE(toText(score.validated), std::string("kfold:10"));
      QCOMPARE(comparison->position.back().n_folds, 27);
      QCOMPARE(score.place_errors.size(), std::size_t{27});
      QCOMPARE(comparison->best_position, std::string("none"));
      FT_VERIFY_MATCH(holdsAll(score.notes.back(), {"kfold:10", "instead of loo"}));
    }
    QVERIFY(n_scored > 0);
  }
};

FIELDTRUE_TEST(ClosedFormTest)
#include "closed_form_test.moc"
