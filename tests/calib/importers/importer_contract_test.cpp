#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <set>

#include "calib/importers/column_guess.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

namespace {

Settings defaults(const Importer& importer) { return resolveSettings(importer.id, importer.settings, {}).value(); }

void addRows() {
  QTest::addColumn<QByteArray>("id");
  for (const Importer& importer : importers::importers())
    QTest::newRow(importer.id.c_str()) << QByteArray::fromStdString(importer.id);
}

}  // namespace

/// What holds for every importer, whatever it reads.
class ImporterContractTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() { QVERIFY(folder_.isValid()); }

  void rowsAreComplete() {
    std::set<std::string> ids;
    for (const Importer& importer : importers::importers()) {
      QVERIFY(ids.insert(importer.id).second);
      QVERIFY(!importer.label.empty() && !importer.source.empty() && importer.read != nullptr);
      std::set<std::string> keys;
      for (const Setting& setting : importer.settings) {
        QVERIFY2(keys.insert(setting.key).second, setting.key.c_str());
        QVERIFY2(!setting.label.empty() && !setting.help.empty(), setting.key.c_str());
      }
      FT_VERIFY_OK(resolveSettings(importer.id, importer.settings, {}));
      QVERIFY(*findImporter(importer.id) == &importer);
    }
    QVERIFY((ids == std::set<std::string>{"nodes", "fcsv", "anser", "plus", "plus_sequence", "columns", "traj"}));
  }

  void unknownIdNamesTheKnown() {
    const auto found = findImporter("xml");
    QVERIFY(!found && found.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(found.error().message, {"'xml'", "fcsv, anser, plus, plus_sequence, columns, traj"}));
  }

  void absentFile_data() { addRows(); }
  void absentFile() {
    const auto import = readWith("absent.dat");
    QVERIFY(!import);
    QVERIFY(import.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"absent.dat", "No such file or directory"}));
  }

  void folderInsteadOfFile_data() { addRows(); }
  void folderInsteadOfFile() {
    const auto import = readWith(".");
    QVERIFY(!import && import.error().code == ErrorCode::kIo);
  }

  void emptyFile_data() { addRows(); }
  void emptyFile() {
    writeFile("empty.dat", "");
    const auto import = readWith("empty.dat");
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"empty.dat"}));
  }

  void sessionIsRefused_data() { addRows(); }
  void sessionIsRefused() {
    writeFile("day.fieldtrue", "1,2,3\n");
    const auto import = readWith("day.fieldtrue");
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"day.fieldtrue: it is a session; open it"}));
  }

  void sessionIsOfNoFormat() {
    writeFile("day.fieldtrue", "1,2,3\n4,5,6\n");
    QVERIFY(recogniseRecording(pathTo("day.fieldtrue")) == nullptr);
    const auto guess = guessColumns(pathTo("day.fieldtrue"));
    QVERIFY(!guess);
    FT_VERIFY_MATCH(holdsAll(guess.error().message, {"day.fieldtrue: it is a session", "tables --session"}));
  }

  void foreignText_data() { addRows(); }
  void foreignText() {
    writeFile("letter.dat", "Dear reader,\n\nthis is no recording.\n");
    const auto import = readWith("letter.dat");
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"letter.dat"}));
  }

 private:
  std::filesystem::path pathTo(const std::string& name) const {
    return std::filesystem::path(folder_.path().toStdString()) / name;
  }
  void writeFile(const std::string& name, const std::string& text) { std::ofstream(pathTo(name)) << text; }
  Result<Import> readWith(const std::string& name) {
    QFETCH(QByteArray, id);
    const Importer& importer = **findImporter(id.toStdString());
    writeFile("truth.csv", "x_true_mm,y_true_mm,z_true_mm\n0,0,0\n");
    return importer.read(pathTo(name), pathTo("truth.csv"), defaults(importer));
  }
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(ImporterContractTest)
#include "importer_contract_test.moc"
