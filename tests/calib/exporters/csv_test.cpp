#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <fstream>
#include <sstream>

#include "calib/calibration/alignment.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"
#include "calib/tables/table_io.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::exporters;
using namespace fieldtrue::testing;

namespace {

CalibrationTable bentTable(bool has_orientation) {
  SyntheticOptions options;
  options.counts = {3, 3, 3};
  options.reference_from_tracker = {{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
  options.smooth_distortion_m = 0.02;
  options.has_orientation = has_orientation;
  options.orientation_error_rad = 0.1;
  CalibrationTable table = syntheticTable(options);
  table.metadata.tracker = "Fastrak";
  table.metadata.date = "2001-05-17";
  table.nodes[4].covariance_m2 = Eigen::Matrix3d(Eigen::Vector3d(1e-6, 4e-6, 9e-6).asDiagonal());
  table.nodes[4].role = NodeRole::kValidation;
  return table;
}

/// A plain reader of its own: header names to columns, and each row's fields.
struct PlainCsv {
  std::vector<std::string> comments;
  std::map<std::string, std::size_t> column;
  std::vector<std::vector<std::string>> rows;

  double number(std::size_t row, const std::string& name) const { return std::stod(rows[row][column.at(name)]); }
  const std::string& text(std::size_t row, const std::string& name) const { return rows[row][column.at(name)]; }
};

PlainCsv readPlain(const std::filesystem::path& path) {
  PlainCsv csv;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with('#')) {
      csv.comments.push_back(line);
      continue;
    }
    std::vector<std::string> fields;
    std::stringstream parts(line + ",");
    std::string field;
    while (std::getline(parts, field, ',')) fields.push_back(field);
    if (csv.column.empty())
      for (std::size_t i = 0; i < fields.size(); ++i) csv.column[fields[i]] = i;
    else
      csv.rows.push_back(fields);
  }
  return csv;
}

}  // namespace

class CsvTest : public QObject {
  Q_OBJECT
 private slots:
  void holdsOneRowANodeWithErrorsBeforeAndAfter_data() {
    QTest::addColumn<bool>("has_orientation");
    QTest::newRow("poses") << true;
    QTest::newRow("positions only") << false;
  }
  void holdsOneRowANodeWithErrorsBeforeAndAfter() {
    QFETCH(bool, has_orientation);
    const CalibrationTable table = bentTable(has_orientation);
    const calibration::Corrector corrector =
        calibration::Corrector::fit(
            table.nodes, table.metadata,
            calibration::parseCorrectorChoice("affine", has_orientation ? "rigid" : "none").value(),
            calibration::AlignMode::kRigid)
            .value();
    QTemporaryDir folder;
    const std::filesystem::path path = std::filesystem::path(folder.path().toStdString()) / "out.csv";
    FT_VERIFY_OK(exportCalibration(*findExporter("csv").value(), corrector, {}, path, {}));
    const PlainCsv csv = readPlain(path);
    QCOMPARE(csv.rows.size(), table.nodes.size());
    double before_squares_m2 = 0.0;
    double after_squares_m2 = 0.0;
    for (std::size_t row = 0; row < csv.rows.size(); ++row) {
      QCOMPARE(csv.rows[row].size(), csv.column.size());
      const Node& node = table.nodes[row];
      QCOMPARE(static_cast<int>(csv.number(row, "node")), node.node);
      QCOMPARE(static_cast<int>(csv.number(row, "j")), (*node.index)[1]);
      QCOMPARE(csv.number(row, "y_true_m"), node.reference_from_sensor.position_m.y());
      QCOMPARE(csv.number(row, "z_m"), node.tracker_from_sensor.position_m.z());
      const Eigen::Vector3d corrected_m(csv.number(row, "x_corrected_m"), csv.number(row, "y_corrected_m"),
                                        csv.number(row, "z_corrected_m"));
      FT_VERIFY_MATCH(
          near(csv.number(row, "error_after_m"), (corrected_m - node.reference_from_sensor.position_m).norm(), 1e-12));
      before_squares_m2 += std::pow(csv.number(row, "error_before_m"), 2);
      after_squares_m2 += std::pow(csv.number(row, "error_after_m"), 2);
      QCOMPARE(csv.text(row, "covered"), std::string("1"));
      QCOMPARE(csv.text(row, "error_after_rad").empty(), !has_orientation);
      QCOMPARE(csv.text(row, "qw_corrected").empty(), !has_orientation);
    }
    // The file's errors are those of the fit report.
    FT_VERIFY_MATCH(near(1000.0 * std::sqrt(before_squares_m2 / 27.0), corrector.report().rms_before_mm, 1e-9));
    FT_VERIFY_MATCH(near(std::sqrt(after_squares_m2 / 27.0), corrector.report().rms_m, 1e-12));
    QVERIFY(after_squares_m2 < before_squares_m2);
    QCOMPARE(csv.text(4, "role"), std::string("validation"));
    FT_VERIFY_MATCH(near(csv.number(4, "sd_y_m"), 0.002, 1e-15));
  }

  void headStatesWhatAReaderMustKnow() {
    const CalibrationTable table = bentTable(true);
    const calibration::Corrector corrector =
        calibration::Corrector::fit(table.nodes, table.metadata,
                                    calibration::parseCorrectorChoice("hmq:r2_cm2=50", "none").value(),
                                    calibration::AlignMode::kRigid)
            .value();
    QTemporaryDir folder;
    const std::filesystem::path path = std::filesystem::path(folder.path().toStdString()) / "out.csv";
    FT_VERIFY_OK(exportCalibration(*findExporter("csv").value(), corrector, {}, path, {}));
    std::string head;
    for (const std::string& comment : readPlain(path).comments) head += comment + "\n";
    FT_VERIFY_MATCH(holdsAll(
        head, {"# unit: metres", "# direction: measured", "true", "# frame: jig", "# fit_position: hmq:r2_cm2=50",
               "# fit_rows: 27", "# date: 2001-05-17", "# tracker: Fastrak", "# software: Fieldtrue "}));
  }

  void readsBackAsTheTableThatWasFitted() {
    const CalibrationTable table = bentTable(true);
    const calibration::Corrector corrector =
        calibration::Corrector::fit(table.nodes, table.metadata,
                                    calibration::parseCorrectorChoice("affine", "none").value(),
                                    calibration::AlignMode::kRigid)
            .value();
    QTemporaryDir folder;
    const std::filesystem::path path = std::filesystem::path(folder.path().toStdString()) / "out.csv";
    FT_VERIFY_OK(exportCalibration(*findExporter("csv").value(), corrector, {}, path, {}));
    const auto reading = readNodeTable(path);
    FT_VERIFY_OK(reading);
    QCOMPARE(reading->table.nodes.size(), table.nodes.size());
    for (std::size_t row = 0; row < table.nodes.size(); ++row) {
      FT_VERIFY_MATCH(
          near(reading->table.nodes[row].tracker_from_sensor, table.nodes[row].tracker_from_sensor, 0.0, 1e-12));
      FT_VERIFY_MATCH(
          near(reading->table.nodes[row].reference_from_sensor, table.nodes[row].reference_from_sensor, 0.0, 1e-12));
      QCOMPARE(reading->table.nodes[row].role, table.nodes[row].role);
    }
  }
};

FIELDTRUE_TEST(CsvTest)
#include "csv_test.moc"
