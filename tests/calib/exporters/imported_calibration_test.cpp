#include "calib/exporters/imported_calibration.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>

#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::exporters;
using namespace fieldtrue::testing;

namespace {

calibration::Corrector fittedRoom() {
  SyntheticOptions options;
  options.reference_from_tracker = {{0.5, -0.2, 1.1}, rotationFromVector({0.3, -0.8, 1.7})};
  options.smooth_distortion_m = 0.02;
  options.orientation_error_rad = 0.05;
  const CalibrationTable table = syntheticTable(options);
  return calibration::Corrector::fit(table.nodes, table.metadata,
                                     calibration::parseCorrectorChoice("rbf", "polynomial_quaternion").value(),
                                     calibration::AlignMode::kRigid)
      .value();
}

const CalibrationFormat& formatOf(const std::string& id) {
  const CalibrationFormat* format = findCalibrationFormat(id);
  if (format == nullptr) qFatal("no format %s", id.c_str());
  return *format;
}

}  // namespace

class ImportedCalibrationTest : public QObject {
  Q_OBJECT
 private slots:
  void everyReaderIsOfAnExporter() {
    for (const CalibrationFormat& format : calibrationFormats()) {
      QVERIFY(findCalibrationFormat(format.id) == &format);
      for (const std::string& id : format.exporter_ids) QVERIFY(findExporter(id).value()->read != nullptr);
    }
    QVERIFY(findCalibrationFormat("itk_nrrd") == nullptr);
  }

  void aFieldWrittenByHandMovesAsItSays() {
    QTemporaryDir folder;
    const std::filesystem::path file = folder.filePath("field.nrrd").toStdString();
    {
      std::ofstream out(file, std::ios::binary);
      // LPS in mm: x of LPS is minus x of the calibration's frame. Lattice of 2 x 2 x 2 from (0, 0, 0) to (1, 1, 1) m
      // LPS.
      out << "NRRD0004\ntype: float\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 2 2 2\n"
             "space directions: none (1000,0,0) (0,1000,0) (0,0,1000)\nkinds: vector domain domain domain\n"
             "endian: little\nencoding: raw\nspace origin: (0,0,0)\n\n";
      for (int point = 0; point < 8; ++point) {
        const bool far = (point & 1) != 0;  // At x = 1000 mm LPS.
        const float mm[3] = {far ? 20.0F : 0.0F, 0.0F, 100.0F};
        out.write(reinterpret_cast<const char*>(mm), sizeof mm);
      }
    }
    const auto imported = importCalibration(formatOf("itk_field"), file);
    FT_VERIFY_OK(imported);
    // Halfway along x of LPS: 10 mm further along it, 100 mm up; LPS' x and y are minus ours.
    FT_VERIFY_MATCH(near(imported->correctPosition_m({-0.5, -0.25, 0.75}), Eigen::Vector3d(-0.51, -0.25, 0.85), 1e-7));
    QVERIFY(imported->covers({-0.5, -0.25, 0.75}));
    QVERIFY(!imported->covers({0.5, 0.25, 0.75}));
    // Beside the lattice nothing is corrected.
    FT_VERIFY_MATCH(near(imported->correctPosition_m({0.5, 0.25, 0.75}), Eigen::Vector3d(0.5, 0.25, 0.75), 1e-15));
    FT_VERIFY_MATCH(holdsAll(imported->report().notes.front(), {"field.nrrd", "mm, LPS", "not known"}));
    const auto again = calibration::Corrector::fromText(imported->toText(), "again");
    FT_VERIFY_OK(again);
    QCOMPARE(again->toText(), imported->toText());
  }

  void whatWasExportedComesBack_data() {
    QTest::addColumn<QString>("format");
    QTest::addColumn<QString>("exporter");
    for (const auto& [format, exporter] :
         {std::pair{"itk_field", "itk_nrrd"}, std::pair{"itk_field", "itk_mha"}, std::pair{"itk_field", "itk_h5"},
          std::pair{"itk_field", "itk_tfm"}, std::pair{"vtk_field", "vtk_vti"},
          std::pair{"vrui_grid", "vrui_forward_grid"}, std::pair{"vrui_binary_grid", "vrui_grid"},
          std::pair{"lattice", "numpy"}, std::pair{"lattice", "matlab"}, std::pair{"lattice", "lattice_csv"},
          std::pair{"cave_table", "cave_table"}, std::pair{"syzygy_table", "syzygy_table"}})
      QTest::newRow(exporter) << format << exporter;
  }

