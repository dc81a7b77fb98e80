#include <sys/stat.h>
#include <unistd.h>

#include <QDir>
#include <QFileInfo>
#include <QTemporaryDir>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

/// Sends one entry of the index of the actions to a row that is not there. Nothing of the file's structure is wrong, so
/// that it opens; the rows end in an error in the middle.
/// @return whether the entry was found
bool damageIndex(QByteArray& file) {
  const auto byte = [&file](qsizetype at) { return static_cast<unsigned char>(file[at]); };
  const auto two = [&byte](qsizetype at) { return 256 * byte(at) + byte(at + 1); };
  const qsizetype page_size = two(16);
  for (qsizetype page = page_size; page < file.size(); page += page_size) {
    constexpr unsigned char kIndexLeaf = 0x0a;
    const int n_cells = two(page + 3);
    if (byte(page) != kIndexLeaf || n_cells < 8) continue;
    const qsizetype cell = page + two(page + 8 + qsizetype{2} * (n_cells / 2));
    // Place, id and row id, of one byte each.
    if (byte(cell + 1) != 4 || byte(cell + 2) != 1 || byte(cell + 3) != 1 || byte(cell + 4) != 1) continue;
    file[cell + 7] = 0x7f;
    return true;
  }
  return false;
}

/// Runs the program as somebody whom permission bits bind, also where the tests run as root.
CliRun runAsSomebody(const QStringList& arguments) {
  QProcess process;
  if (geteuid() == 0) {
    process.setChildProcessModifier([] {
      constexpr uid_t kNobody = 65534;
      if (setresgid(kNobody, kNobody, kNobody) != 0 || setresuid(kNobody, kNobody, kNobody) != 0) _exit(98);
    });
  }
  process.start(cliPath(), arguments);
  process.closeWriteChannel();
  return finished(process, 60000);
}

void setMode(const QString& path, mode_t mode) { QVERIFY(chmod(path.toLocal8Bit().constData(), mode) == 0); }

}  // namespace

/// Sessions on the command line: damaged ones, and ones that cannot be written to.
class CliSessionTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }
  QByteArray recorded_;

 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    FT_VERIFY_STATUS(runCli({"acquire", "--device", "simulated:speed=20", "--plan", "grid:3x3x2@0.15", "--auto",
                             "--samples-per-node", "10", "--session", at("whole.fieldtrue")}),
                     0);
    recorded_ = readWhole(at("whole.fieldtrue"));
  }

  void aDamagedSessionGivesNoTable() {
    QByteArray bytes = recorded_;
    QVERIFY(damageIndex(bytes));
    const QString session = at("damaged.fieldtrue");
    QVERIFY(writeWhole(session, bytes));
    const QList<QStringList> commands{
        {"tables", "--session", session, "--nodes", at("n.csv"), "--samples", at("s.csv")},
        {"report", "--session", session, "--html", at("r.html"), "--methods", "affine"},
        {"acquire", "--session", session, "--device", "simulated:speed=20", "--auto"}};
    for (const QStringList& command : commands) {
      const CliRun run = runCli(command);
      FT_VERIFY_STATUS(run, 1);
      FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {session.toUtf8() + ": the session file is damaged"}));
    }
    for (const char* name : {"n.csv", "s.csv", "r.html"}) QVERIFY2(!QFileInfo::exists(at(name)), name);
  }

  void aWriteProtectedSessionIsReadAndToldOf() {
    QVERIFY(QDir(folder_.path()).mkdir("medium") && QDir(folder_.path()).mkdir("out"));
    const QString session = at("medium/jig.fieldtrue");
    QVERIFY(writeWhole(session, recorded_));
    setMode(folder_.path(), 0755);
    setMode(at("out"), 0777);
    setMode(session, 0444);
    setMode(at("medium"), 0555);
    const CliRun run =
        runAsSomebody({"tables", "--session", session, "--nodes", at("out/n.csv"), "--samples", at("out/s.csv")});
    const CliRun again = runAsSomebody({"acquire", "--session", session, "--device", "simulated:speed=20", "--auto"});
    setMode(at("medium"), 0755);
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.out.contains("18 places"), run.out.constData());
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"note: " + session.toUtf8(), "a private copy was opened"}));
    FT_VERIFY_STATUS(again, 1);
    FT_VERIFY_MATCH(holdsAll(again.err.toStdString(), {"nothing will be stored", "can be written to"}));
    QCOMPARE(readWhole(session), recorded_);
  }
};

FIELDTRUE_TEST(CliSessionTest)
#include "cli_session_test.moc"
