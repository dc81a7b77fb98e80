#include "calib/evaluation/comparison.h"

#include <Eigen/Dense>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <thread>

#include "calib/calibration/alignment.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

CalibrationTable bentTable(int orientations = 1) {
  SyntheticOptions options;
  options.counts = {4, 4, 4};
  options.reference_from_tracker = {{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
  options.smooth_distortion_m = 0.04;
  options.orientation_error_rad = 0.2;
  options.orientations = orientations;
  return syntheticTable(options, {.seed = 2, .position_sd_m = 0.0005, .rotation_sd_rad = 0.002});
}

/// A few methods of each kind, with what `options` says besides: enough to judge the comparison itself.
ComparisonOptions fewMethods(ComparisonOptions options = {}) {
  options.position_methods = {
      {"none", {}}, {"rigid", {}}, {"affine", {}}, {"polynomial", {{"degree", "3"}}}, {"hmq", {}}};
  options.orientation_methods = {{"none", {}}, {"rigid", {}}, {"polynomial_quaternion", {}}, {"hmq_matrix", {}}};
  return options;
}

const MethodScore& scoreOf(const std::vector<MethodScore>& scores, const std::string& method) {
  return *std::find_if(scores.begin(), scores.end(), [&](const MethodScore& score) { return score.method == method; });
}

/// Without what a clock measured.
nlohmann::json withoutTimes(nlohmann::json json) {
  for (const char* part : {"position", "orientation"})
    for (nlohmann::json& score : json.at(part)) {
      score.erase("fit_s");
      score.erase("eval_ns");
    }
  return json;
}

/// Leave-one-out errors of an affine map from tracked to true, by normal equations on raw coordinates [mm].
std::vector<double> affineLeaveOneOut_mm(const CalibrationTable& table) {
  std::vector<double> errors_mm;
  const auto n = static_cast<Eigen::Index>(table.nodes.size());
  for (Eigen::Index out = 0; out < n; ++out) {
    Eigen::Matrix4d XtX = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 4, 3> XtY = Eigen::Matrix<double, 4, 3>::Zero();
    const auto row = [&](Eigen::Index i) {
      const Eigen::Vector3d& p_m = table.nodes[static_cast<std::size_t>(i)].tracker_from_sensor.position_m;
      return Eigen::Vector4d(1.0, p_m.x(), p_m.y(), p_m.z());
    };
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == out) continue;
      XtX += row(i) * row(i).transpose();
      XtY += row(i) * table.nodes[static_cast<std::size_t>(i)].reference_from_sensor.position_m.transpose();
    }
    const Eigen::Vector3d predicted_m = (XtX.inverse() * XtY).transpose() * row(out);
    errors_mm.push_back(
        1000.0 * (predicted_m - table.nodes[static_cast<std::size_t>(out)].reference_from_sensor.position_m).norm());
  }
  return errors_mm;
}

}  // namespace

class ComparisonTest : public QObject {
  Q_OBJECT
 private slots:
  /// An affine map takes 4 coefficients an axis and degree 3 takes 20, of 64 places; held-out validation places are
  /// fresh, whatever was fitted to the others.
  void whatAFitTookIsKnown() {
    CalibrationTable table = bentTable();
    const auto shareOf = [&](const char* method) {
      const auto comparison = compareMethods(table, fewMethods());
      return comparison ? scoreOf(comparison->position, method).freedom.coefficients_a_place : -1.0;
    };
    QCOMPARE(shareOf("affine"), 4.0 / 64.0);
    QCOMPARE(shareOf("polynomial"), 20.0 / 64.0);
    QCOMPARE(shareOf("none"), 0.0);
    QCOMPARE(shareOf("hmq"), 0.0);
    for (std::size_t i = 0; i < table.nodes.size(); i += 4) table.nodes[i].role = NodeRole::kValidation;
    QCOMPARE(shareOf("affine"), 0.0);
  }

