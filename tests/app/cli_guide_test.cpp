#include <QTemporaryDir>
#include <QTest>
#include <map>

#include "tests/app/guide_text.h"
#include "tests/support/test_main.h"

/// `guide`, and the commands that the pages tell people to type.
using namespace fieldtrue;
using namespace fieldtrue::testing;

class CliGuideTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    QVERIFY2(documents().size() > 10, qPrintable(projectPath("resources/guide") + " has too few pages"));
  }

  void printsTheIndexByItself() {
    const CliRun run = runCli({"guide"});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(run.out, readWhole(projectPath("resources/guide/index.md")));
  }

  void printsEveryPage_data() {
    QTest::addColumn<QString>("path");
    for (const QString& path : documents().mid(1)) QTest::newRow(qPrintable(QFileInfo(path).baseName())) << path;
  }
  void printsEveryPage() {
    QFETCH(QString, path);
    const CliRun run = runCli({"guide", QFileInfo(path).baseName()});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(run.out, readWhole(path));
  }

  void listsThePagesForPrograms() {
    const CliRun run = runCli({"guide", "methods", "--json"});
    FT_VERIFY_STATUS(run, 0);
    const nlohmann::json answer = run.json();
    QCOMPARE(answer.at("page").get<std::string>(), "methods");
    QCOMPARE(answer.at("pages").size(), static_cast<std::size_t>(documents().size() - 1));
  }

  void anUnknownPageIsWrongUsage() {
    const CliRun run = runCli({"guide", "colours"});
    FT_VERIFY_STATUS(run, 2);
    QVERIFY(run.out.isEmpty());
    QCOMPARE(run.err.count('\n'), 1);
    for (const char* part : {"colours", "index", "methods", "blind-check"}) QVERIFY2(run.err.contains(part), run.err);
  }

  void blocksMarkedRunRun_data() {
    QTest::addColumn<QString>("script");
    for (const QString& path : documents()) {
      QString script;
      for (const CodeBlock& block : codeBlocks(path))
        if (block.mark == QLatin1String("sh run")) script += block.text;
      if (!script.isEmpty()) QTest::newRow(qPrintable(QFileInfo(path).baseName())) << script;
    }
  }
  /// As a person types them: in the folder `build`, with the programs in the path.
  void blocksMarkedRunRun() {
    QFETCH(QString, script);
    const QTemporaryDir folder;
    QVERIFY(folder.isValid() && QDir(folder.path()).mkdir("build"));
    QVERIFY(QFile::link(projectPath("resources"), folder.filePath("resources")));
    QProcess shell;
    shell.setWorkingDirectory(folder.filePath("build"));
    QProcessEnvironment environment = QProcessEnvironment::systemEnvironment();
    environment.insert("PATH", QFileInfo(cliPath()).absolutePath() + ":" + environment.value("PATH"));
    shell.setProcessEnvironment(environment);
    shell.start("sh", {"-e", "-x", "-c", script});
    shell.closeWriteChannel();
    FT_VERIFY_STATUS(finished(shell, 600000), 0);
  }

  void blocksMarkedLongAreWhatThereIs_data() {
    QTest::addColumn<QString>("command");
    for (const QString& path : documents()) {
      for (const CodeBlock& block : codeBlocks(path)) {
        if (block.mark != QLatin1String("sh long")) continue;
        const QString name = QStringLiteral("%1:%2").arg(QFileInfo(path).fileName()).arg(block.line);
        int number = 0;
        for (const QString& command : commandsOf(block))
          QTest::newRow(qPrintable(QStringLiteral("%1 (%2)").arg(name).arg(++number))) << command;
      }
    }
  }
  /// Every command and option exists; a script is there.
  void blocksMarkedLongAreWhatThereIs() {
    QFETCH(QString, command);
    const QStringList words = command.split(QLatin1Char(' '), Qt::SkipEmptyParts);
    if (words.first().contains(QLatin1Char('/'))) {
      QVERIFY2(QFileInfo(projectPath(words.first())).isExecutable(), qPrintable(words.first()));
      return;
    }
    QVERIFY2(words.first() == QLatin1String("fieldtrue-cli") || words.first() == QLatin1String("fieldtrue-blind"),
             qPrintable(command));
    QVERIFY(words.size() > 1);
    const QByteArray help = helpOf(words.at(0), words.at(1));
    QVERIFY2(!help.isEmpty(), qPrintable(command + ": no such command"));
    for (const QString& word : words.mid(2)) {
      if (!word.startsWith(QLatin1String("--"))) continue;
      const QRegularExpression option(QStringLiteral("(^|[\\s,])%1([\\s,]|$)").arg(QRegularExpression::escape(word)),
                                      QRegularExpression::MultilineOption);
      QVERIFY2(option.match(QString::fromUtf8(help)).hasMatch(), qPrintable(command + ": no option " + word));
    }
  }

 private:
  /// What `COMMAND --help` prints; empty where there is no such command.
  QByteArray helpOf(const QString& program, const QString& command) {
    const auto [known, is_new] = help_.try_emplace(program + ' ' + command);
    if (!is_new) return known->second;
    QProcess process;
    process.start(QFileInfo(cliPath()).absolutePath() + '/' + program, {command, "--help"});
    const CliRun run = finished(process, 60000);
    if (run.status == 0) known->second = run.out;
    return known->second;
  }

  std::map<QString, QByteArray> help_;
};

FIELDTRUE_TEST(CliGuideTest)
#include "cli_guide_test.moc"
