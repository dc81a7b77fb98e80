#include "calib/calibration/resampled_table.h"

#include <QTest>
#include <cmath>

#include "calib/calibration/alignment.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::calibration;
using namespace fieldtrue::testing;

namespace {

const Pose kRoomFromTracker{{0.5, -1.0, 0.8}, rotationFromVector({0.2, -0.4, 1.1})};

/// Nodes of a 3x3x3 grid that lies between the places of syntheticTable, and one far outside.
std::vector<PlannedPlace> grid() {
  std::vector<PlannedPlace> places;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        PlannedPlace place;
        place.node = static_cast<int>(places.size());
        place.index = std::array<int, 3>{i, j, k};
        place.reference_from_sensor.position_m = {0.45 + 0.2 * i, -0.25 + 0.2 * j, -0.15 + 0.13 * k};
        places.push_back(place);
      }
  places.push_back(places.back());
  places.back().node = 99;
  places.back().index.reset();
  places.back().reference_from_sensor.position_m = {3.0, 0.0, 0.0};
  return places;
}

correctors::RegridOptions how(correctors::RegridMethod method) { return {method, 0.2, 1.0}; }

}  // namespace

class ResampledTableTest : public QObject {
  Q_OBJECT
 private slots:
  void aRigidTableStaysRigidInItsOwnFrame_data() {
    QTest::addColumn<int>("method");
    for (const correctors::RegridMethod method :
         {correctors::RegridMethod::kBriggs, correctors::RegridMethod::kLivingston,
          correctors::RegridMethod::kCzernuszenko})
      QTest::newRow(correctors::regridMethodId(method).c_str()) << static_cast<int>(method);
  }
  void aRigidTableStaysRigidInItsOwnFrame() {
    QFETCH(int, method);
    SyntheticOptions options;
    options.reference_from_tracker = kRoomFromTracker;
    const CalibrationTable table = syntheticTable(options);
    std::vector<PlannedPlace> places = grid();
    for (PlannedPlace& place : places)
      place.reference_from_sensor.position_m = inverse(kRoomFromTracker) * place.reference_from_sensor.position_m;
    const auto resampled =
        resampleTable(table, places, how(static_cast<correctors::RegridMethod>(method)), AlignMode::kRigid);
    FT_VERIFY_OK(resampled);
    QCOMPARE(resampled->n_without_support, std::size_t{1});
    QCOMPARE(resampled->table.nodes.size(), std::size_t{28});
    QCOMPARE(resampled->table.metadata.frame, table.metadata.frame);
    QVERIFY(resampled->table.metadata.alignment_known == table.metadata.alignment_known);
    QCOMPARE(resampled->table.metadata.other.at("resampled"),
             correctors::regridMethodId(static_cast<correctors::RegridMethod>(method)));
    FT_VERIFY_MATCH(near(resampled->error.rms_mm, 0.0, 1e-9));
    for (std::size_t i = 0; i < 27; ++i) {
      const Node& node = resampled->table.nodes[i];
      QCOMPARE(node.node, places[i].node);
      QVERIFY(node.index == places[i].index && node.role == NodeRole::kFit);
      const Eigen::Vector3d p_m = places[i].reference_from_sensor.position_m;
      for (int axis = 0; axis < 3; ++axis)
        FT_VERIFY_MATCH(sameBits(node.tracker_from_sensor.position_m[axis], p_m[axis]));
      FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m, kRoomFromTracker * p_m, 1e-12));
    }
    QVERIFY(resampled->table.nodes.back().role == NodeRole::kSkipped);
  }

  void interpolatesByTheWeights() {
    // Known alignment: the displacement at a node is the weighted mean of those of the places, nothing else.
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    CalibrationTable table = syntheticTable(options);
    table.metadata.alignment_known = true;
    for (Node& node : table.nodes) node.covariance_m2 = 4e-6 * Eigen::Matrix3d::Identity();
    const std::vector<PlannedPlace> places = grid();
    const auto resampled = resampleTable(table, places, how(correctors::RegridMethod::kBriggs), AlignMode::kNone);
    FT_VERIFY_OK(resampled);
    std::vector<Eigen::Vector3d> p_tracked_m;
    for (const Node& node : table.nodes) p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    for (std::size_t i = 0; i < 27; ++i) {
      const Eigen::Vector3d p_m = places[i].reference_from_sensor.position_m;
      const auto weights =
          correctors::regridWeights(p_tracked_m, std::span(&p_m, 1), how(correctors::RegridMethod::kBriggs));
      Eigen::Vector3d expected_m = p_m;
      double squares = 0.0;
      for (const correctors::RegridWeight& w : weights.front()) {
        expected_m += w.weight * (table.nodes[w.place].reference_from_sensor.position_m - p_tracked_m[w.place]);
        squares += w.weight * w.weight;
      }
      const Node& node = resampled->table.nodes[i];
      FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m, expected_m, 1e-14));
      // Independent noise of 2 mm a place through weights w: 2 mm times the root of the sum of w^2.
      QVERIFY(node.covariance_m2.has_value());
      FT_VERIFY_MATCH(near((*node.covariance_m2)(1, 1), 4e-6 * squares / table.nodes[0].n_effective, 1e-12));
    }
    QVERIFY(!resampled->table.nodes.back().covariance_m2);
    QVERIFY(resampled->error.n_scored > 10 && resampled->error.rms_mm > 0.1);
  }

  void orientationErrorsAreBroughtAlong() {
    // One error rotation everywhere comes out everywhere, seen through an alignment and at the rows' true orientation.
    const Eigen::Quaterniond q_error = rotationFromVector({0.05, -0.1, 0.02});
    const Eigen::Quaterniond q_true = rotationFromVector({0.7, 0.2, -1.0});
    CalibrationTable table = syntheticTable();
    table.metadata.alignment_known = true;
    for (Node& node : table.nodes) {
      node.reference_from_sensor.orientation = q_true;
      node.tracker_from_sensor.orientation = q_error * q_true;
      node.sd_rot_rad = 0.001;
    }
    const auto resampled = resampleTable(table, grid(), how(correctors::RegridMethod::kLivingston), AlignMode::kNone);
    FT_VERIFY_OK(resampled);
    QCOMPARE(resampled->table.metadata.other.at("resampled_width_pitches"), std::string("1"));
    for (std::size_t i = 0; i < 27; ++i) {
      const Node& node = resampled->table.nodes[i];
      QVERIFY(node.has_orientation && node.sd_rot_rad && *node.sd_rot_rad > 0.0 && *node.sd_rot_rad < 0.001);
      FT_VERIFY_MATCH(near(node.reference_from_sensor.orientation, q_true, 1e-12));
      FT_VERIFY_MATCH(near(node.tracker_from_sensor.orientation, q_error * q_true, 1e-12));
    }
  }

  void rowsWithoutOrientationGivePositionsOnly() {
    SyntheticOptions options;
    options.has_orientation = false;
    const auto resampled =
        resampleTable(syntheticTable(options), grid(), how(correctors::RegridMethod::kBriggs), AlignMode::kRigid);
    FT_VERIFY_OK(resampled);
    for (const Node& node : resampled->table.nodes) QVERIFY(!node.has_orientation);
  }

  /// Every row twice under another number: no place is foretold by its own repetition.
  void aRepeatedPlaceIsOnePlace() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    const CalibrationTable once = syntheticTable(options);
    CalibrationTable twice = once;
    for (Node node : once.nodes) {
      node.node += 1000;
      twice.nodes.push_back(node);
    }
    const auto method = how(correctors::RegridMethod::kBriggs);
    const auto expected = resampleTable(once, grid(), method, AlignMode::kRigid);
    const auto resampled = resampleTable(twice, grid(), method, AlignMode::kRigid);
    FT_VERIFY_OK(expected);
    FT_VERIFY_OK(resampled);
    QCOMPARE(resampled->error.n_scored, expected->error.n_scored);
    QVERIFY(expected->error.rms_mm > 0.1);
    FT_VERIFY_MATCH(near(resampled->error.rms_mm, expected->error.rms_mm, 1e-9));
    FT_VERIFY_MATCH(holdsAll(resampled->note, {"100 places", "one place"}));
    QVERIFY(expected->note.empty());
  }

  void whatCannotBeDoneIsSaid() {
    std::vector<PlannedPlace> far_away = grid();
    for (PlannedPlace& place : far_away) place.reference_from_sensor.position_m.x() += 10.0;
    const auto outside =
        resampleTable(syntheticTable(), far_away, how(correctors::RegridMethod::kBriggs), AlignMode::kRigid);
    QVERIFY(!outside && outside.error().code == ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(holdsAll(outside.error().message, {"None of the 28 grid nodes", "100 measured places"}));
    CalibrationTable skipped = syntheticTable();
    for (Node& node : skipped.nodes) node.role = NodeRole::kSkipped;
    const auto nothing = resampleTable(skipped, grid(), how(correctors::RegridMethod::kBriggs), AlignMode::kRigid);
    QVERIFY(!nothing && nothing.error().code == ErrorCode::kTooFewNodes);
  }
};

FIELDTRUE_TEST(ResampledTableTest)
#include "resampled_table_test.moc"
