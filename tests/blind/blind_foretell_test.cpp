#include <QTest>

#include "tests/blind/bare_alignment.h"
#include "tests/blind/made_readings.h"
#include "tests/support/test_main.h"

using namespace blind;

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
