#include "calib/calibration/corrector.h"

#include <QTest>
#include <cmath>
#include <limits>

#include "calib/calibration/alignment.h"
#include "calib/core/place_name.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::calibration;
using namespace fieldtrue::testing;

namespace {

const Pose kReferenceFromTracker{{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
const Eigen::Quaterniond kMounting = rotationFromVector({-0.4, 0.9, 0.2});

/// A table whose rig frame is turned and whose sensor is turned in its holder.
CalibrationTable alignedTable(const SyntheticOptions& given = {}) {
  SyntheticOptions options = given;
  options.reference_from_tracker = kReferenceFromTracker;
  CalibrationTable table = syntheticTable(options);
  for (Node& node : table.nodes)
    node.reference_from_sensor.orientation = node.reference_from_sensor.orientation * kMounting;
  return table;
}

Corrector fitted(const CalibrationTable& table, const std::string& position, const std::string& orientation = "none",
                 AlignMode align = AlignMode::kRigid) {
  const CorrectorChoice choice = parseCorrectorChoice(position, orientation).value();
  return Corrector::fit(table.nodes, table.metadata, choice, align).value();
}

/// Five by five places on the plane z = 0.1 of the reference frame.
CalibrationTable flatTable() {
  SyntheticOptions options;
  options.counts = {5, 5, 1};
  options.smooth_distortion_m = 0.01;
  return syntheticTable(options);
}

}  // namespace

class CorrectorTest : public QObject {
  Q_OBJECT
 private slots:
  void repeatedPlacesAreOneWhateverTheirNumbers() {
    // Each place twice, the second time under a number of its own or as a visit more: the same smoothing.
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    SyntheticNoise noise;
    noise.position_sd_m = 0.002;
    const CalibrationTable once = syntheticTable(options, noise);
    noise.seed = 2;
    CalibrationTable as_visits = once, as_places = once;
    for (Node node : syntheticTable(options, noise).nodes) {
      node.visit = 1;
      as_visits.nodes.push_back(node);
      node.visit = 0;
      node.node += 1000;
      as_places.nodes.push_back(node);
    }
    const CorrectorChoice choice = parseCorrectorChoice("bspline", "none").value();
    const auto visits = Corrector::fit(as_visits.nodes, once.metadata, choice, AlignMode::kRigid);
    const auto places = Corrector::fit(as_places.nodes, once.metadata, choice, AlignMode::kRigid);
    FT_VERIFY_OK(visits);
    FT_VERIFY_OK(places);
    FT_VERIFY_MATCH(holdsAll(places->report().notes.front(), {"100 places have the true position of another"}));
    for (const Node& node : once.nodes) {
      const Eigen::Vector3d between_m = node.tracker_from_sensor.position_m + Eigen::Vector3d(0.05, 0.07, 0.03);
      FT_VERIFY_MATCH(near(places->correctPosition_m(between_m), visits->correctPosition_m(between_m), 1e-12));
    }
  }

  void aPolynomialNeedsALevelMoreThanItsDegree() {
    SyntheticOptions options;
    options.counts = {4, 4, 3};
    options.smooth_distortion_m = 0.02;
    const CalibrationTable table = syntheticTable(options);
    const auto fitted = [&](const char* method) {
      return Corrector::fit(table.nodes, table.metadata, parseCorrectorChoice(method, "none").value(),
                            AlignMode::kRigid);
    };
    FT_VERIFY_OK(fitted("polynomial:degree=2"));
    const auto refused = fitted("polynomial:degree=3");
    QVERIFY(!refused);
    FT_VERIFY_MATCH(
        holdsAll(refused.error().message, {"degree 3 needs 4 levels", "along one there are 3: use degree=2"}));
    const auto by_itself = fitted("polynomial:degree=auto");
    FT_VERIFY_OK(by_itself);
    FT_VERIFY_MATCH(holdsAll(by_itself->report().notes.front(), {"1 to 2 were tried"}));
  }

  void alignsUnlessTheTableSaysItIsAligned() {
    TableMetadata metadata;
    QCOMPARE(defaultAlignMode(metadata), AlignMode::kRigid);
    metadata.frame = "tracker";
    QCOMPARE(defaultAlignMode(metadata), AlignMode::kRigid);
    metadata.alignment_known = true;
    QCOMPARE(defaultAlignMode(metadata), AlignMode::kNone);
  }

  void findsTheAlignmentOfAPerfectTracker() {
    SyntheticOptions options;
    options.orientations = 3;
    const auto alignment = fitAlignment(alignedTable(options).nodes, std::nullopt);
    FT_VERIFY_OK(alignment);
    FT_VERIFY_MATCH(near(alignment->reference_from_tracker, kReferenceFromTracker, 1e-9, 1e-9));
    FT_VERIFY_MATCH(near(alignment->sensor_from_mount, kMounting, 1e-9));
  }

  void aMeanErrorOfTheTrackerIsNotMounting() {
    // Every reading is turned by 6 degrees in the tracker frame. Held in several orientations that is no mounting.
    SyntheticOptions options;
    options.orientations = 4;
    CalibrationTable table = alignedTable(options);
    const Eigen::Quaterniond q_error = rotationFromVector({0.05, -0.08, 0.04});
    for (Node& node : table.nodes)
      node.tracker_from_sensor.orientation = q_error * node.tracker_from_sensor.orientation;
    const auto alignment = fitAlignment(table.nodes, std::nullopt);
    FT_VERIFY_OK(alignment);
    FT_VERIFY_MATCH(near(alignment->sensor_from_mount, kMounting, 1e-9));
    // Held in one orientation nothing tells it from mounting, and it counts as such.
    std::erase_if(table.nodes, [](const Node& node) { return node.visit != 0; });
    const auto single = fitAlignment(table.nodes, std::nullopt);
    FT_VERIFY_OK(single);
    for (const Node& node : table.nodes)
      FT_VERIFY_MATCH(near(
          single->reference_from_tracker.orientation * node.tracker_from_sensor.orientation * single->sensor_from_mount,
          node.reference_from_sensor.orientation, 1e-9));
  }

  void mountingIsUnityWithoutOrientations() {
    SyntheticOptions options;
    options.has_orientation = false;
    const auto alignment = fitAlignment(alignedTable(options).nodes, std::nullopt);
    FT_VERIFY_OK(alignment);
    FT_VERIFY_MATCH(near(alignment->sensor_from_mount, Eigen::Quaterniond::Identity(), 0.0));
  }

  void bringsTheTruthToTheTrackerFrame() {
    const CalibrationTable table = alignedTable();
    const correctors::FitData data = makeFitData(table.nodes, table.metadata, {kReferenceFromTracker, kMounting, {}});
    QCOMPARE(data.size(), table.nodes.size());
    QVERIFY(data.hasOrientation());
    QCOMPARE(data.dimension, 3);
    // A perfect tracker: truth in its frame is what it reported.
    for (std::size_t i = 0; i < data.size(); ++i) {
      FT_VERIFY_MATCH(near(data.p_true_m[i], data.p_tracked_m[i], 1e-12));
      FT_VERIFY_MATCH(near(data.q_true[i], data.q_tracked[i], 1e-9));
      QCOMPARE(data.node[i], table.nodes[i].node);
    }
  }

  void oneRowWithoutOrientationLeavesNone() {
    CalibrationTable table = alignedTable();
    table.nodes[3].has_orientation = false;
    QVERIFY(!makeFitData(table.nodes, table.metadata, {}).hasOrientation());
    const auto corrector =
        Corrector::fit(table.nodes, table.metadata, parseCorrectorChoice("none", "rigid").value(), AlignMode::kRigid);
    QVERIFY(!corrector);
    QCOMPARE(corrector.error().code, ErrorCode::kUnsupported);
  }

  void dimensionIsThatOfTheTruePositions() {
    CalibrationTable table = flatTable();
    // Tracked positions far from flat, true ones flat.
    for (std::size_t i = 0; i < table.nodes.size(); ++i)
      table.nodes[i].tracker_from_sensor.position_m.z() += 0.05 * std::sin(static_cast<double>(i));
    QCOMPARE(makeFitData(table.nodes, table.metadata, {}).dimension, 2);
    // Places shifted up and down by turns: the SD across is the shift.
    const double longest_sd_m = pointSpread(makeFitData(table.nodes, table.metadata, {}).p_true_m).sd_m[0];
    for (const auto& [share, dimension] : {std::pair{0.005, 2}, std::pair{0.02, 3}}) {
      CalibrationTable thick = table;
      for (std::size_t i = 0; i < thick.nodes.size(); ++i)
        thick.nodes[i].reference_from_sensor.position_m.z() += (i % 2 == 0 ? share : -share) * longest_sd_m;
      QCOMPARE(makeFitData(thick.nodes, thick.metadata, {}).dimension, dimension);
    }
  }

  void correctsIntoTheFrameOfTheTruth_data() {
    QTest::addColumn<QString>("align");
    QTest::newRow("alignment fitted") << "rigid";
    QTest::newRow("alignment left to the affine fit") << "none";
  }
  void correctsIntoTheFrameOfTheTruth() {
    QFETCH(QString, align);
    SyntheticOptions options;
    options.affine << 0.01, 0.02, 0.0, -0.01, 0.03, 0.01, 0.0, 0.02, -0.02;
    const CalibrationTable table = alignedTable(options);
    const Corrector corrector =
        fitted(table, "affine", "none", align == "rigid" ? AlignMode::kRigid : AlignMode::kNone);
    for (const Node& node : table.nodes)
      FT_VERIFY_MATCH(
          near(corrector.correct(node.tracker_from_sensor).position_m, node.reference_from_sensor.position_m, 1e-9));
    QVERIFY(corrector.report().rms_m < 1e-9);
    QCOMPARE(corrector.report().n_nodes, table.nodes.size());
  }

  void correctsOrientationsIntoTheFrameOfTheTruth() {
    SyntheticOptions options;
    options.orientation_error_rad = 0.1;
    options.orientations = 2;
    const CalibrationTable table = alignedTable(options);
    const Corrector corrector = fitted(table, "none", "hmq_matrix");
    for (const Node& node : table.nodes)
      FT_VERIFY_MATCH(
          near(corrector.correct(node.tracker_from_sensor).orientation, node.reference_from_sensor.orientation, 1e-6));
  }

  void reportsErrorsAfterTheAlignmentAlone() {
    // By hand: with `none`, before and after are both the residual of the rigid fit.
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    const CalibrationTable table = alignedTable(options);
    const Alignment alignment = fitAlignment(table.nodes, std::nullopt).value();
    double squares_m2 = 0.0;
    double largest_m = 0.0;
    for (const Node& node : table.nodes) {
      const double error_m = (alignment.reference_from_tracker * node.tracker_from_sensor.position_m -
                              node.reference_from_sensor.position_m)
                                 .norm();
      squares_m2 += error_m * error_m;
      largest_m = std::max(largest_m, error_m);
    }
    const double rms_m = std::sqrt(squares_m2 / static_cast<double>(table.nodes.size()));
    const FitReport report = fitted(table, "none").report();
    FT_VERIFY_MATCH(near(report.rms_before_mm, 1000.0 * rms_m, 1e-9));
    FT_VERIFY_MATCH(near(report.rms_m, rms_m, 1e-12));
    FT_VERIFY_MATCH(near(report.max_m, largest_m, 1e-12));
    QVERIFY(report.rms_m > 0.001);
  }

  void batchGivesTheBitsOfSingles() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    options.orientation_error_rad = 0.1;
    const CalibrationTable table = alignedTable(options);
    for (const std::string position : {"none", "rigid", "affine", "polynomial", "hmq"}) {
      const Corrector corrector = fitted(table, position, "polynomial_quaternion");
      std::vector<Pose> tracked;
      for (const Eigen::Vector3d& p_m : randomPoints(700)) tracked.push_back({p_m, rotationFromVector(p_m)});
      std::vector<Pose> corrected(tracked.size());
      corrector.correct(tracked, corrected);
      for (std::size_t i = 0; i < tracked.size(); ++i) {
        FT_VERIFY_MATCH(sameBits(corrected[i], corrector.correct(tracked[i])));
        FT_VERIFY_MATCH(
            sameBits(Pose{corrector.correctPosition_m(tracked[i].position_m), corrected[i].orientation}, corrected[i]));
      }
    }
  }

  void jacobianIsTheSlopeOfTheCorrection() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    const Corrector corrector = fitted(alignedTable(options), "hmq");
    const Eigen::Vector3d p_m(0.6, 0.0, 0.05);
    Eigen::Matrix3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step_m = 1e-5 * Eigen::Vector3d::Unit(axis);
      slope.col(axis) = (corrector.correctPosition_m(p_m + step_m) - corrector.correctPosition_m(p_m - step_m)) / 2e-5;
    }
    FT_VERIFY_MATCH(near((slope - corrector.jacobian(p_m)).cwiseAbs().maxCoeff(), 0.0, 1e-6));
  }

  void coversWhatWasMeasuredAndNoMore() {
    const CalibrationTable table = syntheticTable();  // Pitch 0.2 m: the margin is a quarter of it, 0.05 m.
    const Corrector corrector = fitted(table, "polynomial");
    Eigen::Vector3d low_m = table.nodes.front().tracker_from_sensor.position_m;
    Eigen::Vector3d high_m = low_m;
    for (const Node& node : table.nodes) {
      QVERIFY(corrector.covers(node.tracker_from_sensor.position_m));
      low_m = low_m.cwiseMin(node.tracker_from_sensor.position_m);
      high_m = high_m.cwiseMax(node.tracker_from_sensor.position_m);
    }
    const Eigen::Vector3d middle_m = 0.5 * (low_m + high_m);
    QVERIFY(corrector.covers(middle_m));
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d p_m = middle_m;
      p_m[axis] = high_m[axis] + 0.049;
      QVERIFY(corrector.covers(p_m));
      p_m[axis] = high_m[axis] + 0.051;
      QVERIFY(!corrector.covers(p_m));
    }
    QVERIFY(!corrector.covers(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())));
  }

  void claimsNothingOffThePlane() {
    const CalibrationTable table = flatTable();
    for (const std::string position : {"rigid", "affine", "polynomial:degree=2", "hmq"}) {
      const Corrector corrector = fitted(table, position);
      QVERIFY(std::any_of(corrector.report().notes.begin(), corrector.report().notes.end(),
                          [](const std::string& note) { return note.find("one plane") != std::string::npos; }));
      const Eigen::Vector3d p_m = table.nodes[12].tracker_from_sensor.position_m;
      QVERIFY(corrector.covers(p_m));
      // The spacing is 0.2 m; the slab around the plane is a quarter of it on either side, and the tracked warp.
      QVERIFY(!corrector.covers(p_m + Eigen::Vector3d(0, 0, 0.08)));
      QVERIFY(!corrector.covers(p_m - Eigen::Vector3d(0, 0, 0.08)));
    }
  }

  void aRowWithoutOrientationIsTold() {
    CalibrationTable table = alignedTable({});
    const auto says = [&table] {
      const Corrector corrector = fitted(table, "affine");
      const std::vector<std::string>& notes = corrector.report().notes;
      return std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
        return note ==
               "1 of 100 rows have no orientation, so that no orientation is used: complete these rows, or leave "
               "them out.";
      });
    };
    QVERIFY(!says());
    table.nodes[7].has_orientation = false;
    QVERIFY(says());
    for (Node& node : table.nodes) node.has_orientation = false;
    QVERIFY(!says());
  }

  void badTablesGiveOneSentence_data() {
    QTest::addColumn<int>("places");
    QTest::addColumn<int>("bad_row");
    QTest::addColumn<QByteArray>("fragment");
    QTest::newRow("no rows") << 0 << -1 << QByteArray("got 0");
    QTest::newRow("two rows") << 2 << -1 << QByteArray("got 2");
    QTest::newRow("one line") << 5 << -1 << QByteArray("one line");
    QTest::newRow("not a number") << 100 << 42 << QByteArray("its name");
  }
  void badTablesGiveOneSentence() {
    QFETCH(int, places);
    QFETCH(int, bad_row);
    QFETCH(QByteArray, fragment);
    SyntheticOptions options;
    if (places == 5) options.counts = {5, 1, 1};
    CalibrationTable table = syntheticTable(options);
    table.nodes.resize(static_cast<std::size_t>(places));
    QByteArray expected = fragment;
    if (bad_row >= 0) {
      Node& bad = table.nodes[static_cast<std::size_t>(bad_row)];
      bad.tracker_from_sensor.position_m.x() = std::numeric_limits<double>::quiet_NaN();
      expected = QByteArray::fromStdString(placeName(bad.node, bad.index)) + " ";
    }
    const auto corrector =
        Corrector::fit(table.nodes, table.metadata, parseCorrectorChoice("affine", "none").value(), AlignMode::kRigid);
    QVERIFY(!corrector);
    FT_VERIFY_MATCH(holdsAll(corrector.error().message, {expected}));
  }

  void choicesAreParsedAndChecked() {
    const auto choice = parseCorrectorChoice("polynomial:degree=5", "hmq_matrix:r2_cm2=50,error_frame=sensor");
    FT_VERIFY_OK(choice);
    QCOMPARE(numberSetting(choice->position_settings, "degree"), 5.0);
    QCOMPARE(numberSetting(choice->orientation_settings, "r2_cm2"), 50.0);
    QCOMPARE(QString::fromStdString(choiceSetting(choice->orientation_settings, "error_frame")), QString("sensor"));
    for (const auto& [position, orientation] :
         {std::pair{"polynomial:degree=7", "none"}, std::pair{"polynomial:grade=2", "none"},
          std::pair{"spline", "none"}, std::pair{"none", "euler"}, std::pair{"", "none"},
          std::pair{"none", "rigid:error_frame=room"}}) {
      const auto bad = parseCorrectorChoice(position, orientation);
      QVERIFY(!bad && bad.error().code == ErrorCode::kBadInput);
    }
  }
};

FIELDTRUE_TEST(CorrectorTest)
#include "corrector_test.moc"
