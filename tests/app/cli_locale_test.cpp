#include <QProcessEnvironment>
#include <QTemporaryDir>
#include <clocale>
#include <cstdlib>

#include "tests/app/cli_program.h"
#include "tests/support/test_main.h"

using namespace fieldtrue::testing;

/// A desktop with a decimal comma changes no number in a file or on stdout.
class CliLocaleTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    ::setenv("LOCPATH", FIELDTRUE_COMMA_LOCALES, 1);
    const bool german = std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
    std::setlocale(LC_NUMERIC, "C");
    if (!german) QSKIP("there is no German locale: install the package locales");
  }

  void sameFilesAndAnswers() {
    // Not plain C: Qt warns there that it is not UTF-8.
    const QByteArray with_points = tablesAndAnswers("C.UTF-8");
    QVERIFY(with_points.contains("0.3048"));
    QCOMPARE(tablesAndAnswers("de_DE.UTF-8"), with_points);
  }

 private:
  /// What a simulation writes and what is read from it again, all in one text.
  static QByteArray tablesAndAnswers(const char* locale) {
    QTemporaryDir folder;
    const QString nodes = folder.filePath("nodes.csv");
    const QString corrected = folder.filePath("corrected.csv");
    const QString calibration = folder.filePath("room.ftcal.json");
    ::setenv("LC_ALL", locale, 1);
    QByteArray all;
    for (const QStringList& arguments :
         {QStringList{"simulate", "--plan", "grid:4x4x3@0.3048", "--seed", "5", "--nodes", nodes},
          QStringList{"fit", "--nodes", nodes, "--position", "rbf:smoothing=0.25", "--out", calibration},
          QStringList{"apply", "--calibration", calibration, "--in", nodes, "--out", corrected}}) {
      const CliRun run = runCli(arguments);
      all += run.out + run.err;
    }
    ::unsetenv("LC_ALL");
    all += readWhole(nodes) + readWhole(corrected);
    return all.replace(folder.path().toUtf8(), "folder");
  }
};

FIELDTRUE_TEST(CliLocaleTest)
#include "cli_locale_test.moc"