  void leaveOneOutIsThatOfAnIndependentFit_data() {
    QTest::addColumn<QString>("align");
    QTest::newRow("none") << "none";
    QTest::newRow("rigid") << "rigid";  // A rigid part before an affine fit changes nothing.
  }
  void leaveOneOutIsThatOfAnIndependentFit() {
    QFETCH(QString, align);
    const CalibrationTable table = bentTable();
    ComparisonOptions options;
    options.position_methods = {{"affine", {}}};
    options.orientation_methods = {{"none", {}}};  // Tuned ones would ask for folds.
    options.align = align == "none" ? calibration::AlignMode::kNone : calibration::AlignMode::kRigid;
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    const std::vector<double> expected_mm = affineLeaveOneOut_mm(table);
    const MethodScore& affine = comparison->position.front();
    QCOMPARE(comparison->places.size(), expected_mm.size());
    for (std::size_t i = 0; i < expected_mm.size(); ++i) {
      FT_VERIFY_MATCH(near(affine.place_errors[i], expected_mm[i], 1e-6));
      FT_VERIFY_MATCH(near(1000.0 * affine.residual_m[i].norm(), expected_mm[i], 1e-6));
    }
    const double squares = std::inner_product(expected_mm.begin(), expected_mm.end(), expected_mm.begin(), 0.0);
    FT_VERIFY_MATCH(near(affine.stats.rms, std::sqrt(squares / 64.0), 1e-6));
  }

  void noneIsTheErrorBefore_data() {
    QTest::addColumn<QByteArray>("validate");
    for (const char* text : {"loo", "kfold:4", "block:8"}) QTest::newRow(text) << QByteArray(text);
  }
  void noneIsTheErrorBefore() {
    QFETCH(QByteArray, validate);
    ComparisonOptions options;
    options.validation = parseValidation(validate.toStdString()).value();
    const auto comparison = compareMethods(bentTable(2), fewMethods(options));
    FT_VERIFY_OK(comparison);
    QCOMPARE(scoreOf(comparison->position, "none").place_errors, comparison->before_place_mm);
    QCOMPARE(scoreOf(comparison->orientation, "none").place_errors, comparison->before_place_deg);
    QCOMPARE(comparison->n_places, 64);
    QCOMPARE(comparison->validation_places, 64);
    // Held out, a fit is no better than on its own rows.
    for (const MethodScore& score : comparison->position) {
      QVERIFY(!score.skipped);
      QVERIFY2(score.stats.rms > score.in_sample_rms - 1e-9, score.method.c_str());
      QVERIFY(score.fit_s > 0.0 && score.eval_ns > 0.0 && score.n_uncovered == 0);
      FT_VERIFY_MATCH(near(score.rms_common_mm, score.stats.rms, 1e-12));
    }
  }

  void smoothDistortionIsWorthCorrecting() {
    const auto comparison = compareMethods(bentTable(2), fewMethods());
    FT_VERIFY_OK(comparison);
    QVERIFY(comparison->best_position == "polynomial" || comparison->best_position == "hmq");
    QVERIFY(comparison->verdict.apply_position && comparison->verdict.apply_orientation);
    QVERIFY(comparison->verdict.gain_low90 > 0.5 && comparison->verdict.gain_high90 < 1.0);
    FT_VERIFY_MATCH(
        holdsAll(comparison->verdict.text, {"Apply ", ": error before", "mm", "on 64 places the fits did not see",
                                            "gain", "90 % interval", "for orientation apply"}));
    QVERIFY(comparison->verdict.text.find('\n') == std::string::npos && comparison->verdict.text.back() == '.');
  }

  void noiseAloneIsNot() {
    SyntheticOptions options;
    options.counts = {4, 4, 3};
    const CalibrationTable table =
        syntheticTable(options, {.seed = 3, .position_sd_m = 0.002, .rotation_sd_rad = 0.01});
    const auto comparison = compareMethods(table, fewMethods());
    FT_VERIFY_OK(comparison);
    QVERIFY(!comparison->verdict.apply_position && !comparison->verdict.apply_orientation);
    FT_VERIFY_MATCH(holdsAll(comparison->verdict.text, {"Do not apply: "}));
  }

  void aPerfectTrackerIsLeftAlone() {
    const auto comparison = compareMethods(syntheticTable(), fewMethods());
    FT_VERIFY_OK(comparison);
    QCOMPARE(QByteArray::fromStdString(comparison->best_position), QByteArray("none"));
    QCOMPARE(QByteArray::fromStdString(comparison->best_orientation), QByteArray("none"));
    QVERIFY(!comparison->best_position_row && !comparison->verdict.apply_position);
    FT_VERIFY_MATCH(
        holdsAll(comparison->verdict.text, {"Do not apply: no method does better than the rigid alignment alone"}));
  }

