#include <QFileInfo>
#include <QProcess>
#include <QTemporaryDir>
#include <QTest>
#include <filesystem>

#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"
#include "tests/support/xml_tree.h"

/// The command line draws nothing itself: fieldtrue-pictures beside it does, and a page is written without it too.
using namespace fieldtrue;
using namespace fieldtrue::testing;

class CliPicturesTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }

  /// A copy of the command line in a folder where nothing else is.
  CliRun runAlone(const QStringList& arguments) {
    QProcess process;
    process.start(at("bin/fieldtrue-cli"), arguments);
    process.closeWriteChannel();
    return finished(process, 300000);
  }

  QStringList report(const QString& page) {
    return {"report", "--nodes", at("some.csv"), "--methods", "rigid,affine", "--validate", "kfold:3", "--html", page};
  }

  /// The page's words about pictures that are not there.
  QStringList noticesIn(const QString& page) {
    QString error;
    const auto html = parseXml(readWhole(page), error);
    QStringList notices;
    for (const XmlElement* p : html->all("p"))
      if (p->hasClass("notice") && p->text.contains("Pictures")) notices.push_back(p->text);
    return notices;
  }

  void putBesideIt(const QByteArray& script) {
    const QString path = at("bin/fieldtrue-pictures");
    QVERIFY(writeWhole(path, script));
    QVERIFY(QFile::setPermissions(path, QFile::ReadOwner | QFile::WriteOwner | QFile::ExeOwner));
  }

 private slots:
  void initTestCase() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("some.csv").toStdString()), syntheticTable(options)));
    QVERIFY(QDir(folder_.path()).mkdir("bin"));
    QVERIFY(QFile::copy(cliPath(), at("bin/fieldtrue-cli")));
  }

  void cleanup() { QFile::remove(at("bin/fieldtrue-pictures")); }

  void itLinksNothingThatDraws() {
    QProcess ldd;
    ldd.start("ldd", {cliPath()});
    QVERIFY(ldd.waitForFinished());
    const QByteArray libraries = ldd.readAllStandardOutput();
    QVERIFY(libraries.contains("libQt6Core"));
    for (const char* drawing : {"libvtk", "libEGL", "libGL", "libOpenGL", "libQt6Gui", "libQt6Widgets"})
      QVERIFY2(!libraries.contains(drawing), drawing);
  }

  void withoutTheProgramThePageSaysSoInOneLine() {
    const CliRun run = runAlone(report(at("alone.html")));
    FT_VERIFY_STATUS(run, 0);
    const QStringList notices = noticesIn(at("alone.html"));
    QCOMPARE(notices.size(), 1);
    QCOMPARE(notices.first(),
             "Pictures could not be drawn: fieldtrue-pictures is not beside this program, in " + at("bin") + ".");
    QVERIFY(!readWhole(at("alone.html")).contains("<img"));
  }

  void aProgramThatFailsDoesNotFailTheReport_data() {
    QTest::addColumn<QByteArray>("script");
    QTest::addColumn<QString>("why");
    QTest::newRow("ends early") << QByteArray("#!/bin/sh\nexit 3\n") << "ended with status 3";
    QTest::newRow("is killed") << QByteArray("#!/bin/sh\nkill -9 $$\n") << "ended by the system";
    QTest::newRow("is no program") << QByteArray(
                                          "\x7f"
                                          "ELF and no more")
                                   << "cannot be started";
    QTest::newRow("answers nonsense") << QByteArray("#!/bin/sh\ncat >/dev/null\necho nonsense\n")
                                      << "not of one version";
    QTest::newRow("answers nothing") << QByteArray("#!/bin/sh\ncat >/dev/null\n") << "not of one version";
  }
  void aProgramThatFailsDoesNotFailTheReport() {
    QFETCH(QByteArray, script);
    QFETCH(QString, why);
    putBesideIt(script);
    FT_VERIFY_STATUS(runAlone(report(at("failed.html"))), 0);
    const QStringList notices = noticesIn(at("failed.html"));
    QCOMPARE(notices.size(), 1);
    QVERIFY2(notices.first().contains(why), qPrintable(notices.first()));
  }

  void theProgramItselfSaysWhoAsksIt() {
    const QString path = QFileInfo(cliPath()).path() + "/fieldtrue-pictures";
    QVERIFY2(QFileInfo(path).isExecutable(), "fieldtrue-pictures is not built");
    QProcess program;
    program.start(path, QStringList{});
    program.write("anything");
    program.closeWriteChannel();
    const CliRun run = finished(program, 60000);
    QCOMPARE(run.status, 1);
    QVERIFY2(run.err.contains("draws for fieldtrue-cli"), run.err);
  }
};

FIELDTRUE_TEST(CliPicturesTest)
#include "cli_pictures_test.moc"
