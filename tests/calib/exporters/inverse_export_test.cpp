#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <atomic>

#include "calib/calibration/alignment.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::exporters;
using namespace fieldtrue::testing;

namespace {

/// Places whose readings lie 0.2 m apart from -0.4 m to 0.4 m, with true x = x + cubic x^3 and the rest as read.
calibration::Corrector cubicRoom(const std::string& method, double cubic_per_m2) {
  CalibrationTable table;
  table.metadata.alignment_known = true;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (int k = -2; k <= 2; ++k) {
        Node node;
        node.node = static_cast<int>(table.nodes.size());
        const Eigen::Vector3d p_m = 0.2 * Eigen::Vector3d(i, j, k);
        node.tracker_from_sensor.position_m = p_m;
        node.reference_from_sensor.position_m = p_m + Eigen::Vector3d(cubic_per_m2 * p_m.x() * p_m.x() * p_m.x(), 0, 0);
        table.nodes.push_back(node);
      }
    }
  }
  return calibration::Corrector::fit(table.nodes, table.metadata,
                                     calibration::parseCorrectorChoice(method, "none").value(),
                                     calibration::AlignMode::kNone)
      .value();
}

ExportOptions backwards(double max_deviation_m) {
  ExportOptions options;
  options.direction = Direction::kTrueToMeasured;
  options.max_deviation_m = max_deviation_m;
  return options;
}

}  // namespace

/// Maps from true to measured positions: where there is one, and where there is none.
class InverseExportTest : public QObject {
  Q_OBJECT
 private slots:
  /// x - 4 x^3 turns back at |x| = 1 / sqrt(12) = 0.289 m: 0.4 and 0.159 m both go to 0.144 m.
  void aRoomThatFoldsBackIsToldAtOnce_data() {
    QTest::addColumn<QString>("method");
    QTest::newRow("polynomial") << "polynomial:degree=3";
    QTest::newRow("Gaussian process") << "gaussian_process:inputs=position";
  }
  void aRoomThatFoldsBackIsToldAtOnce() {
    QFETCH(QString, method);
    const calibration::Corrector room = cubicRoom(method.toStdString(), -4.0);
    QTemporaryDir folder;
    const Exporter& nrrd = *findExporter("itk_nrrd").value();
    const std::filesystem::path path = folder.path().toStdString() + "/room.nrrd";
    double farthest = 0.0;
    RunControl control;
    control.progress = [&](double fraction) { farthest = std::max(farthest, fraction); };
    const auto written = exportCalibration(nrrd, room, backwards(1e-3), path, control);
    QVERIFY(!written);
    QVERIFY2(farthest < 0.1, "told before all ways back were tried, and before anything was sampled");
    QCOMPARE(written.error().code, ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(written.error().message,
                             {"folds back", "are both corrected to", "points of the region", "measured-to-true"}));
    QVERIFY2(written.error().message.find("n/a") == std::string::npos, written.error().message.c_str());
    QVERIFY(!std::filesystem::exists(path));
    // Forwards it is a map like any other.
    ExportOptions forwards;
    forwards.max_deviation_m = 5e-3;
    FT_VERIFY_OK(exportCalibration(nrrd, room, forwards, path, {}));
  }

  /// x + 4 x^3 takes 0.44 m, which lies within a quarter of the spacing beyond the last place, to 0.781 m; the places
  /// go to 0.656 m, their margin is 0.05 m and the two steps beside them 0.024 m each.
  void aRoomThatStretchesBeyondItsPlacesIsWritten() {
    const calibration::Corrector room = cubicRoom("polynomial:degree=3", 4.0);
    QVERIFY(room.covers({0.44, 0.0, 0.0}));
    QTemporaryDir folder;
    const std::filesystem::path path = folder.path().toStdString() + "/room.nrrd";
    const auto written = exportCalibration(*findExporter("itk_nrrd").value(), room, backwards(0.5e-3), path, {});
    FT_VERIFY_OK(written);
    QVERIFY(written->deviation && written->deviation->worst_m <= 0.5e-3);
  }

  void aStopIsHeardBeforeAnythingIsSampled() {
    const calibration::Corrector room = cubicRoom("polynomial:degree=3", 0.5);
    QTemporaryDir folder;
    std::stop_source source;
    std::atomic<int> n_told = 0;
    RunControl control;
    control.stop = source.get_token();
    control.progress = [&](double fraction) {
      if (fraction <= 0.0 || fraction >= 0.1) return;
      ++n_told;
      source.request_stop();
    };
    const std::filesystem::path path = folder.path().toStdString() + "/room.nrrd";
    const auto written = exportCalibration(*findExporter("itk_nrrd").value(), room, backwards(1e-3), path, control);
    QVERIFY(!written);
    QCOMPARE(written.error().code, ErrorCode::kCancelled);
    QCOMPARE(n_told.load(), 1);
    QVERIFY(!std::filesystem::exists(path));
  }
};

FIELDTRUE_TEST(InverseExportTest)
#include "inverse_export_test.moc"
