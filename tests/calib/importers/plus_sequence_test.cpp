#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <fstream>

#include "calib/importers/rows.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

namespace {

/// A quarter turn about z at (100, 200, 300) mm; lost; the identity at (-50, 0, 25) mm. Pixels follow.
const std::string kMha =
    "ObjectType = Image\nNDims = 3\nDimSize = 1 1 3\n"
    "Seq_Frame0000_ReferenceToTrackerTransform = 1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n"
    "Seq_Frame0000_ReferenceToTrackerTransformStatus = OK\n"
    "Seq_Frame0000_StylusToTrackerTransform = 0 -1 0 100 1 0 0 200 0 0 1 300 0 0 0 1 \n"
    "Seq_Frame0000_StylusToTrackerTransformStatus = OK\n"
    "Seq_Frame0000_Timestamp = 12.5\n"
    "Seq_Frame0001_StylusToTrackerTransform = 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n"
    "Seq_Frame0001_StylusToTrackerTransformStatus = INVALID\n"
    "Seq_Frame0001_Timestamp = 12.6\n"
    "Seq_Frame0002_StylusToTrackerTransform = 1 0 0 -50 0 1 0 0 0 0 1 25 0 0 0 1\n"
    "Seq_Frame0002_StylusToTrackerTransformStatus = OK\n"
    "Seq_Frame0002_Timestamp = 12.75\n"
    "ElementDataFile = LOCAL\n"
    "Seq_Frame0009_StylusToTrackerTransform = pixels, not text";

}  // namespace

class PlusSequenceTest : public QObject {
  Q_OBJECT

 private slots:
  void readsTheTransformsOfItsHeader() {
    const auto import = read(kMha, {{"transform", "StylusToTracker"}});
    FT_VERIFY_OK(import);
    verifyStylus(*import);
    FT_VERIFY_MATCH(holdsAll(import->notes[0], {"StylusToTracker", "3 frames", "1 of them marked"}));
  }

  void readsNrrdToo() {
    std::string nrrd = "NRRD0004\ntype: unsigned char\n" + kMha.substr(kMha.find("Seq_"));
    for (std::size_t at = nrrd.find(" = "); at != std::string::npos; at = nrrd.find(" = ", at))
      nrrd.replace(at, 3, ":=");
    nrrd.replace(nrrd.find("ElementDataFile:=LOCAL\n"), 23, "\n");
    const auto import = read(nrrd, {{"transform", "StylusToTracker"}});
    FT_VERIFY_OK(import);
    verifyStylus(*import);
  }

  void theOnlyTransformToATrackerNeedsNoName() {
    std::string one = kMha;
    for (std::size_t at = one.find("ReferenceToTracker"); at != std::string::npos; at = one.find("ReferenceToTracker"))
      one.replace(at, 18, "ProbeToReference");
    const auto import = read(one, {});
    FT_VERIFY_OK(import);
    verifyStylus(*import);
  }

  void refuses_data() {
    QTest::addColumn<QString>("from");
    QTest::addColumn<QString>("to");
    QTest::addColumn<QString>("transform");
    QTest::addColumn<QString>("says");
    QTest::newRow("which one") << ""
                               << ""
                               << ""
                               << "ReferenceToTracker, StylusToTracker";
    QTest::newRow("no such one") << ""
                                 << ""
                                 << "ProbeToTracker"
                                 << "no transform ProbeToTracker";
    QTest::newRow("fifteen numbers") << "300 0 0 0 1 "
                                     << "300 0 0 1"
                                     << "StylusToTracker"
                                     << "line 6: a transform needs 16";
    QTest::newRow("seventeen") << "300 0 0 0 1 "
                               << "300 0 0 0 1 1"
                               << "StylusToTracker"
                               << "got more";
    QTest::newRow("a word") << "100 1 0"
                            << "far 1 0"
                            << "StylusToTracker"
                            << "16 finite numbers";
    QTest::newRow("no rotation") << "0 -1 0 100"
                                 << "0 -1 1 100"
                                 << "StylusToTracker"
                                 << "not a rotation";
    QTest::newRow("no time") << "= 12.5\n"
                             << "= noon\n"
                             << "StylusToTracker"
                             << "time stamp 'noon'";
    QTest::newRow("no frames") << "Seq_"
                               << "Sec_"
                               << "StylusToTracker"
                               << "no transforms of frames";
    QTest::newRow("no stamps") << "Timestamp"
                               << "Time"
                               << "StylusToTracker"
                               << "no frame with a time stamp";
  }

  void refuses() {
    QFETCH(const QString, from);
    QFETCH(const QString, to);
    QFETCH(const QString, transform);
    QFETCH(const QString, says);
    QString text = QString::fromStdString(kMha);
    if (!from.isEmpty()) text.replace(from, to);
    const auto import = read(text.toStdString(), {{"transform", transform.toStdString()}});
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"sequence.mha", says.toUtf8()}));
  }

 private:
  Result<Import> read(const std::string& content, const std::map<std::string, std::string>& given) {
    const std::filesystem::path path = folder_.filePath("sequence.mha").toStdString();
    std::ofstream(path) << content;
    const Importer importer = plusSequenceImporter();
    std::map<std::string, std::string> named;
    for (const auto& [key, value] : given)
      if (!value.empty()) named[key] = value;
    const auto settings = resolveSettings(importer.id, importer.settings, named);
    if (!settings) return tl::unexpected(settings.error());
    return importer.read(path, std::nullopt, *settings);
  }

  static void verifyStylus(const Import& import) {
    QVERIFY(!import.table && import.samples);
    const std::vector<SampleRow>& rows = import.samples->rows;
    QCOMPARE(rows.size(), std::size_t{3});
    const Pose quarter{{0.1, 0.2, 0.3}, Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5))};
    FT_VERIFY_MATCH(near(rows[0].sample.tracker_from_sensor, quarter, 1e-15, 1e-15));
    FT_VERIFY_MATCH(near(rows[2].sample.tracker_from_sensor, Pose{{-0.05, 0, 0.025}, {1, 0, 0, 0}}, 1e-15, 1e-15));
    QCOMPARE(rows[1].sample.status, std::string("INVALID"));
    QVERIFY(rows[0].sample.status.empty() && rows[0].sample.time_s == 0.0 && rows[2].sample.time_s == 0.25);
  }

  QTemporaryDir folder_;
};

FIELDTRUE_TEST(PlusSequenceTest)
#include "plus_sequence_test.moc"
