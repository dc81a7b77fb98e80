#include <QTest>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/evaluation/base/intervals.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/error_stats.h"
#include "calib/evaluation/limits.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

CalibrationTable bentTable(double distortion_m, double placing_sd_m, std::array<int, 3> counts = {5, 5, 5}) {
  SyntheticOptions options;
  options.counts = counts;
  options.smooth_distortion_m = distortion_m;
  return syntheticTable(options, {.seed = 3, .position_sd_m = 0.0001, .placing_sd_m = placing_sd_m});
}

/// Moves every place across x by up to 0.1 m, and its reading with it, so that they make no grid.
void scatter(CalibrationTable& table) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> by_m(-0.1, 0.1);
  for (Node& node : table.nodes) {
    const Eigen::Vector3d shift_m(0.0, by_m(random), by_m(random));
    node.index.reset();
    node.reference_from_sensor.position_m += shift_m;
    node.tracker_from_sensor.position_m += shift_m;
  }
}

Comparison compared(const CalibrationTable& table, std::vector<MethodText> methods) {
  ComparisonOptions options;
  options.position_methods = std::move(methods);
  options.orientation_methods = {{"none", {}}};
  const auto comparison = compareMethods(table, options);
  if (!comparison) qFatal("%s", comparison.error().message.c_str());
  return *comparison;
}

double rms(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

}  // namespace

class VerdictTest : public QObject {
  Q_OBJECT
 private slots:
  void theBestIsNoDistanceFromItself() {
    const Comparison comparison = compared(bentTable(0.03, 0.0), {{"none", {}}, {"affine", {}}, {"hmq", {}}});
    QVERIFY(comparison.best_position_row.has_value());
    const MethodScore& best = comparison.position[*comparison.best_position_row];
    QVERIFY(best.rms_to_best == 0.0 && best.rms_to_best_low90 == 0.0 && best.rms_to_best_high90 == 0.0);
    for (const MethodScore& score : comparison.position) {
      FT_VERIFY_MATCH(near(score.rms_to_best, score.stats.rms - best.stats.rms, 1e-12));
      QVERIFY(score.rms_to_best_low90 <= score.rms_to_best && score.rms_to_best <= score.rms_to_best_high90);
    }
    // Without a correction the error is so much larger that no resample could hide it.
    QVERIFY(comparison.position.front().rms_to_best_low90 > 0.0);
  }

  void swappedErrorsAreAsGoodAsEachOther() {
    // The two methods err alike with places swapped in pairs: no difference, and the interval is the same both ways.
    std::mt19937_64 generator(4);
    std::uniform_real_distribution<double> uniform(0.5, 3.0);
    std::vector<double> a;
    std::vector<double> b;
    for (int i = 0; i < 40; ++i) {
      const double x = uniform(generator);
      const double y = uniform(generator);
      a.insert(a.end(), {x, y});
      b.insert(b.end(), {y, x});
    }
    const PairedDifference ab = pairedDifference(a, b);
    FT_VERIFY_MATCH(near(ab.difference, 0.0, 1e-12));
    QVERIFY(ab.low90 < 0.0 && ab.high90 > 0.0);
    const PairedDifference ba = pairedDifference(b, a);
    FT_VERIFY_MATCH(near(ba.low90, -ab.high90, 1e-12));
    FT_VERIFY_MATCH(near(ba.high90, -ab.low90, 1e-12));
  }

  void pairingSeesWhatSpreadHides() {
    // One method errs by 0.1 mm more at every place while places differ by several mm.
    std::vector<double> a;
    std::vector<double> b;
    for (int i = 0; i < 60; ++i) {
      a.push_back(1.0 + 0.1 * i);
      b.push_back(1.1 + 0.1 * i);
    }
    const PairedDifference difference = pairedDifference(b, a);
    QVERIFY(difference.low90 > 0.08 && difference.high90 < 0.1);
    QVERIFY(errorStats(a).rms_high90 > errorStats(b).rms_low90);
  }

