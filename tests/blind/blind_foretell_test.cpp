#include <QTest>

#include "tests/blind/bare_alignment.h"
#include "tests/support/test_main.h"

using namespace blind;

namespace {

SolvedPose drawnPose(Random& random, double reach_m) {
  return {Vector3d(uniform(random, -reach_m, reach_m), uniform(random, -reach_m, reach_m),
                   uniform(random, -reach_m, reach_m)),
          rotation(random)};
}

/// Rows that a tracker without any fault reports: T * (place on the rig) * M.
SessionTable readings(const BareAlignment& truth, bool has_orientation, Random& random) {
  SessionTable table;
  table.metadata = {"# alignment: unknown", "# jig_tolerance_m: 0.001", "# jig_tolerance_rad: 0.002"};
  table.columns = {"x_true_m", "y_true_m", "z_true_m", "qw_true", "qx_true", "qy_true", "qz_true",
                   "x_m",      "y_m",      "z_m",      "sd_x_m",  "sd_y_m",  "sd_z_m",  "n_effective"};
  if (has_orientation) table.columns.insert(table.columns.end(), {"qw", "qx", "qy", "qz", "sd_rot_rad"});
  for (int i = 0; i < 40; ++i) {
    const SolvedPose place = drawnPose(random, 1.0);
    const SolvedPose tracked = truth.reported(place);
    std::vector<double> numbers = {place.position_m.x(),
                                   place.position_m.y(),
                                   place.position_m.z(),
                                   place.orientation.w(),
                                   place.orientation.x(),
                                   place.orientation.y(),
                                   place.orientation.z(),
                                   tracked.position_m.x(),
                                   tracked.position_m.y(),
                                   tracked.position_m.z(),
                                   1e-4,
                                   1e-4,
                                   1e-4,
                                   20.0};
    if (has_orientation)
      numbers.insert(numbers.end(), {tracked.orientation.w(), tracked.orientation.x(), tracked.orientation.y(),
                                     tracked.orientation.z(), 1e-3});
    std::vector<std::string> row;
    for (const double number : numbers) row.push_back(exactText(number));
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace

class BlindForetellTest : public QObject {
  Q_OBJECT
 private slots:
  /// Transform and mount of a tracker without fault are found, whatever they are.
  void findsTransformAndMount_data();
  void findsTransformAndMount();
  /// Where the table says that both are known, no reading moves them.
  void leavesWhatIsKnown();
};

void BlindForetellTest::findsTransformAndMount_data() {
  QTest::addColumn<bool>("has_orientation");
  QTest::newRow("poses") << true;
  QTest::newRow("positions") << false;
}

void BlindForetellTest::findsTransformAndMount() {
  QFETCH(bool, has_orientation);
  Random random(3);
  for (int round = 0; round < 5; ++round) {
    BareAlignment truth{drawnPose(random, 2.0), drawnPose(random, 0.1)};
    if (!has_orientation) truth.mount_from_sensor.orientation = Quaterniond::Identity();
    const BareAlignment found = bareAlignment(readings(truth, has_orientation, random));
    const SolvedPose place = drawnPose(random, 1.0);
    const SolvedPose wanted = truth.reported(place), got = found.reported(place);
    QVERIFY2((wanted.position_m - got.position_m).norm() < 1e-7, "position");
    if (has_orientation) QVERIFY2(rotationBetween(wanted.orientation, got.orientation).norm() < 1e-7, "rotation");
  }
}

void BlindForetellTest::leavesWhatIsKnown() {
  Random random(4);
  const BareAlignment truth{{Vector3d(0.05, 0, 0), Quaterniond::Identity()}, {}};
  SessionTable table = readings(truth, true, random);
  table.metadata = {"# alignment: known", "# jig_tolerance_m: 0.001", "# jig_tolerance_rad: 0.002"};
  QCOMPARE(bareAlignment(table).tracker_from_jig.position_m.norm(), 0.0);
}

FIELDTRUE_TEST(BlindForetellTest)
#include "blind_foretell_test.moc"
