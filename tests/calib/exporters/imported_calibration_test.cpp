#include "calib/exporters/imported_calibration.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <random>

#include "calib/core/file_io.h"
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

/// Formats with room for what is outside.
bool hasMask(const QString& format) {
  return format == QLatin1String("lattice") || format == QLatin1String("vtk_field");
}

void write(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
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
    // The region is convex: a cell whose corners all lie in it does too.
    std::size_t n_outside = 0;
    std::mt19937_64 generator(4);
    std::uniform_real_distribution<double> along_m(-3.0, 3.0);
    for (int draw = 0; hasMask(format) && draw < 50000; ++draw) {
      const Eigen::Vector3d p_m(along_m(generator), along_m(generator), along_m(generator));
      if (room.covers(p_m)) continue;
      ++n_outside;
      QVERIFY(!imported->covers(p_m));
    }
    QVERIFY(!hasMask(format) || n_outside > 1000);
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

  void pointsThatDoNotCountTakeTheirCellsOut() {
    QTemporaryDir folder;
    const std::string file = folder.path().toStdString() + "/field.lattice.csv";
    std::ofstream out(file);
    // Four points along x, all moved by 0.1 m up; the third of one edge moves by 9 m, and does not count.
    out << "x_m,y_m,z_m,x_corrected_m,y_corrected_m,z_corrected_m,qw,qx,qy,qz,uncertainty_m,inside\n";
    for (int x = 0; x < 4; ++x)
      for (int y = 0; y < 2; ++y)
        for (int z = 0; z < 2; ++z) {
          const bool counts = !(x == 2 && y == 0 && z == 0);
          out << x << ',' << y << ',' << z << ',' << x << ',' << y << ',' << z + (counts ? 0.1 : 9.0) << ",1,0,0,0,,"
              << (counts ? 1 : 0) << '\n';
        }
    out.close();
    const auto made = importCalibration(formatOf("lattice"), file);
    FT_VERIFY_OK(made);
    FT_VERIFY_MATCH(holdsAll(made->report().notes.front(), {"by 100 mm RMS"}));
    const auto read = calibration::Corrector::fromText(made->toText(), "again");
    FT_VERIFY_OK(read);
    for (const calibration::Corrector* imported : {&*made, &*read}) {
      QVERIFY(imported->covers({0.5, 0.5, 0.5}));
      FT_VERIFY_MATCH(near(imported->correctPosition_m({0.5, 0.5, 0.5}), Eigen::Vector3d(0.5, 0.5, 0.6), 1e-7));
      for (const double x : {1.5, 2.5}) {
        QVERIFY(!imported->covers({x, 0.5, 0.5}));
        FT_VERIFY_MATCH(near(imported->correctPosition_m({x, 0.5, 0.5}), Eigen::Vector3d(x, 0.5, 0.5), 1e-15));
        QVERIFY(imported->covers({x, 1.0, 0.5}));  // On a face that it has no part of.
      }
    }
    std::string damaged = made->toText();
    const std::size_t at = damaged.find("inside_base64");
    QVERIFY(at != std::string::npos);
    damaged.erase(damaged.find(':', at) + 4, 4);
    QVERIFY(!calibration::Corrector::fromText(damaged, "damaged"));
  }

  void aMatFileCutOffIsRefused() {
    QTemporaryDir folder;
    const std::filesystem::path file = folder.filePath("room.mat").toStdString();
    const CalibrationTable table = syntheticTable();
    const auto affine = calibration::Corrector::fit(table.nodes, table.metadata, {"affine", {}, "none", {}},
                                                    calibration::AlignMode::kRigid);
    FT_VERIFY_OK(affine);
    FT_VERIFY_OK(exportCalibration(*findExporter("matlab").value(), *affine, {}, file, {}));
    const std::string whole = readFile(file).value();
    for (const std::size_t bytes : {whole.size() - 1, std::size_t{145}, std::size_t{130}}) {
      write(file, std::string_view(whole).substr(0, bytes));
      const auto imported = importCalibration(formatOf("lattice"), file);
      QVERIFY(!imported);
      FT_VERIFY_MATCH(holdsAll(imported.error().message, {"room.mat", "the file is cut off"}));
      QVERIFY(recogniseCalibration(file) == nullptr);
    }
    std::string damaged = whole;
    // In the packed numbers of the first array, behind the head of 128 bytes and the tag of 8.
    for (std::size_t at = 146; at < 156; ++at) damaged[at] = static_cast<char>(~whole[at]);
    write(file, damaged);
    FT_VERIFY_MATCH(
        holdsAll(importCalibration(formatOf("lattice"), file).error().message, {"room.mat", "damaged or cut off"}));
  }

  void aDisplacementThatIsNoneIsRefused_data() {
    QTest::addColumn<QString>("format");
    QTest::addColumn<QString>("name");
    QTest::addColumn<QByteArray>("head");
    QTest::addColumn<QByteArray>("tail");
    QTest::addColumn<QByteArray>("number");
    QTest::addColumn<QByteArray>("says");
    const QByteArray tfm =
        "#Insight Transform File V1.0\n#Transform 0\nTransform: DisplacementFieldTransform_double_3_3\nParameters:";
    const QByteArray tfm_tail = "\nFixedParameters: 2 2 2 0 0 0 1000 1000 1000 1 0 0 0 1 0 0 0 1\n";
    const QByteArray vti =
        "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 1\"><Piece><PointData>"
        "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">";
    const QByteArray vti_tail = "</DataArray></PointData></Piece></ImageData></VTKFile>";
    const QByteArray not_finite = "point 5 is not a finite number";
    QTest::newRow("tfm, nan") << "itk_field"
                              << "field.tfm" << tfm << tfm_tail << QByteArray("nan") << not_finite;
    QTest::newRow("tfm, huge") << "itk_field"
                               << "field.tfm" << tfm << tfm_tail << QByteArray("1e203")
                               << QByteArray("point 5 is 1e+200 m, more than the 30 m that any tracker reaches");
    QTest::newRow("tfm, far") << "itk_field"
                              << "field.tfm" << tfm << tfm_tail << QByteArray("-41000")
                              << QByteArray("point 5 is 41 m, more than the 30 m");
    QTest::newRow("vti, nan") << "vtk_field"
                              << "field.vti" << vti << vti_tail << QByteArray("nan") << not_finite;
    QTest::newRow("vti, far") << "vtk_field"
                              << "field.vti" << vti << vti_tail << QByteArray("31")
                              << QByteArray("numbers were taken as m");
  }

  void aDisplacementThatIsNoneIsRefused() {
    QFETCH(const QString, format);
    QFETCH(const QString, name);
    QFETCH(const QByteArray, head);
    QFETCH(const QByteArray, tail);
    QFETCH(const QByteArray, number);
    QFETCH(const QByteArray, says);
    QTemporaryDir folder;
    const std::filesystem::path file = folder.filePath(name).toStdString();
    const auto importWith = [&](const QByteArray& one) {
      QByteArray text = head;
      for (int point = 0; point < 8; ++point) text += " 0 " + (point == 5 ? one : QByteArray("0")) + " 0";
      write(file, (text + tail).toStdString());
      return importCalibration(formatOf(format.toStdString()), file);
    };
    FT_VERIFY_OK(importWith("29"));
    const auto imported = importWith(number);
    QVERIFY(!imported);
    FT_VERIFY_MATCH(holdsAll(imported.error().message, {name.toUtf8(), says}));
  }

  void aLatticeAskewIsRefused() {
    QTemporaryDir folder;
    const std::filesystem::path file = folder.filePath("field.vti").toStdString();
    std::string numbers;
    for (int number = 0; number < 24; ++number) numbers += " 0";
    for (const auto& [statement, says] :
         {std::pair{"Direction=\"1 0.1 0 0 1 0 0 0 1\"", "not at right angles"},
          std::pair{"Origin=\"0 nan 0\"", "must be finite"}, std::pair{"Spacing=\"1 inf 1\"", "must be finite"}}) {
      write(file, "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 1 0 1 0 1\" " + std::string(statement) +
                      "><Piece><PointData><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" +
                      numbers + "</DataArray></PointData></Piece></ImageData></VTKFile>");
      const auto imported = importCalibration(formatOf("vtk_field"), file);
      QVERIFY(!imported);
      FT_VERIFY_MATCH(holdsAll(imported.error().message, {"field.vti", says}));
    }
  }

  void anAbsentFileIsSaidToBeAbsent() {
    for (const CalibrationFormat& format : calibrationFormats())
      for (const std::string& id : format.exporter_ids) {
        const std::string file = "/nowhere/none" + findExporter(id).value()->extension;
        const auto imported = importCalibration(format, file);
        QVERIFY(!imported);
        QVERIFY2(imported.error().code == ErrorCode::kIo, imported.error().message.c_str());
        FT_VERIFY_MATCH(holdsAll(imported.error().message,
                                 {"Cannot read ", QByteArray::fromStdString(file), "No such file or directory"}));
      }
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