  void insideAndEdgeAreThoseOfTheGrid() {
    // 5 x 5 x 5: 27 places have neighbours on all sides.
    const Comparison comparison = compared(bentTable(0.03, 0.0), {{"polynomial", {{"degree", "3"}}}});
    QVERIFY(comparison.verdict.apply_position);
    const MethodScore& best = comparison.position.front();
    std::vector<double> inside;
    std::vector<double> edge;
    for (std::size_t i = 0; i < comparison.places.size(); ++i) {
      const int node = comparison.places[i];
      const auto is_inner = [](int level) { return level > 0 && level < 4; };
      const bool is_inside = is_inner(node % 5) && is_inner(node / 5 % 5) && is_inner(node / 25);
      (is_inside ? inside : edge).push_back(best.place_errors[i]);
    }
    QCOMPARE(inside.size(), std::size_t{27});
    FT_VERIFY_MATCH(near(comparison.verdict.inside_mm.value(), rms(inside), 1e-9));
    FT_VERIFY_MATCH(near(comparison.verdict.edge_mm.value(), rms(edge), 1e-9));
    const auto worst = std::max_element(best.place_errors.begin(), best.place_errors.end());
    FT_VERIFY_MATCH(near(comparison.verdict.worst_mm, *worst, 0.0));
    QCOMPARE(comparison.verdict.worst_node,
             comparison.places[static_cast<std::size_t>(worst - best.place_errors.begin())]);
    FT_VERIFY_MATCH(holdsAll(comparison.verdict.text, {"Apply Polynomial", "expect ", "mm inside the region and ",
                                                       "mm near its edge", "mm at worst (", "limited by "}));
  }

  void outermostPlacesOfABoard() {
    SyntheticOptions options;
    options.counts = {4, 4, 1};
    options.reference_from_tracker = {{0, 0, 0}, rotationFromVector({0.2, 0.5, 0.1})};
    const CalibrationTable table = syntheticTable(options);
    std::vector<int> places;
    for (const Node& node : table.nodes) places.push_back(node.node);
    const std::vector<bool> is_outermost = outermostPlaces(table.nodes, table.nodes, places);
    QCOMPARE(std::count(is_outermost.begin(), is_outermost.end(), false), 4);
    for (const std::size_t inner : {5U, 6U, 9U, 10U}) QVERIFY(!is_outermost[inner]);
  }

  void aGoodCorrectionIsLimitedByTheJig() {
    // 5 mm a place and axis: after the smooth part is gone, 8.7 mm are left, and the floor says so.
    const Comparison comparison = compared(bentTable(0.04, 0.005, {7, 7, 7}), {{"polynomial", {{"degree", "4"}}}});
    QVERIFY(comparison.verdict.apply_position);
    FT_VERIFY_MATCH(near(comparison.floor_position_mm, 5.0 * std::sqrt(3.0), 1e-9));
    FT_VERIFY_MATCH(
        holdsAll(comparison.verdict.limited_by, {"how exactly the places themselves are known", "jig tolerance"}));
  }

  void oneWrongPlaceIsNamed() {
    CalibrationTable table = bentTable(0.03, 0.0);
    table.nodes[62].reference_from_sensor.position_m.z() += 0.04;  // The middle place.
    const Comparison comparison = compared(table, {{"polynomial", {{"degree", "3"}}}});
    QCOMPARE(comparison.verdict.worst_node, table.nodes[62].node);
    FT_VERIFY_MATCH(holdsAll(comparison.verdict.limited_by, {"C3, pipe 3 alone"}));
  }

  void morePlacesWouldHelpWhereTheFieldIsCoarselySampled() {
    // A wave over the grid, hardly any noise, and no more places than needed: hmq interpolates, and half the places do
    // much worse. The edge is made as good as the inside by judging inner places only.
    CalibrationTable table = bentTable(0.05, 0.0, {6, 6, 6});
    for (Node& node : table.nodes) {
      const auto is_inner = [](int level) { return level > 0 && level < 5; };
      if (is_inner((*node.index)[0]) && is_inner((*node.index)[1]) && is_inner((*node.index)[2]) &&
          ((*node.index)[0] + (*node.index)[1] + (*node.index)[2]) % 3 == 0)
        node.role = NodeRole::kValidation;
    }
    const Comparison comparison = compared(table, {{"hmq", {}}});
    QVERIFY(comparison.verdict.apply_position && !comparison.verdict.edge_mm);
    FT_VERIFY_MATCH(holdsAll(comparison.verdict.limited_by, {"detail of the field", "more places would help"}));
  }

