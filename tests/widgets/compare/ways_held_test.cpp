#include <QComboBox>
#include <QLabel>
#include <QTest>
#include <cmath>
#include <random>

#include "calib/calibration/corrector.h"
#include "calib/core/units.h"
#include "tests/calib/correctors/coil_readings.h"
#include "tests/support/matchers.h"
#include "tests/widgets/window_test.h"
#include "widgets/compare/volume_bar.h"
#include "widgets/compare/volume_sampling.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using namespace fieldtrue::widgets;

namespace {

Eigen::Quaterniond about(const Eigen::Vector3d& axis, double angle_deg) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(kRadPerDeg * angle_deg, axis));
}

const std::vector<Eigen::Quaterniond> kWays = {Eigen::Quaterniond::Identity(), about(Eigen::Vector3d::UnitX(), 90.0),
                                               about(Eigen::Vector3d::UnitZ(), 90.0)};

/// 4x4x3 places before the transmitter, each in every way, read by unequal coils.
CalibrationTable turnedTable() {
  CalibrationTable table;
  table.metadata.alignment_known = true;
  table.metadata.jig_tolerance_m = 1e-4;
  std::mt19937_64 random(3);
  std::normal_distribution<double> slip_m(0.0, 1e-4);
  for (int place = 0; place < 48; ++place)
    for (int visit = 0; visit < static_cast<int>(kWays.size()); ++visit) {
      Node node;
      node.node = place;
      node.visit = visit;
      node.has_orientation = true;
      node.reference_from_sensor = {{0.4 + 0.15 * (place % 4), 0.15 * (place / 4 % 4) - 0.2, 0.15 * (place / 16) - 0.1},
                                    kWays[static_cast<std::size_t>(visit)]};
      node.tracker_from_sensor =
          readBy(node.reference_from_sensor.position_m, node.reference_from_sensor.orientation, kUnequalCoils);
      for (double& x : node.reference_from_sensor.position_m) x += slip_m(random);
      table.nodes.push_back(node);
    }
  return table;
}

}  // namespace

class WaysHeldTest : public QObject {
  Q_OBJECT
 private slots:
  void waysWithinFiveDegreesAreOne() {
    CalibrationTable table = turnedTable();
    QCOMPARE(waysHeld(table).size(), std::size_t{3});
    for (Node& node : table.nodes)
      node.tracker_from_sensor.orientation = about(Eigen::Vector3d::UnitY(), node.visit == 2 ? 4.0 : 0.0);
    QVERIFY(waysHeld(table).empty());
    for (Node& node : table.nodes) node.has_orientation = false;
    QVERIFY(waysHeld(table).empty());
    table = turnedTable();
    for (Node& node : table.nodes)
      if (node.visit == 1) node.role = NodeRole::kSkipped;
    QCOMPARE(waysHeld(table).size(), std::size_t{2});
  }

  /// How far a reading is moved, held in each way, is what such coils are wrong by there, by the tracker's equations.
  void aVolumeIsOfTheWayChosen() {
    const CalibrationTable table = turnedTable();
    const auto choice = calibration::parseCorrectorChoice("gaussian_process", "none");
    const auto corrector =
        calibration::Corrector::fit(table.nodes, table.metadata, *choice, calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    QVERIFY(corrector->takesOrientation());
    const VolumeField lattice = latticeAround(table, 5);
    for (const Eigen::Quaterniond& way : kWays) {
      const VolumeField moved = correctionVolume(*corrector, way, lattice);
      double worst_mm = 0.0, largest_mm = 0.0;
      for (std::size_t i = 0; i < moved.size(); ++i) {
        if (!std::isfinite(moved.values_mm[i])) continue;
        const Eigen::Vector3d p_m = moved.point_m(i);
        const double wrong_mm = 1000.0 * (readBy(p_m, way, kUnequalCoils).position_m - p_m).norm();
        worst_mm = std::max(worst_mm, std::abs(moved.values_mm[i] - wrong_mm));
        largest_mm = std::max(largest_mm, wrong_mm);
      }
      // The error is asked for at the reading, not at the truth: as much apart as the error is small.
      QVERIFY2(largest_mm > 5.0 && worst_mm < 0.06 * largest_mm,
               qPrintable(QStringLiteral("%1 of %2 mm").arg(worst_mm).arg(largest_mm)));
    }
    const VolumeField sd = uncertaintyVolume(*corrector, kWays[1], lattice);
    QVERIFY(sd.largest_mm().has_value());
    const VolumeField between = differenceVolume(*corrector, *corrector, kWays[1], lattice);
    FT_VERIFY_MATCH(near(between.largest_mm().value_or(1.0), 0.0, 1e-12));
  }

  void theBarOffersWhatThereIs() {
    VolumeBar bar;
    auto* held = bar.findChild<QComboBox*>(QStringLiteral("volumeHeld"));
    QVERIFY(held != nullptr);
    QCOMPARE(bar.held(), kMeanHeld);
    bar.setWaysHeld({});
    QVERIFY(held->isHidden());
    bar.setWaysHeld(kWays);
    QVERIFY(!held->isHidden());
    QCOMPARE(held->count(), 4);
    QCOMPARE(bar.held(), kMeanHeld);
    QVERIFY(!held->isEnabled());
    bar.setQuantity(VolumeQuantity::kCorrection);
    QVERIFY(held->isEnabled());
    held->setCurrentIndex(2);
    QCOMPARE(bar.held(), 1);
    QVERIFY2(held->currentText().contains(QStringLiteral("0°, 0°, 90°")), qPrintable(held->currentText()));
    bar.setQuantity(VolumeQuantity::kExpectedError);
    QVERIFY(!held->isEnabled());
  }
};

FIELDTRUE_WINDOW_TEST(WaysHeldTest)
#include "ways_held_test.moc"
