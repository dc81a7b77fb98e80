#include <QTemporaryDir>
#include <QTest>
#include <set>

#include "calib/calibration/alignment.h"
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

/// Calibrations of every kind of table an exporter may meet.
std::vector<calibration::Corrector> calibrations() {
  SyntheticOptions full;
  full.smooth_distortion_m = 0.02;
  full.orientation_error_rad = 0.1;
  SyntheticOptions position_only = full;
  position_only.has_orientation = false;
  SyntheticOptions flat = position_only;
  flat.counts = {6, 6, 1};
  std::vector<calibration::Corrector> made;
  for (const auto& [options, position, orientation] :
       {std::tuple{full, "hmq", "polynomial_quaternion"}, std::tuple{position_only, "polynomial", "none"},
        std::tuple{flat, "affine", "none"}, std::tuple{full, "none", "none"}}) {
    const CalibrationTable table = syntheticTable(options);
    made.push_back(calibration::Corrector::fit(table.nodes, table.metadata,
                                               calibration::parseCorrectorChoice(position, orientation).value(),
                                               calibration::AlignMode::kRigid)
                       .value());
  }
  return made;
}

ExportOptions named(const Exporter& exporter) {
  ExportOptions options;
  options.name = "room";
  if (exporter.has_free_pitch) options.max_deviation_m = 0.02;  // Lattices stay small.
  options.held_out = HeldOutError{0.0021, "kfold:10"};
  return options;
}

/// Of a file, or of every file of a folder.
std::string contentOf(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return readFile(path).value();
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(path)) files.insert(entry.path());
  std::string content;
  for (const auto& file : files) content += file.filename().string() + "\n" + readFile(file).value();
  return content;
}

bool isText(const std::string& content) {
  return std::all_of(content.begin(), content.end(), [](char c) { return c >= ' ' || c == '\n'; });
}

}  // namespace

/// The contract of every row of the exporter registry.
class ExporterContractTest : public QObject {
  Q_OBJECT
 private slots:
  void rowsAreComplete() {
    std::set<std::string> ids;
    for (const Exporter& exporter : exporters::exporters()) {
      QVERIFY(!exporter.label.empty() && exporter.extension.starts_with('.') && !exporter.reads_it.empty() &&
              !exporter.in_words.empty() && (exporter.read || !exporter.has_free_pitch) && exporter.write);
      QVERIFY2(ids.insert(exporter.id).second, exporter.id.c_str());
      QVERIFY(findExporter(exporter.id).value() == &exporter);
    }
    const auto unknown = findExporter("punched_cards");
    QVERIFY(!unknown && unknown.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(unknown.error().message, {"punched_cards", "csv", "ftcal"}));
  }

  void writesTheSameBytesTwice_data() {
    QTest::addColumn<QString>("id");
    for (const Exporter& exporter : exporters::exporters())
      QTest::newRow(exporter.id.c_str()) << QString::fromStdString(exporter.id);
  }
  void writesTheSameBytesTwice() {
    QFETCH(QString, id);
    const Exporter& exporter = *findExporter(id.toStdString()).value();
    QTemporaryDir folder;
    const std::filesystem::path base = folder.path().toStdString();
    for (const calibration::Corrector& corrector : calibrations()) {
      const std::filesystem::path first_path = base / ("first" + exporter.extension);
      const auto written = exportCalibration(exporter, corrector, named(exporter), first_path, {});
      if (!written) {
        // Some write one method's calibration only, or need places in a volume; nothing is left behind.
        const std::string& why = written.error().message;
        QVERIFY2(why.find("polynomial only") != std::string::npos || why.find("span a volume") != std::string::npos,
                 why.c_str());
        QVERIFY(!std::filesystem::exists(first_path));
        continue;
      }
      const std::filesystem::path second_path = base / ("second" + exporter.extension);
      FT_VERIFY_OK(exportCalibration(exporter, corrector, named(exporter), second_path, {}));
      const std::string first = contentOf(first_path);
      QVERIFY(first.size() > 500);
      QVERIFY(first == contentOf(second_path));
      if (isText(first)) QVERIFY(first.find("nan") == std::string::npos && first.find("inf,") == std::string::npos);
      FT_VERIFY_MATCH(holdsAll(first, {"Fieldtrue"}));
      std::filesystem::remove_all(first_path);
    }
  }

  void aFolderThatIsNotThereIsSaid_data() { writesTheSameBytesTwice_data(); }
  void aFolderThatIsNotThereIsSaid() {
    QFETCH(QString, id);
    const Exporter& exporter = *findExporter(id.toStdString()).value();
    const std::size_t polynomial = exporter.id.starts_with("polynomial") ? 1 : 0;
    const auto written =
        exportCalibration(exporter, calibrations()[polynomial], named(exporter), "/nowhere/at/all.out", {});
    QVERIFY(!written && written.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(written.error().message, {"/nowhere/at/all.out"}));
  }
};

FIELDTRUE_TEST(ExporterContractTest)
#include "exporter_contract_test.moc"
