#include <QTest>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "calib/calibration/coincident_places.h"
#include "calib/calibration/corrector.h"
#include "calib/core/units.h"
#include "calib/correctors/base/method_text.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/sensor_splits.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// A table of several sensors: one alignment, a mounting for each, one correction for all unless they err differently.
using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

const Eigen::Quaterniond kMount1(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()));
const Eigen::Quaterniond kMount2(Eigen::AngleAxisd(-1.1, Eigen::Vector3d(0, 1, 3).normalized()));

struct TwoSensors {
  double smooth_m = 0.0;
  double gain = 0.0;    ///< What the second reads too far, as a share of the distance.
  double gain_1 = 0.0;  ///< And the first.
  double turn_rad_m =
      0.0;  ///< What the second is turned by too far about y for each metre along x; the first the other way.
  double noise_1_m = 0.0;    ///< Placing error of the first, SD an axis.
  double noise_2_m = 0.0;    ///< And of the second.
  bool side_by_side = true;  ///< So far apart along y, else both at the same place.
  double apart_m = 0.1;
  unsigned seed = 5;
};

/// What a tracker reads of a true pose in its own frame.
Pose reading(const SyntheticOptions& options, const Pose& truth, const Eigen::Quaterniond& mount, double gain,
             double turn_rad_m = 0.0) {
  Pose tracked = syntheticReading(options, truth);
  tracked.position_m *= 1.0 + gain;
  const double turn_rad = turn_rad_m * truth.position_m.x();
  tracked.orientation = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()) * truth.orientation * mount.conjugate();
  return tracked;
}

CalibrationTable twoSensors(const TwoSensors& how) {
  SyntheticOptions options;
  options.smooth_distortion_m = how.smooth_m;
  CalibrationTable table = syntheticTable(options);
  std::mt19937 random(how.seed);
  std::normal_distribution<double> standard;
  std::vector<Node> second = table.nodes;
  for (std::size_t i = 0; i < table.nodes.size(); ++i) {
    Node& one = table.nodes[i];
    Node& other = second[i];
    one.sensor = 1;
    other.sensor = 2;
    if (how.side_by_side) other.reference_from_sensor.position_m.y() += how.apart_m;
    // Turned from place to place, so that orientations tell something.
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1 * static_cast<double>(i % 7), Eigen::Vector3d::UnitX()));
    one.reference_from_sensor.orientation = other.reference_from_sensor.orientation = turn;
    one.tracker_from_sensor = reading(options, one.reference_from_sensor, kMount1, how.gain_1, -how.turn_rad_m);
    other.tracker_from_sensor = reading(options, other.reference_from_sensor, kMount2, how.gain, how.turn_rad_m);
    if (how.noise_1_m > 0.0)
      for (double& coordinate : one.reference_from_sensor.position_m) coordinate += how.noise_1_m * standard(random);
    if (how.noise_2_m > 0.0)
      for (double& coordinate : other.reference_from_sensor.position_m) coordinate += how.noise_2_m * standard(random);
  }
  table.nodes.insert(table.nodes.end(), second.begin(), second.end());
  return table;
}

Comparison compared(const CalibrationTable& table, const char* method) {
  ComparisonOptions options;
  options.position_methods = {parseMethodText(method).value()};
  options.orientation_methods = {{"none", {}}};
  options.validation = Validation{ValidationKind::kFolds, 10};
  const auto comparison = compareMethods(table, options);
  if (!comparison) qFatal("%s", comparison.error().message.c_str());
  return *comparison;
}

}  // namespace

