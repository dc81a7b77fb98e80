#include <QSqlDatabase>
#include <QSqlQuery>
#include <QTemporaryDir>
#include <QTest>
#include <cstdio>

#include "acquisition/session/session_store.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/raw_sql.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using testing::Bench;
using testing::fullMetadata;
using testing::smallPlan;

/// A medium that goes bad under an open session: a read that fails midway is an error, never a part of the answer.
class SessionDamageTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString whole_ = folder_.filePath("whole.fieldtrue");
  int n_files_ = 0;

  /// Every table larger than SQLite's cache (2 MB), so that a damaged page is read from the file.
  void makeLarge() {
    const QStringList statements{
        "INSERT INTO actions(place, kind, reason, time_utc) WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 "
        "FROM n WHERE i < 59999) SELECT i % 12, 'take', 'long ago, and a text of some length', '2024' FROM n",
        "INSERT INTO takes SELECT id, 0,1,1,1, 1,0,0,0, 1e-8,1e-8,1e-8,0,0,0, 1e-3, 0.1,50,1e-5,60,0, id, id+1 "
        "FROM actions WHERE id NOT IN (SELECT action FROM takes)",
        "INSERT INTO samples WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 3999) "
        "SELECT id, i, 0, i * 0.01, 1.1,1.2,1.3, 1,0,0,0, '', NULL FROM n, actions WHERE actions.id > 59988",
        "INSERT INTO events(time_utc, kind, text) WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n "
        "WHERE i < 79999) SELECT '2024', 'device', 'lost, and a text of some length' FROM n"};
    testing::runSql(whole_, statements);
  }

  /// The number of a leaf page of the table, `share` of the way through it.
  qint64 leafOf(const QString& table, double share) {
    qint64 page = 0;
    {
      QSqlDatabase database = QSqlDatabase::addDatabase("QSQLITE", "leaf");
      database.setDatabaseName(whole_);
      if (database.open()) {
        QSqlQuery query(database);
        query.exec(
            QString("SELECT pageno FROM dbstat WHERE name = '%1' AND pagetype = 'leaf' ORDER BY path").arg(table));
        QList<qint64> pages;
        while (query.next()) pages << query.value(0).toLongLong();
        if (!pages.isEmpty()) page = pages[static_cast<qsizetype>(share * static_cast<double>(pages.size() - 1))];
      }
      database.close();
    }
    QSqlDatabase::removeDatabase("leaf");
    return page;
  }

  QString freshCopy() {
    const QString path = folder_.filePath(QString("%1.fieldtrue").arg(n_files_++));
    if (!QFile::copy(whole_, path)) qFatal("not copied");
    return path;
  }

  static void damage(const QString& path, qint64 page) {
    QVERIFY2(page > 1, "the page was not found");
    QFile file(path);
    QVERIFY(file.open(QIODevice::ReadWrite));
    QVERIFY(file.seek((page - 1) * 4096));
    QCOMPARE(file.write(QByteArray(4096, '\x5a')), qint64{4096});
  }

 private slots:
  void initTestCase() {
    { FT_VERIFY_OK(SessionStore::create(whole_, smallPlan(), fullMetadata())); }
    makeLarge();
  }

  void aReadThatFailsMidwayIsAnError_data() {
    QTest::addColumn<QString>("table");
    QTest::addColumn<QString>("what");
    QTest::newRow("nodes") << "actions"
                           << "nodes";
    QTest::newRow("the last nodes") << "takes"
                                    << "nodes";
    QTest::newRow("samples") << "samples"
                             << "samples";
    QTest::newRow("events") << "events"
                            << "events";
    QTest::newRow("states") << "actions"
                            << "states";
  }
  void aReadThatFailsMidwayIsAnError() {
    QFETCH(QString, table);
    QFETCH(QString, what);
    const QString path = freshCopy();
    const auto store = SessionStore::open(path);
    FT_VERIFY_OK(store);
    const auto read = [&store, &what]() -> Result<std::size_t> {
      const auto counted = [](const auto& result, const auto& size) -> Result<std::size_t> {
        if (!result) return tl::unexpected(result.error());
        return size(*result);
      };
      const auto size = [](const auto& rows) { return rows.size(); };
      if (what == "nodes") return counted(store->nodeTable(), [](const auto& t) { return t.nodes.size(); });
      if (what == "samples") return counted(store->sampleTable(), [](const auto& t) { return t.rows.size(); });
      return what == "events" ? counted(store->events(), size) : counted(store->states(), size);
    };
    FT_VERIFY_OK(read());
    // Other rows take the cache's place.
    FT_VERIFY_OK(what == "events" ? store->sampleTable().map([](const auto&) {})
                                  : store->events().map([](const auto&) {}));
    damage(path, leafOf(table, table == "takes" ? 1.0 : 0.5));
    const auto partial = read();
    QVERIFY2(!partial, "a part of the rows was taken for all");
    QVERIFY(partial.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(testing::holdsAll(partial.error().message, {path.toUtf8(), "damaged"}));
  }

  void aTakeThatCannotBeReadBackIsToldAndNothingEnds() {
    const QString path = freshCopy();
    Bench bench(path, smallPlan(), false);
    QVERIFY2(bench.failures.isEmpty(), qPrintable(bench.failures.join('\n')));
    bench.controller.goTo(0);
    const int before = static_cast<int>(bench.stored.size());
    bench.readTables();
    damage(path, leafOf("actions", 0.5));
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(3.0);
    // The takes of this copy are made up, and what is far from them is asked for twice.
    bench.controller.take();
    bench.tracker->stand(3.0);
    QCOMPARE(static_cast<int>(bench.stored.size()), before);
    QCOMPARE(bench.take_failures.size(), 1);
    QVERIFY2(bench.take_failures[0].contains("damaged"), qPrintable(bench.take_failures[0]));
    bench.failures.clear();
    bench.table = {};
    bench.readTables();
    QVERIFY(bench.table.nodes.empty());
    QCOMPARE(bench.failures.size(), 1);
    QVERIFY2(bench.failures[0].contains("damaged"), qPrintable(bench.failures[0]));
  }
};

FIELDTRUE_TEST(SessionDamageTest)
#include "session_damage_test.moc"