  void readingsTurnedInsideOutAreNotApplied_data() {
    QTest::addColumn<int>("slip");
    QTest::newRow("two axes swapped") << 0;
    QTest::newRow("one axis mirrored") << 1;
    QTest::newRow("readings at other places") << 2;
  }
  void readingsTurnedInsideOutAreNotApplied() {
    QFETCH(int, slip);
    CalibrationTable table = bentTable(0.03, 0.0);
    FT_VERIFY_MATCH(holdsAll(compared(table, {{"affine", {}}}).verdict.text, {"Apply Affine"}));
    if (slip == 2) {
      std::vector<Pose> readings;
      for (const Node& node : table.nodes) readings.push_back(node.tracker_from_sensor);
      std::shuffle(readings.begin(), readings.end(), std::mt19937_64(5));
      // Some places keep their reading, so that a method finds something to gain.
      for (std::size_t i = 0; i < table.nodes.size(); ++i)
        if (i % 3 != 0) table.nodes[i].tracker_from_sensor = readings[i];
    }
    for (Node& node : table.nodes) {
      Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
      if (slip == 0) std::swap(p_m.x(), p_m.y());
      if (slip == 1) p_m.z() *= -1.0;
    }
    const Comparison comparison = compared(table, {{"none", {}}, {"affine", {}}});
    const Verdict& verdict = comparison.verdict;
    QVERIFY2(!verdict.apply_position && !verdict.apply_orientation && verdict.is_inside_out, verdict.text.c_str());
    const QByteArray why = slip == 2 ? "the readings are turned inside out in " : "the readings are a mirror image";
    FT_VERIFY_MATCH(
        holdsAll(verdict.text, {"Do not apply: Affine would take the error from ", "but " + why,
                                slip == 2 ? "axes are swapped or mirrored, readings stand at places that are "
                                            "not theirs"
                                          : "an axis has the wrong sign, or two are exchanged"}));
    QVERIFY(toJson(comparison).at("verdict").at("inside_out") == true);
    QVERIFY(toJson(comparison).at("verdict").at("mirrored").is_string() == (slip != 2));
    FT_VERIFY_MATCH(
        holdsAll(compared(table, {{"none", {}}}).verdict.text, {"Do not apply: " + why, "no method does better"}));
    // Held out, the correction of swapped axes looks splendid: nothing but the fold tells.
    QVERIFY(slip == 2 || verdict.position.gain > 0.9);
    QVERIFY(!verdict.position.apply);
  }

  void aCorrectionThatFoldsByItselfIsNoFaultOfTheReadings_data() {
    QTest::addColumn<bool>("in_a_grid");
    QTest::newRow("grid") << true;
    QTest::newRow("no grid") << false;
  }
  void aCorrectionThatFoldsByItselfIsNoFaultOfTheReadings() {
    QFETCH(bool, in_a_grid);
    // Over 0.6 m readings are x - 0.97 / k sin(k x), k one wave: their determinant is 1 - 0.97 cos(k x), 0.03 at least.
    // Seven columns do not tell how steeply the place follows the reading at either face.
    SyntheticOptions options;
    options.counts = {7, 7, 7};
    options.pitch_m = Eigen::Vector3d::Constant(0.1);
    CalibrationTable table = syntheticTable(options);
    const double x_low_m = table.nodes.front().reference_from_sensor.position_m.x();
    if (!in_a_grid) scatter(table);
    for (Node& node : table.nodes) {
      const double k = 2.0 * 3.14159265358979 / 0.6;
      node.tracker_from_sensor = node.reference_from_sensor;
      Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
      p_m.x() -= 0.97 / k * std::sin(k * (p_m.x() - x_low_m));
    }
    table.metadata.jig_tolerance_m = 5e-5;
    const Comparison comparison = compared(table, {{"affine", {}}, {"rbf", {}}});
    const Verdict& verdict = comparison.verdict;
    QVERIFY2(verdict.is_folding && !verdict.is_inside_out && !verdict.apply_position, verdict.text.c_str());
    FT_VERIFY_MATCH(
        holdsAll(verdict.text, {"but the correction folds back at ", "different readings go to one place"}));
    QVERIFY2(verdict.text.find("inside out") == std::string::npos, verdict.text.c_str());
    const FoldBack& fold_back = *comparison.fold_back;
    QVERIFY(foldsByItself(fold_back) && *fold_back.smallest_correction_determinant < 0.0);
    QCOMPARE(fold_back.smallest_determinant.has_value(), in_a_grid);
    // Of a cell of the first column: (0.1 - 0.97 / k sin(2 pi / 6)) / 0.1.
    if (in_a_grid) FT_VERIFY_MATCH(near(*fold_back.smallest_determinant, 0.1978, 1e-3));
    const auto json = toJson(comparison);
    QVERIFY(json.at("verdict").at("folding") == true && json.at("verdict").at("inside_out") == false);
  }