class SensorsTest : public QObject {
  Q_OBJECT
 private slots:
  void eachHasItsMounting() {
    const CalibrationTable table = twoSensors({});
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, calibration::CorrectorChoice(),
                                                       calibration::AlignMode::kRigid);
    FT_VERIFY_OK(corrector);
    FT_VERIFY_MATCH(near(corrector->alignment().mountOf(1), kMount1, 1e-9));
    FT_VERIFY_MATCH(near(corrector->alignment().mountOf(2), kMount2, 1e-9));
    const auto again = calibration::Corrector::fromText(corrector->toText(), "again");
    FT_VERIFY_OK(again);
    QCOMPARE(again->toText(), corrector->toText());
    std::vector<Pose> tracked, one_by_one, together(table.nodes.size());
    std::vector<std::optional<int>> sensors;
    for (const Node& node : table.nodes) {
      tracked.push_back(node.tracker_from_sensor);
      sensors.emplace_back(node.sensor);
      one_by_one.push_back(again->correct(node.tracker_from_sensor, node.sensor));
      FT_VERIFY_MATCH(near(one_by_one.back().orientation, node.reference_from_sensor.orientation, 1e-9));
      FT_VERIFY_MATCH(near(one_by_one.back().position_m, node.reference_from_sensor.position_m, 1e-9));
    }
    again->correct(tracked, together, sensors);
    for (std::size_t i = 0; i < together.size(); ++i) FT_VERIFY_MATCH(sameBits(together[i], one_by_one[i]));
  }

  void oneSensorIsAsBefore() {
    CalibrationTable table = twoSensors({});
    std::erase_if(table.nodes, [](const Node& node) { return node.sensor != 2; });
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, calibration::CorrectorChoice(),
                                                       calibration::AlignMode::kRigid);
    FT_VERIFY_OK(corrector);
    QVERIFY(corrector->alignment().mounts.empty());
    QVERIFY(corrector->toText().find("mounts_wxyz") == std::string::npos);
    const Comparison comparison = compared(table, "polynomial:degree=1");
    QVERIFY(comparison.before_sensors.empty() && comparison.position.front().sensors.empty() && !comparison.split);
  }

  void errorsAreToldBySensor() {
    // The first is read exactly, the second stands 2 mm off an axis: 3.46 mm RMS.
    const Comparison comparison = compared(twoSensors({.noise_2_m = 0.002}), "polynomial:degree=1");
    QCOMPARE(comparison.places.size(), std::size_t{100});
    const auto& sensors = comparison.position.front().sensors;
    QCOMPARE(sensors.size(), std::size_t{2});
    QCOMPARE(sensors[0].sensor, 1);
    QCOMPARE(sensors[1].sensor, 2);
    QVERIFY(sensors[0].stats.rms < 0.6);
    FT_VERIFY_MATCH(near(sensors[1].stats.rms, 2.0 * std::sqrt(3.0), 0.5));
    // A place's error is the RMS over its rows, of both sensors.
    for (std::size_t k = 0; k < comparison.places.size(); ++k) {
      const double both = std::hypot(sensors[0].place_errors[k], sensors[1].place_errors[k]) / std::sqrt(2.0);
      FT_VERIFY_MATCH(near(comparison.position.front().place_errors[k], both, 1e-12));
    }
    const nlohmann::json told = toJson(comparison).at("sensors");
    QCOMPARE(told.size(), std::size_t{2});
    // Nothing distorts this field, so no correction is best.
    QVERIFY(told.at(0).at("after").is_null());
    QCOMPARE(told.at(1).at("rms").get<double>(), comparison.before_sensors[1].stats.rms);
  }

  void whatTheBestLeavesOfEachSensorIsTold_data() {
    QTest::addColumn<double>("gain");
    QTest::newRow("shared") << 0.0;
    QTest::newRow("apart") << 0.02;
  }
  void whatTheBestLeavesOfEachSensorIsTold() {
    QFETCH(double, gain);
    const Comparison comparison =
        compared(twoSensors({.smooth_m = 0.02, .gain = gain, .noise_2_m = 0.001}), "polynomial:degree=3");
    QCOMPARE(isApart(comparison.split), gain > 0.0);
    const nlohmann::json told = toJson(comparison).at("sensors");
    // Every place has a row of either, so that their mean square is that of the best.
    double square_mm2 = 0.0;
    for (const nlohmann::json& sensor : told)
      square_mm2 += 0.5 * std::pow(sensor.at("after").at("rms").get<double>(), 2);
    const double best_mm = gain > 0.0 ? comparison.split->separate : comparison.position.front().stats.rms;
    FT_VERIFY_MATCH(near(std::sqrt(square_mm2), best_mm, 1e-9));
    QVERIFY(told.at(0).at("after").at("rms") < told.at(0).at("rms"));
  }

  void sensorsThatErrAlikeShare_data() {
    QTest::addColumn<double>("apart_m");
    QTest::addColumn<QByteArray>("method");
    QTest::newRow("side by side") << 0.1 << QByteArray("polynomial:degree=3");
    QTest::newRow("in one place") << 0.0 << QByteArray("polynomial:degree=3");
    // A plane for each of two regions of one curved field errs a little less than one for both.
    QTest::newRow("side by side, by a stiff method") << 0.08 << QByteArray("affine");
  }
  void sensorsThatErrAlikeShare() {
    QFETCH(double, apart_m);
    QFETCH(QByteArray, method);
    const Comparison comparison =
        compared(twoSensors({.smooth_m = 0.02, .noise_2_m = 0.001, .side_by_side = apart_m > 0.0, .apart_m = apart_m}),
                 method.constData());
    QVERIFY(comparison.split.has_value());
    QVERIFY2(!comparison.split->is_better, comparison.split->text.c_str());
    QVERIFY(!comparison.verdict.text.empty());
    FT_VERIFY_MATCH(holdsAll(comparison.split->text, {"share one correction"}));
  }

  /// What no correction tells apart differs by the computer's rounding: that is no figure for a person.
  void aDifferenceOfRoundingIsNone() {
    const auto choice = calibration::parseCorrectorChoice("rigid", "none").value();
    const auto splits = splitsOf(twoSensors({}), choice, {}, {});
    FT_VERIFY_OK(splits);
    QVERIFY(splits->position.has_value());
    FT_VERIFY_MATCH(holdsAll(splits->position->text, {"(difference 0 to 0 mm; "}));
  }

  void sensorsThatErrDifferentlyAreToldApart_data() {
    QTest::addColumn<bool>("side_by_side");
    QTest::newRow("side by side") << true;
    QTest::newRow("in one place") << false;
  }
  void sensorsThatErrDifferentlyAreToldApart() {
    QFETCH(bool, side_by_side);
    // A gain of 2 % is up to 2 cm of the second's reading, and none of the first's.
    const Comparison comparison =
        compared(twoSensors({.smooth_m = 0.02, .gain = 0.02, .noise_2_m = 0.001, .side_by_side = side_by_side}),
                 "polynomial:degree=3");
    QVERIFY(comparison.split.has_value());
    QVERIFY2(comparison.split->is_better, comparison.split->text.c_str());
    QVERIFY(comparison.split->separate < 0.5 * comparison.split->shared);
    // Only where both met the same field is it surely the sensors.
    FT_VERIFY_MATCH(holdsAll(
        comparison.split->text,
        {side_by_side ? "by this method does not serve both sensors" : "The sensors err differently", "kfold:10"}));
  }

  void whatLeavesMoreIsNotBetter() {
    // The first gains by a correction of its own what the second, of 40 mm an axis, loses in millimetres.
    const Comparison comparison =
        compared(twoSensors({.smooth_m = 0.01, .noise_1_m = 1e-4, .noise_2_m = 0.04}), "polynomial:degree=2");
    QVERIFY(comparison.split.has_value());
    QVERIFY(comparison.split->separate_less_shared_in_shares.high90 < 0.0);
    QVERIFY(comparison.split->separate > comparison.split->shared);
    QVERIFY2(!comparison.split->is_better, comparison.split->text.c_str());
  }

  void everythingIsByTheValidationAsked_data() {
    QTest::addColumn<double>("gain");
    QTest::newRow("apart") << 0.02;
    QTest::newRow("shared") << 0.0;
  }
  void everythingIsByTheValidationAsked() {
    QFETCH(double, gain);
    const CalibrationTable table = twoSensors({.smooth_m = 0.02, .gain = gain, .noise_2_m = 0.001});
    ComparisonOptions options;
    options.position_methods = {{"affine", {}}, parseMethodText("polynomial:degree=2").value()};
    options.orientation_methods = {{"none", {}}};
    options.validation = Validation{ValidationKind::kLeaveOneOut, 0};
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    const std::optional<SensorSplit>& split = comparison->split;
    QCOMPARE(isApart(split), gain > 0.0);
    FT_VERIFY_MATCH(holdsAll(split->text, {"loo"}));
    const MethodScore& best = comparison->position[*comparison->best_position_row];
    FT_VERIFY_MATCH(near(split->shared, best.stats.rms, 1e-9));
    const double after = isApart(split) ? split->separate : best.stats.rms;
    for (const MethodScore& score : comparison->position) QVERIFY(after <= score.stats.rms);
    FT_VERIFY_MATCH(near(comparison->verdict.position.gain, 1.0 - after / comparison->before_position_mm.rms, 1e-9));
    // Each sensor's own fits, made anew without every place.
    options.position_methods = {parseMethodText(correctors::methodText(best.method, best.settings)).value()};
    options.separate_sensors = true;
    options.closed_form = false;
    options.with_surroundings = false;
    const auto refitted = compareMethods(table, options);
    FT_VERIFY_OK(refitted);
    FT_VERIFY_MATCH(near(split->separate, refitted->position.front().stats.rms, 1e-6));
  }

  void aNoisySensorHidesNoneOfTheOthers_data() {
    QTest::addColumn<unsigned>("seed");
    for (const unsigned seed : {5U, 6U, 7U, 8U}) QTest::addRow("draw %u", seed) << seed;
  }
  /// 20 mm an axis of the first drown what a gain of 2 % makes of the second, unless each is measured by its own; which
  /// of the corrections leaves less in all is chance then.
  void aNoisySensorHidesNoneOfTheOthers() {
    QFETCH(unsigned, seed);
    const Comparison comparison =
        compared(twoSensors({.smooth_m = 0.02, .gain = 0.02, .noise_1_m = 0.02, .noise_2_m = 0.001, .seed = seed}),
                 "polynomial:degree=3");
    QVERIFY(comparison.split.has_value());
    qInfo("apart %.3f mm, shared %.3f mm", comparison.split->separate, comparison.split->shared);
    QVERIFY(comparison.split->separate_less_shared.high90 > 0.0);
    QVERIFY2(isApart(comparison.split), comparison.split->text.c_str());
    FT_VERIFY_MATCH(holdsAll(comparison.split->text,
                             {"one would spoil what they share", "by itself sensor 1 ", "all share sensor 1 "}));
  }

  void oppositeErrorsAreCorrectedApart() {
    // What is 3 % too far for one and 3 % too near for the other leaves nothing that both could share.
    const CalibrationTable table = twoSensors({.gain = 0.03, .gain_1 = -0.03, .noise_2_m = 0.001});
    const Comparison comparison = compared(table, "affine");
    QVERIFY(isApart(comparison.split));
    QVERIFY(comparison.verdict.apply_position);
    QCOMPARE(comparison.best_position, std::string("affine"));
    FT_VERIFY_MATCH(holdsAll(comparison.verdict.text, {"Apply Affine", "with a correction for each sensor"}));
    QVERIFY(comparison.split->separate < 0.2 * comparison.split->before);
    QVERIFY(comparison.verdict.worst_mm < comparison.split->before);
  }

  void orientationIsAskedByItself() {
    const CalibrationTable table = twoSensors({.turn_rad_m = 0.1, .noise_1_m = 0.001, .noise_2_m = 0.001});
    const auto choice =
        calibration::parseCorrectorChoice("polynomial:degree=1", "polynomial_quaternion:degree=1").value();
    const auto fitted = fitByEvidence(table, choice, calibration::AlignMode::kRigid, {});
    FT_VERIFY_OK(fitted);
    QVERIFY(!fitted->choice().separate_position && fitted->choice().separate_orientation);
    const auto shared =
        calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
    FT_VERIFY_OK(shared);
    double squares_rad2 = 0.0, shared_rad2 = 0.0;
    for (const Node& node : table.nodes) {
      const Pose& tracked = node.tracker_from_sensor;
      const Eigen::Quaterniond& q_true = node.reference_from_sensor.orientation;
      QCOMPARE(fitted->correct(tracked, node.sensor).position_m, shared->correct(tracked, node.sensor).position_m);
      squares_rad2 += std::pow(angleBetween_rad(fitted->correct(tracked, node.sensor).orientation, q_true), 2);
      shared_rad2 += std::pow(angleBetween_rad(shared->correct(tracked, node.sensor).orientation, q_true), 2);
    }
    QVERIFY(squares_rad2 < 0.01 * shared_rad2);
    const auto second = fitted->ofSensor(2);
    FT_VERIFY_OK(second);
    QCOMPARE(second->table().nodes.size(), table.nodes.size() / 2);
    QVERIFY(*second->report().orientation_rms_rad < 0.2 * *shared->report().orientation_rms_rad);
    // What both share is as good for the first's rows, by its own mounting.
    const auto of_shared = shared->ofSensor(2);
    FT_VERIFY_OK(of_shared);
    QCOMPARE(of_shared->setup().at("sensor"), std::string("2"));
    QCOMPARE(*of_shared->report().orientation_rms_rad, *shared->report().orientation_rms_rad);
    FT_VERIFY_MATCH(sameBits(of_shared->correct(table.nodes.back().tracker_from_sensor),
                             shared->correct(table.nodes.back().tracker_from_sensor, 2)));
    const auto again = calibration::Corrector::fromText(fitted->toText(), "again");
    FT_VERIFY_OK(again);
    QCOMPARE(again->toText(), fitted->toText());
  }

  void aBarOfOnePitchForetellsNothing() {
    // Each sensor stands where the other did at the next place: that reading tells of the one left out.
    const CalibrationTable table = twoSensors({.smooth_m = 0.02, .noise_2_m = 1e-6, .apart_m = 0.2});
    ComparisonOptions options;
    options.position_methods = {parseMethodText("polynomial:degree=2").value()};
    options.orientation_methods = {{"none", {}}};
    options.validation = Validation{ValidationKind::kLeaveOneOut, 0};
    options.with_surroundings = false;
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    QVERIFY(comparison->position.front().closed_form);
    const auto choice = calibration::parseCorrectorChoice("polynomial:degree=2", "none").value();
    for (const std::size_t k : {std::size_t{0}, comparison->places.size() / 2}) {
      const int place = comparison->places[k];
      std::vector<Node> out, rest;
      for (const Node& node : table.nodes)
        if (node.node == place) out.push_back(node);
      std::set<int> shared;
      for (const Node& node : table.nodes)
        for (const Node& other : out)
          if ((node.reference_from_sensor.position_m - other.reference_from_sensor.position_m).norm() < 1e-3)
            shared.insert(node.node);
      QVERIFY(shared.size() >= 2);
      for (const Node& node : table.nodes)
        if (!shared.contains(node.node)) rest.push_back(node);
      const auto fit = calibration::Corrector::fit(rest, table.metadata, choice, calibration::AlignMode::kRigid);
      FT_VERIFY_OK(fit);
      double square_mm2 = 0.0;
      for (const Node& node : out)
        square_mm2 += 0.5e6 * (fit->correct(node.tracker_from_sensor, node.sensor).position_m -
                               node.reference_from_sensor.position_m)
                                  .squaredNorm();
      FT_VERIFY_MATCH(near(comparison->position.front().place_errors[k], std::sqrt(square_mm2), 1e-6));
    }
  }

  void placesShareTruePositions() {
    std::vector<Node> nodes(6);
    const auto put = [&](std::size_t row, int node, int sensor, std::size_t metres) {
      nodes[row].node = node;
      nodes[row].sensor = sensor;
      nodes[row].reference_from_sensor.position_m.x() = static_cast<double>(metres);
    };
    // Two sensors at one place of one number are a place; at two numbers they are halves of one.
    for (std::size_t row = 0; row < 6; ++row) put(row, static_cast<int>(row / 2), static_cast<int>(row % 2), row / 2);
    QCOMPARE(calibration::positionsAPlace(nodes), 1.0);
    for (std::size_t row = 0; row < 6; ++row) put(row, static_cast<int>(row), static_cast<int>(row % 2), row / 2);
    QCOMPARE(calibration::positionsAPlace(nodes), 0.5);
    // A bar of one pitch: of three places the first and the last have one of their two positions for themselves.
    for (std::size_t row = 0; row < 6; ++row)
      put(row, static_cast<int>(row / 2), static_cast<int>(row % 2), row / 2 + row % 2);
    FT_VERIFY_MATCH(near(calibration::positionsAPlace(nodes), (0.75 + 0.5 + 0.75) / 3.0, 1e-15));
  }

  void nothingWorseThanNothingIsBest() {
    // What passes through the second's 40 mm spoils the first that stands beside it, and either way leaves more than
    // none.
    ComparisonOptions options;
    options.position_methods = {{"rigid", {}}, parseMethodText("rbf:kernel=cubic,smoothing=0").value()};
    options.orientation_methods = {{"none", {}}};
    options.validation = Validation{ValidationKind::kFolds, 10};
    const auto comparison =
        compareMethods(twoSensors({.smooth_m = 0.01, .noise_1_m = 1e-4, .noise_2_m = 0.04}), options);
    FT_VERIFY_OK(comparison);
    const std::optional<SensorSplit>& split = comparison->split;
    QVERIFY(split && split->is_better && split->separate > split->before);
    QVERIFY(!comparison->best_position_row && !comparison->verdict.apply_position);
    FT_VERIFY_MATCH(holdsAll(split->text, {"No correction of position helps"}));
    FT_VERIFY_MATCH(holdsAll(comparison->verdict.text, {"no method does better"}));
  }

  void aTableWithoutRowsToFitIsTold_data() {
    QTest::addColumn<bool>("one_is_seen");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("skipped") << false << QByteArray("Every row of the table is skipped");
    QTest::newRow("validation") << true << QByteArray("for validation or skipped");
  }
  void aTableWithoutRowsToFitIsTold() {
    QFETCH(bool, one_is_seen);
    QFETCH(QByteArray, says);
    CalibrationTable table = twoSensors({});
    for (Node& node : table.nodes) node.role = NodeRole::kSkipped;
    if (one_is_seen) table.nodes.front().role = NodeRole::kValidation;
    const auto fitted = fitByEvidence(table, {}, calibration::AlignMode::kRigid, {});
    QVERIFY(!fitted);
    QCOMPARE(fitted.error().code, ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(fitted.error().message, {says.constData()}));
  }

  void aSensorOfFewPlacesIsTold() {
    CalibrationTable table = twoSensors({.smooth_m = 0.02, .noise_2_m = 0.001});
    std::erase_if(table.nodes, [](const Node& node) { return node.sensor == 2 && node.node > 5; });
    const auto choice = calibration::parseCorrectorChoice("polynomial:degree=2", "none").value();
    const auto fitted = fitByEvidence(table, choice, calibration::AlignMode::kRigid, {});
    FT_VERIFY_OK(fitted);
    QVERIFY(fitted->sensorsApart().empty());
    FT_VERIFY_MATCH(holdsAll(fitted->report().notes.back(), {"cannot be told", "Sensor 2"}));
  }

  void theFigureApartIsThatOfRefits() {
    const CalibrationTable table = twoSensors({.smooth_m = 0.02, .gain = 0.02, .noise_2_m = 0.001});
    ComparisonOptions options;
    options.position_methods = {parseMethodText("polynomial:degree=2").value()};
    options.orientation_methods = {{"none", {}}};
    options.validation = Validation{ValidationKind::kBlocks, 8};
    options.separate_sensors = true;
    options.with_surroundings = false;
    const auto comparison = compareMethods(table, options);
    FT_VERIFY_OK(comparison);
    // The octants about the middle of the places, each foretold by a calibration fitted without it.
    Eigen::AlignedBox3d box;
    for (const Node& node : table.nodes) box.extend(node.reference_from_sensor.position_m);
    const auto octant = [&](const Node& node) {
      const Eigen::Vector3d off_m = node.reference_from_sensor.position_m - box.center();
      return (off_m.x() > 0 ? 1 : 0) + (off_m.y() > 0 ? 2 : 0) + (off_m.z() > 0 ? 4 : 0);
    };
    auto choice = calibration::parseCorrectorChoice("polynomial:degree=2", "none").value();
    choice.separate_position = choice.separate_orientation = true;
    // All rows of a place are of the octant of its first.
    std::map<int, int> octant_of_place;
    for (const Node& node : table.nodes) octant_of_place.emplace(node.node, octant(node));
    std::map<int, double> squares_mm2;
    for (int left_out = 0; left_out < 8; ++left_out) {
      std::vector<Node> rest;
      std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(rest),
                   [&](const Node& node) { return octant_of_place[node.node] != left_out; });
      const auto fit = calibration::Corrector::fit(rest, table.metadata, choice, calibration::AlignMode::kRigid);
      FT_VERIFY_OK(fit);
      for (const Node& node : table.nodes)
        if (octant_of_place[node.node] == left_out)
          squares_mm2[node.node] += 0.5e6 * (fit->correct(node.tracker_from_sensor, node.sensor).position_m -
                                             node.reference_from_sensor.position_m)
                                                .squaredNorm();
    }
    for (std::size_t k = 0; k < comparison->places.size(); ++k)
      FT_VERIFY_MATCH(
          near(comparison->position.front().place_errors[k], std::sqrt(squares_mm2[comparison->places[k]]), 1e-6));
  }

  void aFitByEvidenceKeepsACorrectionForEach_data() {
    QTest::addColumn<double>("gain");
    QTest::newRow("err differently") << 0.02;
    QTest::newRow("err alike") << 0.0;
  }
  void aFitByEvidenceKeepsACorrectionForEach() {
    QFETCH(double, gain);
    const CalibrationTable table = twoSensors({.smooth_m = 0.02, .gain = gain, .noise_2_m = 0.001});
    const auto choice = calibration::parseCorrectorChoice("polynomial:degree=3", "polynomial_quaternion").value();
    const auto fitted = fitByEvidence(table, choice, calibration::AlignMode::kRigid, {});
    FT_VERIFY_OK(fitted);
    QCOMPARE(fitted->sensorsApart().size(), gain > 0.0 ? std::size_t{2} : std::size_t{0});
    QCOMPARE(fitted->choice().separate_position, gain > 0.0);
    const std::vector<std::string>& notes = fitted->report().notes;
    QVERIFY(notes.size() >= 2);
    const std::string& of_position = notes[notes.size() - 2];
    FT_VERIFY_MATCH(holdsAll(of_position, {gain > 0.0 ? "does not serve both" : "share one"}));
    if (gain == 0.0) {
      auto shared = calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
      QCOMPARE(shared->withNote(of_position).withNote(notes.back()).toText(), fitted->toText());
    }
  }

  void eachHasItsCorrection() {
    const CalibrationTable table = twoSensors({.smooth_m = 0.02, .gain = 0.02});
    auto choice = calibration::parseCorrectorChoice("polynomial:degree=3", "polynomial_quaternion").value();
    choice.separate_position = choice.separate_orientation = true;
    const auto apart = calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
    FT_VERIFY_OK(apart);
    QCOMPARE(apart->sensorsApart(), (std::vector<int>{1, 2}));
    const auto again = calibration::Corrector::fromText(apart->toText(), "again");
    FT_VERIFY_OK(again);
    QCOMPARE(again->toText(), apart->toText());
    QVERIFY(nlohmann::json::parse(apart->toText()).at("schema") == "fieldtrue.ftcal/3");
    std::vector<Pose> tracked, together(table.nodes.size());
    std::vector<std::optional<int>> sensors;
    for (const Node& node : table.nodes) {
      tracked.push_back(node.tracker_from_sensor);
      sensors.emplace_back(node.sensor);
    }
    again->correct(tracked, together, sensors);
    for (const int sensor : {1, 2}) {
      // The same rows fitted by themselves, in the alignment of all: its inverse is applied to the truth first.
      CalibrationTable rows{table.metadata, {}};
      for (Node node : table.nodes) {
        if (node.sensor != sensor) continue;
        const Pose tracker_from_reference = inverse(apart->alignment().reference_from_tracker);
        node.reference_from_sensor.position_m = tracker_from_reference * node.reference_from_sensor.position_m;
        rows.nodes.push_back(node);
      }
      auto position_only = choice;
      position_only.orientation_id = "none";
      position_only.orientation_settings = {};
      const auto alone =
          calibration::Corrector::fit(rows.nodes, table.metadata, position_only, calibration::AlignMode::kNone);
      FT_VERIFY_OK(alone);
      const auto one = again->ofSensor(sensor);
      FT_VERIFY_OK(one);
      QVERIFY(one->sensorsApart().empty());
      for (std::size_t i = 0; i < table.nodes.size(); ++i) {
        if (table.nodes[i].sensor != sensor) continue;
        const Eigen::Vector3d expected_m =
            apart->alignment().reference_from_tracker * alone->correctPosition_m(tracked[i].position_m);
        FT_VERIFY_MATCH(near(together[i].position_m, expected_m, 1e-9));
        FT_VERIFY_MATCH(sameBits(together[i], again->correct(tracked[i], sensor)));
        FT_VERIFY_MATCH(sameBits(together[i], one->correct(tracked[i])));
        QVERIFY(again->covers(tracked[i].position_m, sensor));
      }
    }
    QVERIFY(!again->ofSensor(3));
    FT_VERIFY_MATCH(holdsAll(again->ofSensor(3).error().message, {"sensors 1 and 2", "sensor 3"}));
    // A sensor that was not fitted, or is not told, is corrected as the first.
    FT_VERIFY_MATCH(sameBits(again->correct(tracked[0], 7), again->correct(tracked[0], 1)));
    FT_VERIFY_MATCH(sameBits(again->correct(tracked[0]), again->correct(tracked[0], 1)));
  }

  void latticesAreOfEachSensor() {
    const CalibrationTable table = twoSensors({.smooth_m = 0.02, .gain = 0.02});
    auto choice = calibration::parseCorrectorChoice("polynomial:degree=3", "none").value();
    choice.separate_position = choice.separate_orientation = true;
    const auto apart = calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
    FT_VERIFY_OK(apart);
    const auto baked = apart->baked(50e-6);
    FT_VERIFY_OK(baked);
    for (const Node& node : table.nodes) {
      const Pose& tracked = node.tracker_from_sensor;
      FT_VERIFY_MATCH(near(baked->correct(tracked, node.sensor).position_m,
                           apart->correct(tracked, node.sensor).position_m, 50e-6));
    }
    const auto again = calibration::Corrector::fromText(baked->toText(), "again");
    FT_VERIFY_OK(again);
    QVERIFY(again->isBaked());
    QCOMPARE(again->toText(), baked->toText());
  }

  void withOneSensorSeparateIsShared() {
    CalibrationTable table = twoSensors({.smooth_m = 0.02});
    std::erase_if(table.nodes, [](const Node& node) { return node.sensor != 2; });
    auto choice = calibration::parseCorrectorChoice("polynomial:degree=2", "none").value();
    const auto shared =
        calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
    choice.separate_position = choice.separate_orientation = true;
    const auto separate =
        calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
    QCOMPARE(separate->toText(), shared->toText());
  }

  void gridMethodsTakeSensorsSideBySide() {
    // One index, two positions: the index tells nothing, and the places are scattered.
    const Comparison comparison = compared(twoSensors({.smooth_m = 0.02}), "trilinear");
    const MethodScore& score = comparison.position.front();
    QVERIFY2(!score.skipped || score.skipped->find("one place for each grid index") == std::string::npos,
             score.skipped.value_or("").c_str());
  }
};

FIELDTRUE_TEST(SensorsTest)
#include "sensors_test.moc"
