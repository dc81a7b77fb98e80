#include "calib/recording/recording_change.h"

#include <QTest>
#include <numbers>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

Node reading(int node, const Eigen::Vector3d& position_m, int visit = 0) {
  Node made;
  made.node = node;
  made.visit = visit;
  made.reference_from_sensor.position_m = Eigen::Vector3d(9.0, 9.0, 9.0);
  made.tracker_from_sensor.position_m = position_m;
  return made;
}

CalibrationTable tableOf(std::vector<Node> nodes) {
  CalibrationTable table;
  table.metadata.alignment_known = true;
  table.metadata.jig_tolerance_m = 0.001;
  table.nodes = std::move(nodes);
  return table;
}

}  // namespace

class RecordingChangeTest : public QObject {
  Q_OBJECT

 private slots:
  /// Node 1 was read at x = 0.1 and 0.3 before: its mean, 0.2, is where it now counts as standing. Node 2 is new.
  void takesThePlacesFromBefore() {
    const CalibrationTable before = tableOf({reading(1, {0.1, 0.0, 0.0}), reading(1, {0.3, 0.0, 0.0}, 1)});
    const CalibrationTable now = tableOf({reading(1, {0.5, 0.0, 0.0}), reading(2, {0.7, 0.0, 0.0})});
    const auto change = changeSince(before, now);
    FT_VERIFY_OK(change);
    QCOMPARE(change->nodes.size(), std::size_t{1});
    FT_VERIFY_MATCH(near(change->nodes[0].reference_from_sensor.position_m, Eigen::Vector3d(0.2, 0.0, 0.0), 1e-12));
    FT_VERIFY_MATCH(near(change->nodes[0].tracker_from_sensor.position_m, Eigen::Vector3d(0.5, 0.0, 0.0), 1e-12));
    QVERIFY(!change->metadata.alignment_known);
    FT_VERIFY_MATCH(near(*change->metadata.jig_tolerance_m, 0.001 * std::numbers::sqrt2, 1e-12));
  }

  void leavesOrientationOutWhereEitherHasNone() {
    Node blind = reading(1, {0.1, 0.0, 0.0});
    blind.has_orientation = false;
    const auto change = changeSince(tableOf({blind}), tableOf({reading(1, {0.2, 0.0, 0.0})}));
    FT_VERIFY_OK(change);
    QVERIFY(!change->nodes[0].has_orientation);
  }

  void refusesRecordingsOfOtherPlaces() {
    const auto change = changeSince(tableOf({reading(1, {0.1, 0.0, 0.0})}), tableOf({reading(2, {0.2, 0.0, 0.0})}));
    QVERIFY(!change && change.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(change.error().message, {"No node"}));
  }
};

FIELDTRUE_TEST(RecordingChangeTest)
#include "recording_change_test.moc"
