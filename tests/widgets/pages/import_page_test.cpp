#include "widgets/pages/import_page.h"

#include <QComboBox>
#include <QDragEnterEvent>
#include <QLabel>
#include <QLineEdit>
#include <QMimeData>
#include <QPushButton>
#include <QTest>
#include <QThreadPool>
#include <QUrl>

#include "acquisition/session/imported_session.h"
#include "acquisition/session/session_store.h"
#include "calib/exporters/export_calibration.h"
#include "calib/exporters/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/widgets/pages/window_driver.h"
#include "widgets/style/theme.h"

/// A file of another program is dropped on the window, and what comes of it is worked with.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

class ImportPageTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() { showWindow(); }

  void cleanupTestCase() { closeWindow(); }

  void aTableOfTextIsGuessedAndBecomesASession() {
    const CalibrationTable table = recorded();
    QString text = QStringLiteral("Point;X [mm];Y [mm];Z [mm];X_ref [mm];Y_ref [mm];Z_ref [mm]\n");
    for (const Node& node : table.nodes) {
      QStringList fields{QString::number(node.node)};
      for (const Pose& pose : {node.tracker_from_sensor, node.reference_from_sensor})
        for (const double value_m : pose.position_m)
          fields << QString::number(1000.0 * value_m, 'f', 4).replace(QLatin1Char('.'), QLatin1Char(','));
      text += fields.join(QLatin1Char(';')) + QLatin1Char('\n');
    }
    drop(write("room_measured.txt", text));
    QVERIFY(onPage("page_import"));
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("importMake")->isEnabled(), kWaitMs);
    FT_VERIFY_MATCH(holdsAll(told("importGuess"), {"X_ref [mm]", "unit: mm"}));
    FT_VERIFY_MATCH(
        holdsAll(told("importSummary"), {QByteArray::number(table.nodes.size()) + " places", "means only"}));
    QCOMPARE(find<QComboBox>("column_Point")->currentText(), QStringLiteral("Place"));
    picture("8-import");
    const QString session = find<QLineEdit>("importTarget")->text();
    click("importMake");
    QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().sessionPath(), session, kWaitMs);
    QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().recordedTable().nodes.size(), table.nodes.size(), kWaitMs);
    QVERIFY(onPage("page_compare"));
    const CalibrationTable opened = window_->workbench().recordedTable();
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      QCOMPARE(opened.nodes[i].node, table.nodes[i].node);
      const Eigen::Vector3d off_m =
          opened.nodes[i].tracker_from_sensor.position_m - table.nodes[i].tracker_from_sensor.position_m;
      QVERIFY(off_m.norm() < 1e-7 && !opened.nodes[i].has_orientation);
    }
  }

  void whatCannotBeToldIsAsked() {
    drop(write("plain.txt", "0 0 0 0 0 0\n60 0 0 60 0 0\n0 60 0 0 60 0\n0 0 60 0 0 60\n60 60 60 60 60 60\n"));
    QTRY_VERIFY_WITH_TIMEOUT(told("importSummary").find("Choose the unit") != std::string::npos, kWaitMs);
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
    find<QComboBox>("setting_unit")->setCurrentText(QStringLiteral("in"));
    QTRY_VERIFY_WITH_TIMEOUT(told("importSummary").find("must name columns") != std::string::npos, kWaitMs);
    choose("column_column1", "x");
    choose("column_column2", "y");
    choose("column_column3", "z");
    QTRY_VERIFY_WITH_TIMEOUT(told("importSummary").find("no true positions") != std::string::npos, kWaitMs);
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
    choose("column_column4", "x_true");
    choose("column_column5", "y_true");
    choose("column_column6", "z_true");
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("importMake")->isEnabled(), kWaitMs);
    FT_VERIFY_MATCH(holdsAll(told("importSummary"), {"5 places", "1.524 m"}));
  }

  void oneColumnToARole() {
    choose("column_column1", "x_true");
    QCOMPARE(find<QComboBox>("column_column4")->currentData().toString(), QString());
    QTRY_VERIFY_WITH_TIMEOUT(told("importSummary").find("belong together") != std::string::npos, kWaitMs);
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
  }

  void anotherProgramsCalibrationIsHeldAgainstOurs() {
    const CalibrationTable table = recorded();
    const auto corrector = calibration::Corrector::fit(
        table.nodes, table.metadata, calibration::parseCorrectorChoice("polynomial:degree=2", "none").value(),
        calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    const QString path = folder_.filePath("theirs.vti");
    const exporters::Exporter& exporter = *exporters::findExporter("vtk_vti").value();
    FT_VERIFY_OK(exporters::exportCalibration(exporter, *corrector, {}, path.toStdString(), {}));
    drop(path);
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("importMake")->isEnabled(), kWaitMs);
    FT_VERIFY_MATCH(holdsAll(told("importSummary"), {"theirs.vti", "measured to true"}));
    const QString target = find<QLineEdit>("importTarget")->text();
    click("importMake");
    QTRY_VERIFY_WITH_TIMEOUT(QFileInfo::exists(target), kWaitMs);
    auto* action = find<QWidget>("messageLine")->findChild<QPushButton*>();
    QTRY_VERIFY_WITH_TIMEOUT(action->isVisible(), kWaitMs);
    QTest::mouseClick(action, Qt::LeftButton);
    QVERIFY(onPage("page_difference"));
    QCOMPARE(find<QLineEdit>("differenceFirst")->text(), target);
    // A second time nothing is replaced.
    drop(path);
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("importMake")->isEnabled(), kWaitMs);
    const QDateTime written = QFileInfo(target).lastModified();
    click("importMake");
    QCOMPARE(QFileInfo(target).lastModified(), written);
  }

  void whatWasMadeMeanwhileOffersNothingMore() {
    const QString target = folder_.filePath("meanwhile.ftcal.json");
    drop(folder_.filePath("theirs.vti"));
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("importMake")->isEnabled(), kWaitMs);
    find<QLineEdit>("importTarget")->setText(target);
    click("importMake");
    window_->workbench().importFile({});
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
    QTRY_VERIFY_WITH_TIMEOUT(isSaid("meanwhile.ftcal.json"), kWaitMs);
    QVERIFY(QFileInfo::exists(target));
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
    FT_VERIFY_MATCH(holdsAll(told("importSummary"), {"Choose a file"}));
  }

  /// To read the file of an open session would drop the lock on it.
  void aSessionIsOpenedAndNotRead() {
    const QString path = folder_.filePath("day.FIELDTRUE");
    FT_VERIFY_OK(acquisition::makeSession(path, recorded(), {}, "day.csv"));
    window_->workbench().importFile(path);
    QVERIFY(find<QLineEdit>("importFile")->text().isEmpty());
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
    QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().sessionPath(), path, kWaitMs);
    window_->workbench().importFile(path);
    FT_VERIFY_MATCH(holdsAll(told("importSummary"), {"day.FIELDTRUE is the session that is open"}));
    // Dropped on the window it does not come to this page.
    find<QLineEdit>("importFile")->setText(QStringLiteral("theirs.csv"));
    drop(path);
    QCOMPARE(find<QLineEdit>("importFile")->text(), QStringLiteral("theirs.csv"));
  }

  void whatIsNoFileIsSaid() {
    drop(folder_.filePath("absent.txt"));
    QTRY_VERIFY_WITH_TIMEOUT(told("importSummary").find("absent.txt") != std::string::npos, kWaitMs);
    drop(write("letter.txt", "Dear all,\nthe tracker is in room 2.\n"));
    QTRY_VERIFY_WITH_TIMEOUT(told("importSummary").find("no table") != std::string::npos, kWaitMs);
    QVERIFY(!find<QPushButton>("importMake")->isEnabled());
  }

 private:
  static CalibrationTable recorded() {
    SyntheticOptions options;
    options.counts = {5, 4, 3};
    options.smooth_distortion_m = 0.01;
    CalibrationTable table = syntheticTable(options, {.seed = 3});
    table.metadata.alignment_known = true;
    return table;
  }

  QString write(const char* name, const QString& text) {
    QFile file(folder_.filePath(name));
    if (!file.open(QIODevice::WriteOnly) || file.write(text.toUtf8()) < 0) qFatal("not written");
    return file.fileName();
  }

  void drop(const QString& path) {
    QMimeData data;
    data.setUrls({QUrl::fromLocalFile(path)});
    QDragEnterEvent enters(QPoint(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(window_.get(), &enters);
    QDropEvent event(QPointF(100, 100), Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(window_.get(), &event);
  }

  void choose(const char* column, const char* role) {
    auto* choice = find<QComboBox>(column);
    choice->setCurrentIndex(choice->findData(QString::fromLatin1(role)));
  }

  bool isSaid(const char* words) {
    const auto labels = find<QWidget>("messageLine")->findChildren<QLabel*>();
    return std::any_of(labels.begin(), labels.end(),
                       [&](const QLabel* label) { return label->text().contains(QLatin1String(words)); });
  }

  std::string told(const char* label) { return find<QLabel>(label)->text().toStdString(); }
};

FIELDTRUE_WINDOW_TEST(ImportPageTest)
#include "import_page_test.moc"