  void validationRowsDecideByRole() {
    // Only rows for fitting are fitted: wreck the validation rows and the other way round.
    SyntheticOptions options;
    options.validation_fraction = 0.25;
    options.smooth_distortion_m = 0.03;
    const CalibrationTable table = syntheticTable(options);
    const auto plain = compareMethods(table, fewMethods());
    FT_VERIFY_OK(plain);
    QCOMPARE(plain->validation.kind, ValidationKind::kRole);
    const auto n_validation = std::count_if(table.nodes.begin(), table.nodes.end(),
                                            [](const Node& n) { return n.role == NodeRole::kValidation; });
    QCOMPARE(plain->validation_places, static_cast<int>(n_validation));
    QCOMPARE(plain->n_places, static_cast<int>(table.nodes.size()));
    CalibrationTable shifted = table;
    for (Node& node : shifted.nodes)
      if (node.role == NodeRole::kValidation) node.reference_from_sensor.position_m.z() += 5.0;
    const auto wrecked = compareMethods(shifted, fewMethods());
    FT_VERIFY_OK(wrecked);
    for (std::size_t i = 0; i < plain->position.size(); ++i) {
      // The fit did not move, so every error moves by the 5 m and no more.
      FT_VERIFY_MATCH(near(wrecked->position[i].in_sample_rms, plain->position[i].in_sample_rms, 1e-12));
      for (std::size_t k = 0; k < plain->places.size(); ++k)
        FT_VERIFY_MATCH(near(wrecked->position[i].residual_m[k],
                             Eigen::Vector3d(plain->position[i].residual_m[k] - Eigen::Vector3d(0, 0, 5.0)), 1e-9));
    }
  }

  void skippedRowsNeverCount() {
    CalibrationTable table = bentTable();
    CalibrationTable with_skipped = table;
    for (int i = 0; i < 5; ++i) {
      Node wild = table.nodes[static_cast<std::size_t>(i)];
      wild.node = 1000 + i;
      wild.role = NodeRole::kSkipped;
      wild.tracker_from_sensor.position_m *= -7.0;
      with_skipped.nodes.insert(with_skipped.nodes.begin() + 3 * i, wild);
    }
    const auto expected = compareMethods(table, fewMethods());
    const auto seen = compareMethods(with_skipped, fewMethods());
    FT_VERIFY_OK(expected);
    FT_VERIFY_OK(seen);
    QCOMPARE(seen->coverage->missing, (std::vector<int>{1000, 1001, 1002, 1003, 1004}));
    QVERIFY(expected->coverage->missing.empty());
    nlohmann::json seen_json = withoutTimes(toJson(*seen));
    nlohmann::json expected_json = withoutTimes(toJson(*expected));
    // What was planned and skipped is told, and nothing else changes.
    for (const char* key : {"missing", "text"}) QVERIFY(seen_json["coverage"][key] != expected_json["coverage"][key]);
    seen_json["coverage"].erase("missing");
    seen_json["coverage"].erase("text");
    expected_json["coverage"].erase("missing");
    expected_json["coverage"].erase("text");
    QVERIFY(seen_json == expected_json);
  }