  void whatWasExportedComesBack() {
    QFETCH(const QString, format);
    QFETCH(const QString, exporter);
    const calibration::Corrector room = fittedRoom();
    const Exporter& row = *findExporter(exporter.toStdString()).value();
    QTemporaryDir folder;
    const std::filesystem::path file = folder.path().toStdString() + "/room" + row.extension;
    const auto written = exportCalibration(row, room, {}, file, {});
    FT_VERIFY_OK(written);
    const auto imported = importCalibration(formatOf(format.toStdString()), file);
    FT_VERIFY_OK(imported);
    double worst_m = 0.0, worst_rad = 0.0;
    std::size_t n_inside = 0;
    for (const auto& [p_m, goes_m] : ExportSubject(room, {}).probes(2000)) {
      if (!imported->covers(p_m)) continue;
      ++n_inside;
      worst_m = std::max(worst_m, (imported->correctPosition_m(p_m) - goes_m).norm());
      const Pose tracked{p_m, rotationFromVector({0.2, -0.4, 0.9})};
      const Eigen::Quaterniond unmounted = room.correct(tracked).orientation * room.alignment().mountOf({}).conjugate();
      worst_rad = std::max(worst_rad, angleBetween_rad(imported->correct(tracked).orientation, unmounted));
    }
    QVERIFY2(n_inside > 1000, std::to_string(n_inside).c_str());
    // What writing told, and that between points straight lines stand.
    QVERIFY2(worst_m < 1.2 * written->deviation->worst_m + 20e-6, std::to_string(1e6 * worst_m).c_str());
    QVERIFY(format != "lattice" || imported->choice().orientation_id == "imported");
    if (imported->choice().orientation_id == "imported") QVERIFY2(worst_rad < 2e-3, std::to_string(worst_rad).c_str());
  }

  void theOtherDirectionIsRefused() {
    const calibration::Corrector room = fittedRoom();
    ExportOptions options;
    options.direction = Direction::kTrueToMeasured;
    int n_tried = 0;
    for (const CalibrationFormat& format : calibrationFormats())
      for (const std::string& id : format.exporter_ids) {
        const Exporter& row = *findExporter(id).value();
        if (!row.may_be_inverse) continue;
        ++n_tried;
        QTemporaryDir folder;
        const std::filesystem::path file = folder.path().toStdString() + "/back" + row.extension;
        FT_VERIFY_OK(exportCalibration(row, room, options, file, {}));
        QVERIFY(recogniseCalibration(file) == &format);
        const auto imported = importCalibration(format, file);
        QVERIFY2(!imported, id.c_str());
        FT_VERIFY_MATCH(holdsAll(imported.error().message, {"back", "true positions to measured", "--direction"}));
      }
    QCOMPARE(n_tried, 8);
  }

  void aTurnThatIsNoneIsRefused() {
    QTemporaryDir folder;
    const std::string file = folder.path().toStdString() + "/field.lattice.csv";
    std::ofstream out(file);
    out << "x_m,y_m,z_m,x_corrected_m,y_corrected_m,z_corrected_m,qw,qx,qy,qz,uncertainty_m,inside\n";
    for (int point = 0; point < 8; ++point)
      out << point / 4 << ',' << point / 2 % 2 << ',' << point % 2 << ",0,0,0," << (point == 5 ? 0 : 1)
          << ",0,0,0,,1\n";
    out.close();
    FT_VERIFY_MATCH(holdsAll(importCalibration(formatOf("lattice"), file).error().message, {"point 5", "quaternion"}));
  }

  void itCannotBeFitted() {
    const CalibrationTable table = syntheticTable();
    const auto fitted = calibration::Corrector::fit(table.nodes, table.metadata, {"imported", {}, "none", {}},
                                                    calibration::AlignMode::kRigid);
    QVERIFY(!fitted);
    FT_VERIFY_MATCH(holdsAll(fitted.error().message, {"another program"}));
  }

  void whatIsNoFieldIsRefused() {
    QTemporaryDir folder;
    const std::string base = folder.path().toStdString();
    std::ofstream(base + "/field.nrrd") << "NRRD0004\ntype: float\n\n";
    std::ofstream(base + "/field.txt") << "1 2 3\n";
    for (const char* name : {"/field.nrrd", "/field.txt", "/none.nrrd"})
      QVERIFY(!importCalibration(formatOf("itk_field"), base + name));
    FT_VERIFY_MATCH(holdsAll(importCalibration(formatOf("itk_field"), base + "/field.txt").error().message,
                             {"field.txt", ".nrrd", ".mha"}));
    for (const char* format : {"vtk_field", "vrui_grid", "vrui_binary_grid", "cave_table", "syzygy_table"})
      QVERIFY(!importCalibration(formatOf(format), base + "/field.txt"));
  }
};

FIELDTRUE_TEST(ImportedCalibrationTest)
#include "imported_calibration_test.moc"
