#include <QTest>
#include <algorithm>
#include <map>

#include "calib/calibration/alignment.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/method_text.h"
#include "calib/correctors/registry.h"
#include "calib/evaluation/comparison.h"
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
  return text;
}

/// These place their knots and scales by all places whatever their settings, and keep them while some are held out:
/// the two ways are then near and not the same.
bool keepsScales(const std::string& method) { return method == "gaussian_process" || method == "bspline"; }

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
      if (!method.hold_out) continue;
      for (const char* validate : {"loo", "kfold:7", "block:8"})
        for (const bool rigid : {true, false})
          QTest::addRow("%s, %s, align %s", method.id.c_str(), validate, rigid ? "rigid" : "none")
              << QByteArray::fromStdString(method.id) << QByteArray(validate) << rigid;
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

  void automaticSettingsAreSaidToComeFromAllPlaces() {
    int n_scored = 0;
    for (const correctors::PositionMethod& method : correctors::positionMethods()) {
      const bool has_auto = std::any_of(method.settings.begin(), method.settings.end(), [](const Setting& setting) {
        return setting.default_value == SettingValue(std::string("auto"));
      });
      if (!method.hold_out || !has_auto) continue;
      ComparisonOptions options;
      options.position_methods = {{method.id, {}}};
      options.with_surroundings = false;
      options.validation = Validation{ValidationKind::kFolds, 3};
      const auto comparison = compareMethods(weightedTable(), options);
      FT_VERIFY_OK(comparison);
      const MethodScore& score = comparison->position.front();
      if (score.skipped) continue;
      ++n_scored;
      QVERIFY2(std::any_of(score.notes.begin(), score.notes.end(),
                           [](const std::string& note) { return note.find("chosen on all places") != note.npos; }),
               method.id.c_str());
    }
    QVERIFY(n_scored > 0);
  }

  void aCostlyMethodIsScoredOverFewerFolds() {
    int n_scored = 0;
    for (const correctors::PositionMethod& method : correctors::positionMethods()) {
      if (method.most_folds == 0 || method.hold_out) continue;
      ComparisonOptions options;
      options.position_methods = {{method.id, {}}, {"none", {}}};
      options.orientation_methods = {{"none", {}}};
      options.with_surroundings = false;
      SyntheticOptions synthetic;
      synthetic.counts = {3, 3, 3};
      synthetic.smooth_distortion_m = 0.01;
      const auto comparison = compareMethods(syntheticTable(synthetic, {.seed = 2, .position_sd_m = 0.001}), options);
      FT_VERIFY_OK(comparison);
      const MethodScore& score = comparison->position.front();
      if (score.skipped) continue;
      ++n_scored;
      QCOMPARE(score.n_folds, method.most_folds);
      QCOMPARE(comparison->position.back().n_folds, 27);
      QCOMPARE(score.place_errors.size(), std::size_t{27});
      FT_VERIFY_MATCH(
          holdsAll(score.notes.back(), {"kfold:" + QByteArray::number(method.most_folds), "instead of loo"}));
    }
    QVERIFY(n_scored > 0);
  }
};

FIELDTRUE_TEST(ClosedFormTest)
#include "closed_form_test.moc"