  void threadsChangeNothing_data() {
    QTest::addColumn<bool>("all");
    QTest::newRow("a few methods, leave-one-out") << false;
    QTest::newRow("every method, three folds") << true;
  }
  void threadsChangeNothing() {
    QFETCH(bool, all);
    SyntheticOptions small;
    small.counts = {3, 3, 3};
    small.smooth_distortion_m = 0.02;
    const CalibrationTable table = all ? syntheticTable(small, {.seed = 6, .position_sd_m = 0.001}) : bentTable();
    ComparisonOptions options = all ? ComparisonOptions() : fewMethods();
    if (all) options.validation = Validation{ValidationKind::kFolds, 3};
    const auto serial = compareMethods(table, options);
    FT_VERIFY_OK(serial);
    std::vector<double> told;
    std::mutex mutex;
    RunControl control;
    control.progress = [&](double fraction) {
      const std::lock_guard lock(mutex);
      told.push_back(fraction);
    };
    control.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
      std::jthread odd([&] {
        for (std::size_t i = count; i-- > 0;)
          if (i % 2 == 1) body(i);
      });
      for (std::size_t i = count; i-- > 0;)
        if (i % 2 == 0) body(i);
    };
    const auto threaded = compareMethods(table, options, control);
    FT_VERIFY_OK(threaded);
    QVERIFY(withoutTimes(toJson(*threaded)) == withoutTimes(toJson(*serial)));
    QVERIFY(told.size() > 20 && told.front() > 0.0 && told.back() == 1.0);
    QVERIFY(std::is_sorted(told.begin(), told.end()));
  }

  void stopsWhenAsked() {
    std::stop_source source;
    int n_folds = 0;
    RunControl control;
    control.stop = source.get_token();
    control.progress = [&](double) {
      if (++n_folds == 3) source.request_stop();
    };
    const auto comparison = compareMethods(bentTable(), fewMethods(), control);
    QVERIFY(!comparison);
    QCOMPARE(comparison.error().code, ErrorCode::kCancelled);
  }

  void methodsThatCannotBeFittedSayWhy() {
    SyntheticOptions synthetic;
    synthetic.counts = {5, 2, 2};
    synthetic.has_orientation = false;
    synthetic.smooth_distortion_m = 0.01;
    ComparisonOptions options;
    options.position_methods = {{"none", {}}, {"polynomial", {{"degree", "4"}}}, {"affine", {}}};
    const auto comparison = compareMethods(syntheticTable(synthetic, {.seed = 1, .position_sd_m = 0.001}), options);
    FT_VERIFY_OK(comparison);
    const MethodScore& polynomial = comparison->position[1];
    QVERIFY(polynomial.skipped.has_value());
    FT_VERIFY_MATCH(holdsAll(*polynomial.skipped, {"degree 4 needs at least 35 places, got 20"}));
    QVERIFY(polynomial.place_errors.empty());
    QVERIFY(!comparison->position[2].skipped);
    QVERIFY(!comparison->before_orientation_deg);
    for (const MethodScore& score : comparison->orientation) {
      QVERIFY(score.skipped.has_value());
      FT_VERIFY_MATCH(holdsAll(*score.skipped, {"20 of 20 rows have no orientation"}));
    }
    QCOMPARE(QByteArray::fromStdString(comparison->best_orientation), QByteArray("none"));
    QVERIFY(comparison->verdict.text.find("orientation") == std::string::npos);
  }

  void aFitThatFailsInOneFoldIsSkipped() {
    // Four places not in a plane determine an affine map; with one held out, three are left.
    SyntheticOptions synthetic;
    synthetic.counts = {2, 2, 2};
    CalibrationTable table = syntheticTable(synthetic);
    table.nodes = {table.nodes[0], table.nodes[1], table.nodes[2], table.nodes[4]};
    ComparisonOptions options;
    options.position_methods = {{"affine", {}}};
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    QVERIFY(comparison->position.front().skipped.has_value());
    FT_VERIFY_MATCH(holdsAll(*comparison->position.front().skipped, {"held out"}));
    QCOMPARE(QByteArray::fromStdString(comparison->best_position), QByteArray("none"));
  }

  void severalSettingsOfOneMethodAreTold() {
    ComparisonOptions options;
    options.position_methods = {{"polynomial", {{"degree", "1"}}}, {"polynomial", {{"degree", "3"}}}};
    const auto comparison = compareMethods(bentTable(), options);
    FT_VERIFY_OK(comparison);
    QVERIFY(comparison->best_position_row == std::size_t{1});
    FT_VERIFY_MATCH(holdsAll(comparison->verdict.text, {"Apply Polynomial: "}));
  }

  void badInputGivesOneSentence_data() {
    QTest::addColumn<QString>("what");
    QTest::addColumn<ErrorCode>("code");
    QTest::newRow("empty table") << "empty" << ErrorCode::kTooFewNodes;
    QTest::newRow("all skipped") << "skipped" << ErrorCode::kTooFewNodes;
    QTest::newRow("one place") << "one" << ErrorCode::kTooFewNodes;
    QTest::newRow("three places: two are left to align") << "three" << ErrorCode::kTooFewNodes;
    QTest::newRow("one line") << "line" << ErrorCode::kDegenerate;
    QTest::newRow("not a number") << "nan" << ErrorCode::kBadInput;
    QTest::newRow("unknown method") << "method" << ErrorCode::kBadInput;
    QTest::newRow("unknown setting") << "setting" << ErrorCode::kBadInput;
    QTest::newRow("role without validation rows") << "role" << ErrorCode::kBadInput;
  }
  void badInputGivesOneSentence() {
    QFETCH(QString, what);
    QFETCH(ErrorCode, code);
    CalibrationTable table = bentTable();
    ComparisonOptions options;
    if (what == "empty") table.nodes.clear();
    if (what == "one") table.nodes.resize(1);
    if (what == "three") table.nodes = {table.nodes[0], table.nodes[1], table.nodes[4]};
    if (what == "line") table.nodes.resize(4);
    if (what == "skipped")
      for (Node& node : table.nodes) node.role = NodeRole::kSkipped;
    if (what == "nan") table.nodes[5].tracker_from_sensor.position_m.y() = std::numeric_limits<double>::quiet_NaN();
    if (what == "method") options.position_methods = {{"spline", {}}};
    if (what == "setting") options.orientation_methods = {{"rigid", {{"colour", "red"}}}};
    if (what == "role") options.validation = Validation{ValidationKind::kRole, 0};
    if (what == "line")
      for (std::size_t i = 0; i < table.nodes.size(); ++i) {
        table.nodes[i].tracker_from_sensor.position_m = Eigen::Vector3d(0.1 * static_cast<double>(i), 0.0, 0.0);
        table.nodes[i].reference_from_sensor.position_m = table.nodes[i].tracker_from_sensor.position_m;
      }
    const auto comparison = compareMethods(table, options);
    QVERIFY(!comparison);
    QCOMPARE(comparison.error().code, code);
    QVERIFY(comparison.error().message.size() > 20 && comparison.error().message.find('\n') == std::string::npos);
  }

  void jsonIsTheDocumentedOne() {
    const auto comparison = compareMethods(bentTable(), fewMethods());
    FT_VERIFY_OK(comparison);
    const nlohmann::json json = nlohmann::json::parse(toJson(*comparison).dump());
    QVERIFY(json.at("schema") == "fieldtrue.compare/1" && json.at("validate") == "loo" && json.at("align") == "rigid");
    QVERIFY(json.at("places") == 64 && json.at("validation_places") == 64);
    for (const char* key : {"position_mm", "orientation_deg", "from"}) QVERIFY(json.at("floor").contains(key));
    QCOMPARE(json.at("scored_places").size(), std::size_t{64});
    QCOMPARE(json.at("scored_at_edge").size(), std::size_t{64});
    QCOMPARE(json.at("before").at("place_mm").size(), std::size_t{64});
    const nlohmann::json& second = json.at("position").at(1);
    QVERIFY(second.at("validated") == "loo" && second.at("tuned_inside") == true);
    QCOMPARE(second.at("place_mm").size(), std::size_t{64});
    // Of a grid of 4x4x4 places 56 are outermost; the whole is made of both parts.
    const double inside_mm = second.at("position_mm_inside").at("rms").get<double>();
    const double edge_mm = second.at("position_mm_edge").at("rms").get<double>();
    const double whole_mm = second.at("position_mm").at("rms").get<double>();
    FT_VERIFY_MATCH(near(std::sqrt((8 * inside_mm * inside_mm + 56 * edge_mm * edge_mm) / 64), whole_mm, 1e-9));
    for (const char* key : {"mean", "median", "rms", "p95", "max", "rms_low90", "rms_high90"}) {
      QVERIFY(json.at("before").at("position_mm").at(key).is_number());
      QVERIFY(json.at("before").at("orientation_deg").at(key).is_number());
      QVERIFY(json.at("position").at(1).at("position_mm").at(key).is_number());
    }
    for (const char* key :
         {"method", "settings", "position_mm", "n_uncovered", "rms_common_mm", "fit_s", "eval_ns", "skipped"})
      QVERIFY2(json.at("position").at(0).contains(key), key);
    for (const char* key : {"method", "settings", "orientation_deg", "n_uncovered", "fit_s", "eval_ns", "skipped"})
      QVERIFY2(json.at("orientation").at(0).contains(key), key);
    QVERIFY(json.at("position").at(0).at("skipped").is_null());
    QVERIFY(json.at("best").at("position") == comparison->best_position);
    QVERIFY(json.at("best").at("orientation") == comparison->best_orientation);
    for (const char* key :
         {"apply_position", "apply_orientation", "gain_low90", "gain_high90", "gain_without_worst_place", "text"})
      QVERIFY2(json.at("verdict").contains(key), key);
  }
};

FIELDTRUE_TEST(ComparisonTest)
#include "comparison_test.moc"