  void readingsAtOtherPlacesAreToldWithoutAGridToo() {
    CalibrationTable table = bentTable(0.03, 0.0);
    std::vector<Pose> readings;
    scatter(table);
    for (const Node& node : table.nodes) readings.push_back(node.tracker_from_sensor);
    QVERIFY(!compared(table, {{"affine", {}}}).verdict.is_inside_out);
    std::shuffle(readings.begin(), readings.end(), std::mt19937_64(5));
    for (std::size_t i = 0; i < table.nodes.size(); ++i)
      if (i % 3 != 0) table.nodes[i].tracker_from_sensor = readings[i];
    const Verdict verdict = compared(table, {{"none", {}}, {"affine", {}}}).verdict;
    QVERIFY2(verdict.is_inside_out && !verdict.apply_position, verdict.text.c_str());
    FT_VERIFY_MATCH(holdsAll(verdict.text, {"the readings are turned inside out around ", " of 125 places"}));
  }

  void aRigMovedOnTheWayIsNotApplied() {
    // 30 mm of smooth error; from the middle layer on the tracker says 1 m less in height, so that layers change
    // places.
    CalibrationTable table = bentTable(0.03, 0.0, {5, 5, 4});
    for (std::size_t i = table.nodes.size() / 2; i < table.nodes.size(); ++i)
      table.nodes[i].tracker_from_sensor.position_m.z() -= 1.0;
    const Comparison comparison = compared(table, {{"none", {}}, {"gaussian_process", {}}});
    QVERIFY2(!comparison.verdict.apply_position, comparison.verdict.text.c_str());
  }

  void repeatedPlacesAreHeldOutTogether() {
    // Nothing but seating noise, and each reading twice, under two numbers: a fit that sees one of the two foretells
    // the other, and nothing else.
    CalibrationTable table = bentTable(0.0, 0.003);
    const std::size_t n_places = table.nodes.size();
    for (std::size_t i = 0; i < n_places; ++i) {
      Node again = table.nodes[i];
      again.node += 1000;
      again.tracker_from_sensor.position_m.x() += 5e-5;
      table.nodes.push_back(again);
    }
    const std::vector<MethodText> methods{{"none", {}}, {"rbf", {}}, {"gaussian_process", {}}};
    const Comparison comparison = compared(table, methods);
    QVERIFY2(!comparison.verdict.apply_position, comparison.verdict.text.c_str());
    QCOMPARE(comparison.places.size(), n_places);
    QVERIFY2(std::any_of(comparison.notes.begin(), comparison.notes.end(),
                         [](const std::string& note) {
                           return note.find("125 places have the true position of another") == 0 &&
                                  note.find("counts as one place") != std::string::npos;
                         }),
             comparison.notes.empty() ? "no note" : comparison.notes.front().c_str());
    // Nor does a role make another place of them.
    for (std::size_t i = n_places; i < table.nodes.size(); ++i) table.nodes[i].role = NodeRole::kValidation;
    ComparisonOptions options;
    options.position_methods = methods;
    const auto by_role = compareMethods(table, options);
    QVERIFY(!by_role);
    FT_VERIFY_MATCH(holdsAll(by_role.error().message, {"whose rows are all for fitting", "have the true position"}));
    // Neighbours 20 cm apart are places of their own.
    for (const std::string& note : compared(bentTable(0.03, 0.0), {{"none", {}}}).notes)
      QVERIFY2(note.find("true position of another") == std::string::npos, note.c_str());
  }

