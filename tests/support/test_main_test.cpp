#include "tests/support/test_main.h"

#include <QFile>
#include <QProcess>
#include <QTemporaryDir>
#include <QTest>

using fieldtrue::testing::kSkippedStatus;

/// What the test below runs in a process of its own, picked by the names of functions.
class Sample : public QObject {
  Q_OBJECT
 private slots:
  void passes() {}
  void fails() { QFAIL("on purpose"); }
  void skips() { QSKIP("no colour \x1b[31m here\nnor there"); }
  void skipsOneRow_data() {
    QTest::addColumn<bool>("skipped");
    QTest::newRow("kept") << false;
    QTest::newRow("left & out") << true;
  }
  void skipsOneRow() {
    QFETCH(bool, skipped);
    if (skipped) QSKIP("this row needs a moon");
  }
  void failsManyTimes_data() {
    QTest::addColumn<int>("k");
    for (int k = 0; k < kSkippedStatus; ++k) QTest::addRow("%d", k) << k;
  }
  void failsManyTimes() { QFAIL("on purpose"); }
};

class TestMainTest : public QObject {
  Q_OBJECT
 private slots:
  void statusSaysWhatRan_data() {
    QTest::addColumn<QStringList>("functions");
    QTest::addColumn<int>("status");
    QTest::newRow("all pass") << QStringList{"passes"} << 0;
    QTest::newRow("only a skip") << QStringList{"skips"} << 77;
    QTest::newRow("a pass and a skip") << QStringList{"passes", "skips"} << 77;
    QTest::newRow("one row skipped") << QStringList{"skipsOneRow"} << 77;
    QTest::newRow("a failure") << QStringList{"passes", "fails"} << 1;
    QTest::newRow("a failure after a skip") << QStringList{"skips", "fails"} << 1;
    QTest::newRow("a skip after a failure") << QStringList{"fails", "skips"} << 1;
    QTest::newRow("77 failures are no skip") << QStringList{"failsManyTimes"} << 1;
    QTest::newRow("no such function") << QStringList{"sings"} << 1;
  }
  void statusSaysWhatRan() {
    QFETCH(QStringList, functions);
    QFETCH(int, status);
    run(functions);
    QVERIFY2(status_ == status, qPrintable(QString("%1\n%2%3").arg(status_).arg(out_, err_)));
  }

  void reasonsArePrinted() {
    run({"skips", "skipsOneRow"});
    QCOMPARE(err_, QString("SKIPPED Sample::skips: no colour ?[31m here nor there\n"
                           "SKIPPED Sample::skipsOneRow(left & out): this row needs a moon\n"));
    run({"fails", "skips"});
    QCOMPARE(err_, QString("SKIPPED Sample::skips: no colour ?[31m here nor there\n"));
  }

  void logsThatWereAskedForAreWritten_data() {
    QTest::addColumn<QStringList>("options");
    QTest::addColumn<QString>("on_stdout");
    QTest::addColumn<QString>("in_file");
    QTest::newRow("nothing asked") << QStringList{} << "SKIP   : Sample::skips()" << QString();
    QTest::newRow("a format") << QStringList{"-tap"} << "TAP version 13" << QString();
    QTest::newRow("a file") << QStringList{"-o", "LOG"} << QString() << "SKIP   : Sample::skips()";
    QTest::newRow("a file and a format") << QStringList{"-o", "LOG", "-junitxml"} << QString() << "<testsuite name=";
    QTest::newRow("a file with its format") << QStringList{"-o", "LOG,junitxml"} << QString() << "<testsuite name=";
    QTest::newRow("two logs") << QStringList{"-o", "LOG,xml", "-o", "-,txt"} << "SKIP   : Sample::skips()"
                              << "<TestCase";
  }
  void logsThatWereAskedForAreWritten() {
    QFETCH(QStringList, options);
    QFETCH(QString, on_stdout);
    QFETCH(QString, in_file);
    QTemporaryDir folder;
    const QString log = folder.filePath("log");
    options.replaceInStrings("LOG", log);
    run(options + QStringList{"passes", "skips"});
    QCOMPARE(status_, kSkippedStatus);
    QVERIFY2(on_stdout.isEmpty() ? out_.isEmpty() : out_.contains(on_stdout), qPrintable(out_));
    QFile file(log);
    QCOMPARE(file.open(QIODevice::ReadOnly), !in_file.isEmpty());
    if (!in_file.isEmpty()) QVERIFY(QString::fromUtf8(file.readAll()).contains(in_file));
  }

  void functionsAreListed() {
    run({"-functions"});
    QCOMPARE(status_, 0);
    QVERIFY2(out_.startsWith("passes()\nfails()\nskips()\n"), qPrintable(out_));
  }

 private:
  /// Runs the sample with arguments; fills status_, out_ and err_.
  void run(const QStringList& arguments) {
    QProcess sample;
    sample.start(QCoreApplication::applicationFilePath(), QStringList("sample") + arguments);
    const bool ended = sample.waitForFinished() && sample.exitStatus() == QProcess::NormalExit;
    status_ = ended ? sample.exitCode() : -1;
    out_ = QString::fromLocal8Bit(sample.readAllStandardOutput());
    err_ = QString::fromLocal8Bit(sample.readAllStandardError());
  }

  int status_ = -1;
  QString out_;
  QString err_;
};

int main(int argc, char** argv) {
  QCoreApplication application(argc, argv);
  if (argc > 1 && qstrcmp(argv[1], "sample") == 0) {
    Sample sample;
    return fieldtrue::testing::runTest(sample, argc - 1, argv + 1);
  }
  TestMainTest test;
  return fieldtrue::testing::runTest(test, argc, argv);
}

#include "test_main_test.moc"
