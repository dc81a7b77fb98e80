#include "acquisition/session/recorded_table.h"

#include <QTemporaryDir>
#include <QTest>

#include "acquisition/session/imported_session.h"
#include "acquisition/session/session_store.h"
#include "calib/tables/table_writer.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

class RecordedTableTest : public QObject {
  Q_OBJECT
 private slots:
  /// A session and a table of the same recording hold the same places.
  void bothKindsAreRead() {
    Node node;
    node.node = 7;
    node.tracker_from_sensor.position_m = {0.1, 0.2, 0.3};
    node.reference_from_sensor.position_m = {0.4, 0.5, 0.6};
    const CalibrationTable table{fullMetadata(), {node}};
    const QString session = folder_.filePath("a.fieldtrue");
    const QString file = folder_.filePath("a.nodes.csv");
    FT_VERIFY_OK(makeSession(session, table, {}, "a.csv"));
    FT_VERIFY_OK(writeNodeTable(file.toStdString(), table));
    for (const QString& path : {session, file}) {
      const auto read = recordedTable(path);
      FT_VERIFY_OK(read);
      QCOMPARE(read->nodes.size(), std::size_t{1});
      QCOMPARE(read->nodes[0].node, 7);
      QCOMPARE(read->nodes[0].tracker_from_sensor.position_m, node.tracker_from_sensor.position_m);
    }
  }

  void whatHoldsNothingIsSaid() {
    const QString empty = folder_.filePath("empty.fieldtrue");
    FT_VERIFY_OK(SessionStore::create(empty, smallPlan(), fullMetadata()));
    const auto read = recordedTable(empty);
    QVERIFY(!read);
    QCOMPARE(read.error().code, ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(read.error().message, {"empty.fieldtrue", "no recorded place"}));
    QVERIFY(!recordedTable(folder_.filePath("absent.fieldtrue")));
    QVERIFY(!recordedTable(folder_.filePath("absent.csv")));
  }

 private:
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(RecordedTableTest)
#include "recorded_table_test.moc"
