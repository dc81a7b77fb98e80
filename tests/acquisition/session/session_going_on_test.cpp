#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A session that is opened again, or whose tracker is lost and comes back: one table, and one clock.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;
using testing::planOf;

class SessionGoingOnTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void reopeningResumes() {
    const QString path = folder_.newPath();
    std::vector<Node> before;
    {
      Bench bench(path);
      for (int i = 0; i < 4; ++i) bench.takeHere();
      bench.controller.skip();
      bench.controller.setSessionState("page", "compare");
      bench.controller.storeFit("hmq", "{}");
      bench.readTables();
      before = bench.table.nodes;
    }
    Bench bench(path, {}, false);
    QVERIFY2(bench.failures.isEmpty(), qPrintable(bench.failures.join(' ')));
    QCOMPARE(bench.opened_page, QString("compare"));
    QVERIFY(nlohmann::json::parse(bench.opened_plan.toStdString()) == toJson(planOf({3, 3, 2})));
    const auto status = bench.controller.status();
    QVERIFY(status.current == 5u && status.recorded->n_done == 4 && status.recorded->n_skipped == 1 &&
            status.recorded->can_undo);
    QCOMPARE(status.session->path, path);
    bench.takeHere();
    bench.readTables();
    QCOMPARE(bench.table.nodes.size(), std::size_t{5});
    for (std::size_t i = 0; i < before.size(); ++i) {
      FT_VERIFY_MATCH(testing::sameBits(bench.table.nodes[i].tracker_from_sensor, before[i].tracker_from_sensor));
    }
    QVERIFY(*bench.table.nodes[4].t_start_s > *bench.table.nodes[3].t_end_s);
  }

  void clockGoesOnWhileTheSessionIsClosed_data() {
    QTest::addColumn<double>("after_s");
    QTest::addColumn<double>("resumed_s");
    QTest::newRow("two hours later") << 7200.0 << 7200.0;
    QTest::newRow("a clock set back") << -60.0 << 2.0;
  }
  void clockGoesOnWhileTheSessionIsClosed() {
    QFETCH(double, after_s);
    QFETCH(double, resumed_s);
    const QString path = folder_.newPath();
    {
      Bench bench(path);
      bench.takeHere();
    }
    Bench bench(path, {}, false, after_s);
    bench.takeHere();
    bench.readTables();
    QCOMPARE(bench.table.nodes.size(), std::size_t{2});
    const double begins_s = *bench.table.nodes[1].t_start_s;
    QVERIFY2(begins_s >= resumed_s && begins_s < resumed_s + 3.0, qPrintable(QString::number(begins_s)));
  }

  void theClockCountsFromTheFirstReading_data() {
    QTest::addColumn<bool>("reopens");
    QTest::addColumn<bool>("is_kept");
    QTest::addColumn<double>("resumed_s");
    QTest::newRow("reconnected") << false << true << 60.0;
    QTest::newRow("reopened") << true << true << 60.0;
    QTest::newRow("reopened, without what is kept now") << true << false << 660.0;
  }
  /// The session was made ten minutes before its first reading; it goes on a minute after that.
  void theClockCountsFromTheFirstReading() {
    QFETCH(bool, reopens);
    QFETCH(bool, is_kept);
    QFETCH(double, resumed_s);
    const QString path = folder_.newPath();
    std::vector<Node> nodes;
    {
      Bench bench(path);
      bench.now = bench.now.addSecs(600);
      bench.takeHere();
      if (!is_kept) bench.controller.setSessionState("clock_began", {});
      if (!reopens) {
        bench.now = bench.now.addSecs(60);
        bench.tracker->lose();
        bench.tracker->comeBack();
        bench.takeHere();
      }
      QVERIFY(bench.failures.isEmpty());
      nodes = bench.nodes;
    }
    if (reopens) {
      Bench bench(path, {}, false, 660.0);
      bench.takeHere();
      nodes.insert(nodes.end(), bench.nodes.begin(), bench.nodes.end());
    }
    QCOMPARE(nodes.size(), std::size_t{2});
    // A take begins 1.4 s after its tracker: carried for 0.8 s, at rest for 0.6 s.
    QVERIFY2(std::abs(*nodes[0].t_start_s - 1.4) < 0.1, qPrintable(QString::number(*nodes[0].t_start_s)));
    const double after_s = *nodes[1].t_start_s - resumed_s;
    QVERIFY2(std::abs(after_s - 1.4) < 0.1, qPrintable(QString::number(*nodes[1].t_start_s)));
  }
};

FIELDTRUE_TEST(SessionGoingOnTest)
#include "session_going_on_test.moc"
