#include <QDir>
#include <QFileInfo>
#include <QSqlDatabase>
#include <QSqlQuery>
#include <QTemporaryDir>
#include <QTest>

#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// What the program says when something is wrong: one line on stderr, nothing on stdout, the right status, nothing
/// lost.
using namespace fieldtrue;
using namespace fieldtrue::testing;

class CliErrorsTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    SyntheticOptions options;
    options.counts = {4, 4, 3};
    options.smooth_distortion_m = 0.02;
    SyntheticNoise noise;
    noise.position_sd_m = 0.0005;
    FT_VERIFY_OK(
        writeNodeTable(std::filesystem::path(at("good.nodes.csv").toStdString()), syntheticTable(options, noise)));
    FT_VERIFY_STATUS(
        runCli({"fit", "--nodes", at("good.nodes.csv"), "--position", "affine", "--out", at("good.ftcal.json")}), 0);
    const QByteArray header = "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n";
    QVERIFY(writeWhole(at("truncated.csv"), header + "0,0,0,0,0.1,0.2,0.3\n1,1,0,0,1.1,0."));
    QVERIFY(writeWhole(at("nan.csv"), header + "0,0,0,0,0.1,nan,0.3\n"));
    QVERIFY(writeWhole(at("repeated.csv"), "visit," + header + "0,7,0,0,0,0.1,0.2,0.3\n0,7,0,0,0,0.1,0.2,0.3\n"));
    QVERIFY(writeWhole(at("no-column.csv"), "node,x_true_m,y_true_m,z_true_m,x_m,y_m\n0,0,0,0,0,0\n"));
    QVERIFY(writeWhole(at("two.csv"), header + "0,0,0,0,0.1,0,0\n1,1,0,0,1.1,0,0\n"));
    QVERIFY(writeWhole(at("text.ftcal.json"), "not a calibration"));
    QByteArray damaged = readWhole(at("good.ftcal.json"));
    const auto digit = damaged.lastIndexOf("0.0");
    QVERIFY(digit > 0);
    damaged[digit + 2] = '7';
    QVERIFY(writeWhole(at("damaged.ftcal.json"), damaged));
    QVERIFY(writeWhole(at("apply-nan.csv"), "x_m,y_m,z_m\n0.1,0.2,0.3\n0.1,nan,0.3\n"));
    QVERIFY(writeWhole(at("apply-cut.csv"), "x_m,y_m,z_m\n0.1,0.2,0.3\n0.1,0."));
    QVERIFY(writeWhole(at("apply-quaternion.csv"), "x_m,y_m,z_m,qw,qx,qy\n0,0,0,1,0,0\n"));
    QVERIFY(writeWhole(at("apply-twice.csv"), "x_m,y_m,z_m,x_corrected_m\n0,0,0,1\n"));
    QVERIFY(writeWhole(at("empty.csv"), ""));
    QVERIFY(writeWhole(at("bad.scene.json"), R"({"schema": "fieldtrue.scene/1", "effects": [{"id": "gremlin"}]})"));
  }

  void isToldInOneLine_data() {
    QTest::addColumn<QString>("arguments");  // separated by blanks; @ stands for the folder
    QTest::addColumn<int>("status");
    QTest::addColumn<QList<QByteArray>>("fragments");
    const auto row = [](const char* name, const char* arguments, int status, const QList<QByteArray>& fragments) {
      QTest::newRow(name) << arguments << status << fragments;
    };
    row("no command", "", 2, {"subcommand"});
    row("unknown command", "calibrate", 2, {"calibrate", "compare"});
    row("missing option", "fit --nodes @/good.nodes.csv", 2, {"required"});
    row("unknown option", "compare --nodes @/good.nodes.csv --colour red", 2, {"no option --colour"});
    row("unknown option in place of a required one", "fit --nodez @/good.nodes.csv --position affine --out @/o.json", 2,
        {"no option --nodez"});
    row("not a number", "simulate --plan grid:2x2x2@0.1 --nodes @/o.csv --seed seven", 2, {"seven"});
    for (const char* seed : {"-1", "99999999999999999999999", "0x10", "1.5", "+3"}) {
      const QByteArray of_seed = QByteArray("--seed ") + seed;
      const QList<QByteArray> told{seed, "from 0 to 18446744073709551615"};
      row(("simulate " + of_seed).constData(),
          ("simulate --plan grid:2x2x2@0.1 --nodes @/o.csv " + of_seed).constData(), 2, told);
      row(("compare " + of_seed).constData(),
          ("compare --nodes @/good.nodes.csv --methods rigid " + of_seed).constData(), 2, told);
    }
    row("no threads", "compare --nodes @/good.nodes.csv --threads 0", 2, {"threads"});
    row("bad plan", "simulate --plan grid:2x2@0.1 --nodes @/o.csv", 2, {"grid"});
    row("unknown method", "compare --nodes @/good.nodes.csv --methods rigid,magic", 2,
        {"magic", "hmq", "hmq_matrix", "affine"});
    row("unknown method to fit", "fit --nodes @/good.nodes.csv --position magic --out @/o.json", 2, {"magic", "hmq"});
    row("unknown setting", "fit --nodes @/good.nodes.csv --position polynomial:order=2 --out @/o.json", 2,
        {"order", "degree"});
    row("setting out of range", "compare --nodes @/good.nodes.csv --methods polynomial:degree=9", 2, {"degree", "9"});
    row("bad validation", "compare --nodes @/good.nodes.csv --validate kfold:x", 2, {"kfold"});
    row("bad alignment", "compare --nodes @/good.nodes.csv --align loose", 2, {"loose", "rigid"});
    row("unknown import format", "import --format xls --in @/good.nodes.csv --nodes @/o.csv", 2, {"xls", "fcsv"});
    row("unknown export format", "export --calibration @/good.ftcal.json --format xls --out @/o", 2, {"xls", "csv"});
    row("nothing to import into", "import --format traj --in @/good.nodes.csv", 2, {"--nodes", "--samples"});
    row("report on nothing", "report --html @/o.html", 2, {"--session", "--nodes"});
    row("unknown device", "acquire --device sonar:/dev/x --plan grid:2x2x2@0.1 --session @/o.fieldtrue", 2,
        {"sonar", "simulated"});
    row("new session without plan", "acquire --device simulated --session @/o.fieldtrue", 2, {"--plan"});
    row("emulator without line", "emulate fastrak", 2, {"--pty", "--listen"});
    row("emulator with two lines", "emulate fastrak --pty @/l --listen 0", 2, {"--pty", "--listen"});
    row("unknown emulator", "emulate sonar --listen 0", 2, {"sonar", "fastrak"});
    row("unknown fault", "emulate fastrak --listen 0 --faults fire", 2, {"fire", "lost_bytes"});

    row("missing table", "compare --nodes @/none.csv", 1, {"none.csv"});
    row("folder as table", "compare --nodes @", 1, {"folder"});
    row("empty table", "compare --nodes @/empty.csv", 1, {"empty.csv"});
    row("truncated table", "compare --nodes @/truncated.csv", 1, {"truncated.csv", "3"});
    row("NaN in table", "compare --nodes @/nan.csv", 1, {"nan.csv", "2", "y_m"});
    row("repeated key", "compare --nodes @/repeated.csv", 1, {"repeated.csv", "3", "7"});
    row("missing column", "compare --nodes @/no-column.csv", 1, {"no-column.csv", "z_m"});
    row("too few nodes", "fit --nodes @/two.csv --position affine --align none --out @/o.json", 1, {"2", "line"});
    row("missing scene", "simulate --scene @/none.scene.json --plan grid:2x2x2@0.1 --nodes @/o.csv", 1,
        {"none.scene.json"});
    row("unknown effect", "simulate --scene @/bad.scene.json --plan grid:2x2x2@0.1 --nodes @/o.csv", 1, {"gremlin"});
    row("missing plan file", "simulate --plan @/none.plan.json --nodes @/o.csv", 1, {"none.plan.json"});
    row("missing calibration", "apply --calibration @/none.ftcal.json --in @/good.nodes.csv --out @/o.csv", 1,
        {"none.ftcal.json"});
    row("not a calibration", "apply --calibration @/text.ftcal.json --in @/good.nodes.csv --out @/o.csv", 1,
        {"text.ftcal.json"});
    row("damaged calibration", "export --calibration @/damaged.ftcal.json --format csv --out @/o.csv", 1,
        {"damaged.ftcal.json"});
    row("apply to NaN", "apply --calibration @/good.ftcal.json --in @/apply-nan.csv --out @/o.csv", 1,
        {"apply-nan.csv", "line 3", "column y_m", "nan"});
    row("apply to a cut table", "apply --calibration @/good.ftcal.json --in @/apply-cut.csv --out @/o.csv", 1,
        {"line 3", "2 fields", "3"});
    row("apply to half an orientation",
        "apply --calibration @/good.ftcal.json --in @/apply-quaternion.csv --out @/o.csv", 1, {"qz"});
    row("apply twice", "apply --calibration @/good.ftcal.json --in @/apply-twice.csv --out @/o.csv", 1,
        {"x_corrected_m", "already"});
    row("apply to nothing", "apply --calibration @/good.ftcal.json --in @/empty.csv --out @/o.csv", 1,
        {"empty.csv", "is empty", "column names"});
    row("apply to a missing table", "apply --calibration @/good.ftcal.json --in @/none.csv --out @/o.csv", 1,
        {"none.csv"});
    row("no such folder to write to", "simulate --plan grid:2x2x2@0.1 --nodes @/none/o.csv", 1, {"none/o.csv"});
    row("missing session", "tables --session @/none.fieldtrue --nodes @/o.csv", 1, {"none.fieldtrue"});
    row("output is the input", "fit --nodes @/good.nodes.csv --position rigid --out @/good.nodes.csv", 2,
        {"--nodes", "--out", "same file", "good.nodes.csv"});
    row("output is the input by another name",
        "apply --calibration @/good.ftcal.json --in @/good.nodes.csv --out @/./good.nodes.csv", 2,
        {"--in", "--out", "same file"});
    row("output is the calibration", "export --calibration @/good.ftcal.json --format csv --out @/good.ftcal.json", 2,
        {"--calibration", "--out", "same file"});
    row("two outputs of one name", "simulate --plan grid:2x2x2@0.3 --nodes @/both.csv --samples @/both.csv", 2,
        {"--nodes", "--samples", "same file"});
    row("not a session", "report --session @/good.nodes.csv --html @/o.html", 1, {"good.nodes.csv"});
    row("port that does not exist",
        "acquire --device fastrak:@/ttyNONE --plan grid:2x2x2@0.1 --auto --session @/port.fieldtrue", 1, {"ttyNONE"});
    row("nobody listens",
        "acquire --device fastrak:tcp:127.0.0.1:1 --plan grid:2x2x2@0.1 --auto --session @/tcp.fieldtrue", 1,
        {"127.0.0.1"});
    row("a trace that is not there",
        "acquire --device trace:@/none.trace.zip --plan grid:2x2x2@0.1 --auto --session @/trace.fieldtrue", 1,
        {"none.trace.zip", "No such file"});
    row("a trace that is none",
        "acquire --device trace:@/good.ftcal.json --plan grid:2x2x2@0.1 --auto --session @/trace.fieldtrue", 1,
        {"good.ftcal.json"});
    row("a table that is no recording",
        "acquire --device trace:@/good.nodes.csv --plan grid:2x2x2@0.1 --auto --session @/trace.fieldtrue", 1,
        {"good.nodes.csv"});
    row("a trace of what has no line",
        "acquire --device trace:@/a.zip --plan grid:2x2x2@0.1 --auto --session @/trace.fieldtrue --trace @/b.zip", 2,
        {"--trace", "line"});
    row("a trace into nowhere",
        "acquire --device simulated --plan grid:2x2x2@0.1 --auto --session @/trace.fieldtrue --trace @/no/b.zip", 2,
        {"--trace", "folder"});
    row("a trace over the session",
        "acquire --device simulated --plan grid:2x2x2@0.1 --auto --session @/trace.fieldtrue --trace @/trace.fieldtrue",
        2, {"--trace", "--session", "same file"});
    row("pty link is taken", "emulate fastrak --pty @/good.nodes.csv --duration 1", 1, {"good.nodes.csv"});
    row("missing recording", "emulate fastrak --listen 0 --replay @/none.samples.csv", 1, {"none.samples.csv"});
  }

  void isToldInOneLine() {
    QFETCH(QString, arguments);
    QFETCH(int, status);
    QFETCH(QList<QByteArray>, fragments);
    QStringList list = arguments.split(' ', Qt::SkipEmptyParts);
    list.replaceInStrings("@/", folder_.path() + "/").replaceInStrings(QRegularExpression("^@$"), folder_.path());
    const CliRun run = runCli(list);
    FT_VERIFY_STATUS(run, status);
    QCOMPARE(run.out, QByteArray());
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), fragments));
    QVERIFY2(run.err.startsWith("fieldtrue-cli"), run.err.constData());
    QCOMPARE(run.err.count('\n'), qsizetype(1));
    for (const QString& file : QDir(folder_.path()).entryList(QDir::Files)) {
      QVERIFY2(!file.startsWith("o.") && !file.contains(".part-"), qPrintable(file + " was left behind"));
    }
    QVERIFY(readWhole(at("good.nodes.csv")).startsWith("#") || readWhole(at("good.nodes.csv")).contains("x_true_m"));
  }

  void applyExplainsAsFitDoes_data() {
    QTest::addColumn<QByteArray>("table");
    QTest::addColumn<QByteArray>("told");  // after the file's name
    const QByteArray truth = "node,x_true_m,y_true_m,z_true_m,";
    const QByteArray head = truth + "x_m,y_m,z_m,qw,qx,qy,qz\n";
    QTest::newRow("columns missing") << truth + "x_m\n0,0,0,0,0.1\n"
                                     << QByteArray(", line 1: the header lacks the required columns y_m, z_m\n");
    QTest::newRow("units in the head")
        << truth + "x_mm,y_mm,z_mm\n0,0,0,0,1,2,3\n"
        << QByteArray(
               ", line 1: the header lacks the required columns x_m, y_m, z_m; it has x_mm, y_mm, z_mm, but a "
               "name must be the same to the letter: it fixes the unit\n");
    QTest::newRow("semicolons") << QByteArray("node;x_true_m;y_true_m;z_true_m;x_m;y_m;z_m\n0;0;0;0;0;0;0\n")
                                << QByteArray("; its fields must be separated by commas\n");
    QTest::newRow("half an orientation") << truth + "x_m,y_m,z_m,qw,qx,qz\n0,0,0,0,1,2,3,1,0,0\n"
                                         << QByteArray("qy (qw, qx, qy, qz belong together: all or none)\n");
    QTest::newRow("text") << head + "0,0,0,0,0.1,left,0.3,1,0,0,0\n"
                          << QByteArray(", line 2, column y_m: 'left' is not a finite number\n");
    QTest::newRow("blank") << head + "0,0,0,0,0.1,,0.3,1,0,0,0\n"
                           << QByteArray(", line 2, column y_m: the field is blank, a number is needed\n");
    QTest::newRow("no rotation") << head + "0,0,0,0,0.1,0.2,0.3,2,0,0,0\n"
                                 << QByteArray(", column qw: the quaternion has length 2, a rotation has length 1\n");
    QTest::newRow("open quote") << head + "\"0,0,0,0,0.1,0.2,0.3,1,0,0,0\n"
                                << QByteArray(", line 2: a quoted field is not closed\n");
    QTest::newRow("cut off") << head + "0,0,0,0,0.1,0."
                             << QByteArray(
                                    ", line 2: the row has 6 fields, the header has 11 columns; the file ends "
                                    "in the middle of this row\n");
    QTest::newRow("UTF-16") << QByteArray("\xFF\xFEn\0o\0d\0e\0", 10) << QByteArray("line 1: this is not UTF-8 text");
    QTest::newRow("empty") << QByteArray() << QByteArray(" is empty; it needs a row of column names\n");
    QTest::newRow("only remarks") << QByteArray("# frame: jig\n")
                                  << QByteArray(" has no header row; it needs a row of column names\n");
  }
  void applyExplainsAsFitDoes() {
    QFETCH(QByteArray, table);
    QFETCH(QByteArray, told);
    QVERIFY(writeWhole(at("explained.csv"), table));
    const CliRun fit =
        runCli({"fit", "--nodes", at("explained.csv"), "--position", "affine", "--out", at("o.ftcal.json")});
    const CliRun apply =
        runCli({"apply", "--calibration", at("good.ftcal.json"), "--in", at("explained.csv"), "--out", at("o.csv")});
    FT_VERIFY_STATUS(fit, 1);
    FT_VERIFY_STATUS(apply, 1);
    QVERIFY2(apply.err.contains(told), apply.err.constData());
    QVERIFY2(fit.err.contains(told), fit.err.constData());
    QVERIFY(!QFileInfo::exists(at("o.csv")));
  }

  void applyTellsOfLinesThatItTookOnTrust() {
    QVERIFY(writeWhole(at("trust.csv"), "# setup.rom: Lab 2\nx_m,y_m,z_m\n# setup.room: Lab 2\n0.1,0.1,0.1"));
    const CliRun run = runCli({"apply", "--calibration", at("good.ftcal.json"), "--in", at("trust.csv"), "--out",
                               at("trusted.csv"), "--force"});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"is setup.room meant?", "line 3", "metadata belongs above it",
                                                     "the last line has no line end"}));
    QVERIFY(readWhole(at("trusted.csv")).contains("\n# setup.room: Lab 2\n0.1,0.1,0.1,"));
  }

  /// More rows than are corrected together, from what cannot be read twice.
  void applyReadsFromAPipe() {
    QProcess shell;
    shell.start("/bin/sh", {"-c",
                            "{ echo x_m,y_m,z_m; i=0; while [ $i -lt 9000 ]; do echo 0.1,0.2,0.1; i=$((i+1)); done; } "
                            "| \"$0\" apply --calibration \"$1\" --in /dev/stdin --force --out /dev/stdout | wc -l",
                            cliPath(), at("good.ftcal.json")});
    const CliRun run = finished(shell, 120000);
    FT_VERIFY_STATUS(run, 0);
    // Head and rows, and the line that tells what was done.
    QCOMPARE(run.out.trimmed(), QByteArray("9002"));
  }

  void anEmptyNameOrSeedIsRefused_data() {
    QTest::addColumn<QString>("arguments");  // ended by the option whose value is left empty
    QTest::addColumn<QByteArray>("told");
    QTest::newRow("output") << "simulate --plan grid:2x2x2@0.1 --nodes" << QByteArray("--nodes needs a file name");
    QTest::newRow("second output") << "simulate --plan grid:2x2x2@0.1 --nodes @/o.csv --samples"
                                   << QByteArray("--samples needs a file name");
    QTest::newRow("page") << "compare --nodes @/good.nodes.csv --methods rigid --html"
                          << QByteArray("--html needs a file name");
    QTest::newRow("input") << "simulate --plan grid:2x2x2@0.1 --nodes @/o.csv --scene"
                           << QByteArray("--scene needs a file name");
    QTest::newRow("plan") << "plan-check --nodes @/good.nodes.csv --plan" << QByteArray("--plan needs a plan");
    QTest::newRow("seed") << "simulate --plan grid:2x2x2@0.1 --nodes @/o.csv --seed"
                          << QByteArray("18446744073709551615");
  }
  void anEmptyNameOrSeedIsRefused() {
    QFETCH(QString, arguments);
    QFETCH(QByteArray, told);
    const CliRun run = runCli(arguments.replace("@/", folder_.path() + "/").split(' ') + QStringList{QString("")});
    FT_VERIFY_STATUS(run, 2);
    QVERIFY2(run.err.contains(told), run.err.constData());
    QCOMPARE(run.err.count('\n'), qsizetype(1));
    QVERIFY(!QFileInfo::exists(at("o.csv")));
  }

  void helpIsNoMistake_data() {
    QTest::addColumn<QStringList>("arguments");
    QTest::newRow("program") << QStringList{"--help"};
    QTest::newRow("version") << QStringList{"--version"};
    for (const char* command : {"simulate", "acquire", "tables", "import", "fit", "compare", "apply", "export",
                                "emulate", "report", "methods", "effects", "devices", "formats"}) {
      QTest::newRow(command) << QStringList{command, "--help"};
    }
  }

  void helpIsNoMistake() {
    QFETCH(QStringList, arguments);
    const CliRun run = runCli(arguments);
    FT_VERIFY_STATUS(run, 0);
    QVERIFY(run.out.size() > 5);
    QCOMPARE(run.err, QByteArray());
  }

  void commandsThatAreNotHereAreNotListed() { QVERIFY(!runCli({"--help"}).out.contains("serve")); }

  void sessionsOfANewerVersionAreLeftAlone() {
    const QString session = at("newer.fieldtrue");
    FT_VERIFY_STATUS(runCli({"acquire", "--device", "simulated:speed=20", "--plan", "grid:1x1x1@0.1", "--auto",
                             "--samples-per-node", "5", "--session", session}),
                     0);
    {
      QSqlDatabase database = QSqlDatabase::addDatabase("QSQLITE", "newer");
      database.setDatabaseName(session);
      QVERIFY(database.open());
      QSqlQuery query(database);
      QVERIFY(query.exec("PRAGMA user_version") && query.next());
      const int version = query.value(0).toInt();
      QVERIFY2(version > 0, "the file states no version");
      query.finish();
      QVERIFY(query.exec(QString("PRAGMA user_version = %1").arg(version + 1)));
      database.close();
    }
    QSqlDatabase::removeDatabase("newer");
    const QByteArray before = readWhole(session);
    const CliRun run = runCli({"tables", "--session", session, "--nodes", at("o.csv")});
    FT_VERIFY_STATUS(run, 1);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"newer.fieldtrue", "newer version"}));
    QCOMPARE(readWhole(session), before);
  }

  void aFullDiskLosesNothing_data() {
    QTest::addColumn<QString>("command");
    QTest::addColumn<QString>("out");
    QTest::newRow("simulate") << "simulate --plan grid:5x5x4@0.1 --samples-per-node 5 --nodes @/full"
                              << "full";
    QTest::newRow("apply") << "apply --calibration @/good.ftcal.json --in @/good.nodes.csv --out @/full"
                           << "full";
    QTest::newRow("fit") << "fit --nodes @/good.nodes.csv --position hmq --out @/full"
                         << "full";
    QTest::newRow("report") << "report --nodes @/good.nodes.csv --methods rigid --validate kfold:3 --html @/full"
                            << "full";
  }

  /// A file size limit of 1 KiB stands for the full disk: writing fails part of the way.
  void aFullDiskLosesNothing() {
    QFETCH(QString, command);
    QFETCH(QString, out);
    QVERIFY(writeWhole(at(out), "what was there before"));
    QProcess shell;
    const QString program = "ulimit -f 2; exec \"$0\" \"$@\"";
    QStringList arguments = command.split(' ');
    arguments.replaceInStrings("@/", folder_.path() + "/");
    shell.start("/bin/sh", QStringList{"-c", program, cliPath()} + arguments);
    const CliRun run = finished(shell, 120000);
    FT_VERIFY_STATUS(run, 1);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"full", "File too large"}));
    QCOMPARE(readWhole(at(out)), QByteArray("what was there before"));
    for (const QString& file : QDir(folder_.path()).entryList(QDir::Files)) QVERIFY(!file.contains(".part-"));
  }

  void anAnswerThatCannotBeWrittenIsAnError() {
    if (!QFileInfo::exists("/dev/full")) QSKIP("this machine has no /dev/full");
    QProcess shell;
    shell.start("/bin/sh", {"-c", "exec \"$0\" methods --json > /dev/full", cliPath()});
    const CliRun run = finished(shell, 60000);
    FT_VERIFY_STATUS(run, 1);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"standard output"}));
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliErrorsTest)
#include "cli_errors_test.moc"