  void aCornerDoesNotStandForTheRegion() {
    CalibrationTable table = bentTable(0.03, 0.0, {6, 6, 6});
    const auto told = [&] { return compared(table, {{"polynomial", {{"degree", "3"}}}}).verdict.text; };
    for (Node& node : table.nodes)
      node.role = (*node.index)[0] + (*node.index)[1] + (*node.index)[2] <= 2 ? NodeRole::kValidation : NodeRole::kFit;
    // Levels 0 to 2 of 0 to 5, along three axes: (2/5)^3.
    FT_VERIFY_MATCH(holdsAll(told(), {"places the fits did not see, which span only 6.4 % of the region"}));
    for (Node& node : table.nodes) node.role = node.node % 3 == 0 ? NodeRole::kValidation : NodeRole::kFit;
    QVERIFY2(told().find("span only") == std::string::npos, told().c_str());
  }

  void aFloorAboveWhatIsLeftIsTold() {
    CalibrationTable table = bentTable(0.03, 0.0);
    const auto toldOf = [](const Comparison& comparison) {
      return std::count_if(comparison.notes.begin(), comparison.notes.end(),
                           [](const std::string& note) { return note.find("another unit") != std::string::npos; });
    };
    QCOMPARE(toldOf(compared(table, {{"polynomial", {{"degree", "4"}}}})), 0);
    // 0.03 mm an axis written as 0.03 m.
    for (Node& node : table.nodes) node.covariance_m2 = Eigen::Matrix3d(9e-4 * Eigen::Matrix3d::Identity());
    const Comparison comparison = compared(table, {{"polynomial", {{"degree", "4"}}}});
    QVERIFY2(toldOf(comparison) == 1, std::to_string(comparison.floor_position_mm).c_str());
  }

  void truenessIsWhatTheFloorDoesNotExplain() {
    FT_VERIFY_MATCH(near(excessError(5.0, 3.0), 4.0, 1e-12));
    FT_VERIFY_MATCH(near(excessError(3.0, 5.0), 0.0, 0.0));
    const Comparison comparison = compared(bentTable(0.03, 0.002), {{"none", {}}, {"hmq", {}}});
    const double floor_mm = 2.0 * std::sqrt(3.0);
    const double before_mm = comparison.before_position_mm.rms;
    FT_VERIFY_MATCH(
        near(comparison.trueness.before_position_mm, std::sqrt(before_mm * before_mm - floor_mm * floor_mm), 1e-9));
    const nlohmann::json json = nlohmann::json::parse(toJson(comparison).dump());
    QVERIFY(json.at("trueness").at("before").at("position_mm").is_number());
    QVERIFY(json.at("trueness").at("after").at("position_mm") < json.at("trueness").at("before").at("position_mm"));
    // The table states no tolerance of orientation and no noise: nothing is known apart.
    QVERIFY(json.at("trueness").at("before").at("orientation_deg").is_null());
  }

  void surroundingsAreToldOnlyWhenAskedFor() {
    ComparisonOptions options;
    options.position_methods = {{"none", {}}, {"affine", {}}};
    options.with_surroundings = false;
    const auto bare = compareMethods(bentTable(0.03, 0.0), options);
    FT_VERIFY_OK(bare);
    const nlohmann::json without = toJson(*bare);
    for (const char* key :
         {"coverage", "fold_back", "orientation_cover", "position_dependence", "orientation_dependence"})
      QVERIFY2(without.at(key).is_null(), key);
    options.with_surroundings = true;
    const auto whole = compareMethods(bentTable(0.03, 0.0), options);
    FT_VERIFY_OK(whole);
    const nlohmann::json with = toJson(*whole);
    for (const char* key :
         {"coverage", "fold_back", "orientation_cover", "position_dependence", "orientation_dependence"})
      QVERIFY2(with.at(key).is_object(), key);
    QCOMPARE(with.at("resampling").size(), std::size_t{3});
    for (const char* key : {"method", "rms_mm", "excess_mm", "n_scored", "n_without_support"})
      QVERIFY2(with.at("resampling").at(0).contains(key), key);
    for (const char* key : {"rms_to_best", "rms_to_best_low90", "rms_to_best_high90", "n_folds", "closed_form"})
      QVERIFY2(with.at("position").at(0).contains(key), key);
    for (const char* key : {"inside_mm", "edge_mm", "worst_place", "worst_mm", "limited_by"})
      QVERIFY2(with.at("verdict").contains(key), key);
    // The scores themselves are the same.
    for (std::size_t i = 0; i < 2; ++i) QCOMPARE(whole->position[i].place_errors, bare->position[i].place_errors);
  }
};

FIELDTRUE_TEST(VerdictTest)
#include "verdict_test.moc"
