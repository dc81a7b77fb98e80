#include "calib/exporters/export_subject.h"

#include <QTest>

#include "calib/calibration/alignment.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/exporter.h"
#include "calib/exporters/registry.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/calib/correctors/coil_readings.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::exporters;
using namespace fieldtrue::testing;

namespace {

/// 60 places, each in three orientations, read by a sensor of unequal coils.
CalibrationTable turnedTable() {
  RandomGeometry random(2);
  const std::vector<Eigen::Quaterniond> turns = {random.rotation(), random.rotation(), random.rotation()};
  CalibrationTable table;
  table.metadata.alignment_known = true;
  int number = 0;
  for (const Eigen::Vector3d& at_m : shakenGrid({5, 4, 3}, 0.2, 0.03)) {
    for (std::size_t visit = 0; visit < turns.size(); ++visit) {
      Node node;
      node.node = number;
      node.visit = static_cast<int>(visit);
      node.reference_from_sensor = {at_m + Eigen::Vector3d(0.5, 0.0, 0.0), turns[visit]};
      node.tracker_from_sensor = readBy(node.reference_from_sensor.position_m, turns[visit], kUnequalCoils);
      table.nodes.push_back(node);
    }
    ++number;
  }
  return table;
}

calibration::Corrector correctorOf(const std::string& orientation) {
  const CalibrationTable table = turnedTable();
  return calibration::Corrector::fit(table.nodes, table.metadata,
                                     calibration::parseCorrectorChoice("affine", orientation).value(),
                                     calibration::AlignMode::kNone)
      .value();
}

Eigen::Quaterniond turnAt(const calibration::Corrector& corrector, const Eigen::Vector3d& p_m,
                          const Eigen::Quaterniond& q) {
  return corrector.correct(Pose{p_m, q}).orientation * q.conjugate();
}

}  // namespace

class ExportSubjectTest : public QObject {
  Q_OBJECT
 private slots:
  /// A format that knows one turn a position is given that of the orientation asked for, or the middle of those seen:
  /// no farther from any of them than they are from each other, and their vectors from it sum to nothing.
  void turnsThatChangeWithOrientation() {
    const calibration::Corrector corrector = correctorOf("gaussian_process");
    QVERIFY(corrector.turnTakesOrientation());
    const Eigen::Vector3d p_m(0.8, 0.3, 0.2);
    const std::vector<Eigen::Quaterniond> seen = corrector.orientationsSeen();
    QCOMPARE(seen.size(), std::size_t{3});
    QVERIFY(angleBetween_rad(turnAt(corrector, p_m, seen[0]), turnAt(corrector, p_m, seen[1])) > 5e-3);

    const ExportSubject mean(corrector, {});
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Quaterniond& q : seen)
      sum += rotationVector_rad(mean.rotation(p_m).conjugate() * turnAt(corrector, p_m, q));
    FT_VERIFY_MATCH(near(sum.norm(), 0.0, 1e-5));
    Written written;
    mean.tellOfTurns(written);
    QCOMPARE(written.notes.size(), std::size_t{1});
    FT_VERIFY_MATCH(holdsAll(written.notes[0], {"the mean over those that were fitted"}));

    ExportOptions options;
    options.orientation = seen[1];
    const ExportSubject at_one(corrector, options);
    FT_VERIFY_MATCH(near(at_one.rotation(p_m), turnAt(corrector, p_m, seen[1]), 1e-9));
  }

  void turnsThatDoNot() {
    const calibration::Corrector corrector = correctorOf("polynomial_quaternion:degree=2");
    QVERIFY(!corrector.turnTakesOrientation());
    const Eigen::Vector3d p_m(0.8, 0.3, 0.2);
    const ExportSubject subject(corrector, {});
    FT_VERIFY_MATCH(near(subject.rotation(p_m), turnAt(corrector, p_m, RandomGeometry(4).rotation()), 1e-9));
    Written written;
    subject.tellOfTurns(written);
    QVERIFY(written.notes.empty());
  }

  /// Before an orientation is asked for that would not help.
  void whatCannotBeWrittenIsRefusedAtOnce() {
    const CalibrationTable table = turnedTable();
    const auto corrector = calibration::Corrector::fit(
        table.nodes, table.metadata, calibration::parseCorrectorChoice("gaussian_process", "none").value(),
        calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    QVERIFY(corrector->takesOrientation());
    for (const char* id : {"polynomial_json", "polynomial_c"}) {
      const auto written = exportCalibration(*findExporter(id).value(), *corrector, {}, "never_written", RunControl());
      QVERIFY(!written);
      FT_VERIFY_MATCH(holdsAll(written.error().message, {"polynomial only", "gaussian_process"}));
    }
  }
};

FIELDTRUE_TEST(ExportSubjectTest)
#include "export_subject_test.moc"
