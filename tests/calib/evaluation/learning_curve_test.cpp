#include "calib/evaluation/learning_curve.h"

#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

CalibrationTable bentTable(double validation_fraction = 0.0) {
  SyntheticOptions options;
  options.counts = {5, 5, 4};
  options.smooth_distortion_m = 0.04;
  options.validation_fraction = validation_fraction;
  return syntheticTable(options, {.seed = 2, .position_sd_m = 0.0005});
}

ComparisonOptions methods(std::vector<MethodText> texts) {
  ComparisonOptions options;
  options.position_methods = std::move(texts);
  return options;
}

}  // namespace

class LearningCurveTest : public QObject {
  Q_OBJECT
 private slots:
  void aFifthIsHeldOutAndPartsOfTheRestAreFitted() {
    const auto curves = learningCurves(bentTable(), methods({{"none", {}}, {"hmq", {}}}));
    FT_VERIFY_OK(curves);
    QCOMPARE(curves->size(), std::size_t{2});
    const LearningCurve& hmq = curves->back();
    QCOMPARE(hmq.method, std::string("hmq"));
    std::vector<int> n_places;
    for (const LearningPoint& point : hmq.points) n_places.push_back(point.n_places);
    QCOMPARE(n_places, (std::vector<int>{10, 20, 40, 60, 80}));  // Of 100 places, 20 held out.
    for (const LearningPoint& point : hmq.points) QVERIFY(point.low <= point.rms && point.rms <= point.high);
    QVERIFY(hmq.points.front().low < hmq.points.front().high);
    QVERIFY(hmq.points.back().low == hmq.points.back().high);
    // A smooth field is learned: with eight times the places the error falls to a small part.
    QVERIFY(hmq.points.back().rms < 0.3 * hmq.points.front().rms);
  }

  void whatDoesNotLearnStaysFlat() {
    const auto curves = learningCurves(bentTable(), methods({{"none", {}}}));
    FT_VERIFY_OK(curves);
    const std::vector<LearningPoint>& points = curves->front().points;
    // Only the rigid part is fitted; with 40 places it is known to a few percent.
    FT_VERIFY_MATCH(near(points[2].rms, points.back().rms, 0.1 * points.back().rms));
  }

  void tooFewPlacesAreLeftOut() {
    const auto curves = learningCurves(bentTable(), methods({{"polynomial", {{"degree", "3"}}}}));
    FT_VERIFY_OK(curves);
    // 20 terms need 20 places.
    QVERIFY(!curves->front().points.empty() && curves->front().points.front().n_places >= 20);
  }

  void validationPlacesAreTheOnesHeldOut() {
    const CalibrationTable table = bentTable(0.3);
    const auto n_validation = std::count_if(table.nodes.begin(), table.nodes.end(),
                                            [](const Node& n) { return n.role == NodeRole::kValidation; });
    const auto curves = learningCurves(table, methods({{"affine", {}}}));
    FT_VERIFY_OK(curves);
    QCOMPARE(curves->front().points.back().n_places, static_cast<int>(100 - n_validation));
    ComparisonOptions options = methods({{"affine", {}}});
    options.with_surroundings = false;
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    FT_VERIFY_MATCH(near(curves->front().points.back().rms, comparison->position.front().stats.rms, 1e-9));
  }

  // Another sensor at the same place under another number errs alike there: it must not foretell what is held out.
  void whatAnotherSensorSawOfAPlaceIsHeldOutToo() {
    CalibrationTable table = bentTable();
    std::mt19937 random(3);
    std::normal_distribution<double> local_m(0.0, 0.01);
    std::vector<Node> second = table.nodes;
    for (std::size_t i = 0; i < second.size(); ++i) {
      const Eigen::Vector3d error_m(local_m(random), local_m(random), local_m(random));
      table.nodes[i].tracker_from_sensor.position_m += error_m;
      second[i].tracker_from_sensor.position_m += error_m;
      second[i].node += 1000;
      second[i].sensor = 1;
    }
    table.nodes.insert(table.nodes.end(), second.begin(), second.end());
    ComparisonOptions options = methods({{"rbf", {}}});
    options.with_surroundings = false;
    options.validation = Validation{ValidationKind::kFolds, 10};
    const auto curves = learningCurves(table, options);
    FT_VERIFY_OK(curves);
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    const double held_out_mm = comparison->position.front().stats.rms;
    // What is local cannot be foretold: 10 mm an axis are 17 mm.
    QVERIFY2(held_out_mm > 15.0, qPrintable(QString::number(held_out_mm)));
    FT_VERIFY_MATCH(near(curves->front().points.back().rms, held_out_mm, 0.3 * held_out_mm));
  }

  void theOrderOfThreadsChangesNothing() {
    const auto serial = learningCurves(bentTable(), methods({{"affine", {}}, {"hmq", {}}}));
    RunControl control;
    control.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
      for (std::size_t i = count; i-- > 0;) body(i);
    };
    const auto backwards = learningCurves(bentTable(), methods({{"affine", {}}, {"hmq", {}}}), control);
    FT_VERIFY_OK(serial);
    FT_VERIFY_OK(backwards);
    for (std::size_t i = 0; i < serial->size(); ++i) QVERIFY(toJson((*serial)[i]) == toJson((*backwards)[i]));
    const nlohmann::json json = toJson(serial->front());
    for (const char* key : {"places", "rms_mm", "low_mm", "high_mm"}) QVERIFY2(json["points"][0].contains(key), key);
  }

  void stopsWhenAsked() {
    std::stop_source source;
    RunControl control;
    control.stop = source.get_token();
    control.progress = [&](double) { source.request_stop(); };
    const auto curves = learningCurves(bentTable(), methods({{"hmq", {}}}), control);
    QVERIFY(!curves && curves.error().code == ErrorCode::kCancelled);
  }

  void badInputIsRefused() {
    QVERIFY(!learningCurves({}, {}));
    QVERIFY(!learningCurves(bentTable(), methods({{"spline9", {}}})));
  }
};

FIELDTRUE_TEST(LearningCurveTest)
#include "learning_curve_test.moc"
