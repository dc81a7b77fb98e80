#include <QTemporaryDir>
#include <QTest>
#include <random>

#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// `acquire --at-timeout`: what becomes of a take that is not complete within its time.
using namespace fieldtrue;
using namespace fieldtrue::testing;

class CliTimeLimitTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    SampleTable table;
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0.0, 1e-3);
    constexpr int kRate_hz = 60;
    for (int n = 0; n < 400 * kRate_hz; ++n) {
      const Eigen::Vector3d noise_m(normal(random), normal(random), normal(random));
      const Pose pose{Eigen::Vector3d(0.4, 0.0, 0.1) + noise_m, Eigen::Quaterniond::Identity()};
      table.rows.push_back({-1, 0, {n / static_cast<double>(kRate_hz), 0, pose, {}}});
    }
    FT_VERIFY_OK(writeSampleTable(std::filesystem::path(at("noisy.samples.csv").toStdString()), table));
  }

  void byItself_data() {
    QTest::addColumn<QByteArray>("rule");
    QTest::addColumn<QByteArray>("says");
    QTest::addColumn<QByteArray>("ends");
    const QByteArray known = "SUSPICIOUS: mean known to ";
    QTest::newRow("nothing said") << QByteArray() << known << QByteArray("1 of 1 places done, 0 skipped");
    QTest::newRow("keep") << QByteArray("keep") << known << QByteArray("1 of 1 places done, 0 skipped");
    QTest::newRow("skip") << QByteArray("skip") << QByteArray() << QByteArray("0 of 1 places done, 1 skipped");
    QTest::newRow("again") << QByteArray("again") << QByteArray("skipped after 3 takes without success")
                           << QByteArray("0 of 1 places done, 1 skipped");
    // Nobody is there to answer.
    QTest::newRow("ask") << QByteArray("ask") << known << QByteArray("1 of 1 places done, 0 skipped");
  }
  void byItself() {
    QFETCH(QByteArray, rule);
    QFETCH(QByteArray, says);
    QFETCH(QByteArray, ends);
    QStringList arguments = acquire(QStringLiteral("auto-%1.fieldtrue").arg(QString::fromLatin1(rule)));
    arguments << "--auto";
    if (!rule.isEmpty()) arguments << "--at-timeout" << QString::fromLatin1(rule);
    const CliRun run = runCli(arguments);
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2((run.out + run.err).contains(says), (run.out + run.err).constData());
    QVERIFY2(run.out.contains(ends), run.out.constData());
  }

  void theOperatorIsAsked() {
    const QString session = at("ask.fieldtrue");
    QProcess process;
    process.start(cliPath(), acquire("ask.fieldtrue") + QStringList{"--at-timeout", "ask"});
    QVERIFY(waitForLine(process, "^Next: A1").hasMatch());
    process.write("\n");
    QVERIFY(waitForLine(process,
                        "^Time is up at A1.*: mean known to .* not to 0.001 mm, after 30 s.   Enter keeps it, w waits "
                        "longer, a takes again, s skips, q quits")
                .hasMatch());
    process.write("w\n");
    QVERIFY(waitForLine(process, "^Time is up at A1.*after 60 s").hasMatch());
    process.write("a\n");
    QVERIFY(waitForLine(process, "^Time is up at A1.*after 30 s").hasMatch());
    process.write("\n");
    QVERIFY(waitForLine(process, "^A1.*done 1 of 1.*SUSPICIOUS: mean known to").hasMatch());
    FT_VERIFY_STATUS(finished(process, 20000), 0);
    FT_VERIFY_STATUS(runCli({"tables", "--session", session, "--nodes", at("ask.nodes.csv")}), 0);
    const auto nodes = readNodeTable(std::filesystem::path(at("ask.nodes.csv").toStdString()));
    FT_VERIFY_OK(nodes);
    QCOMPARE(nodes->table.nodes.size(), std::size_t{1});
    // Taken again, it has the readings of its last 30 s alone.
    QVERIFY(std::abs(nodes->table.nodes[0].n_used + nodes->table.nodes[0].n_rejected - 1800) <= 2);
  }

  void anotherWordIsRefused() {
    const CliRun run = runCli(acquire("word.fieldtrue") + QStringList{"--at-timeout", "wait"});
    FT_VERIFY_STATUS(run, 2);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"--at-timeout", "'wait'", "keep, again, skip or ask"}));
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }
  QStringList acquire(const QString& session) const {
    return {"acquire", "--device",       "trace:" + at("noisy.samples.csv") + ",rate=20",
            "--plan",  "grid:1x1x1@0.3", "--until",
            "0.001mm", "--session",      at(session)};
  }

  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliTimeLimitTest)
#include "cli_time_limit_test.moc"
