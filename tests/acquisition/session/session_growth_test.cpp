#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <ctime>

#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/raw_sql.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using testing::Bench;
using testing::planOf;

namespace {

constexpr int kTaken = 5000;

/// Time this thread has computed; what other programs do meanwhile does not count.
double computed_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The lower quartile: what else the machine does only adds.
double usual(std::vector<double> values) {
  const std::size_t quarter = values.size() / 4;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(quarter), values.end());
  return values[quarter];
}

}  // namespace

/// What a place costs must not depend on how many were recorded before it.
class SessionGrowthTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;

  /// A session in which places 0 to 4999 are taken, each as the jig stands there.
  void fill(const QString& path) {
    const QStringList statements{
        QString("INSERT INTO actions(id, place, kind, reason, time_utc) SELECT place + 1, place, 'take', '', '2024' "
                "FROM places WHERE place < %1")
            .arg(kTaken),
        "INSERT INTO takes SELECT id, 0, x_true_m, y_true_m, z_true_m, 1,0,0,0, 1e-8,1e-8,1e-8,0,0,0, 1e-3, "
        "0.1,50,1e-5,60,0, id, id + 0.5 FROM actions JOIN places USING(place)",
        "INSERT INTO samples WITH RECURSIVE n(s) AS (SELECT 0 UNION ALL SELECT s + 1 FROM n WHERE s < 59) SELECT id, "
        "s, 0, id + s * 0.008, x_true_m, y_true_m, z_true_m, 1,0,0,0, '', NULL FROM actions JOIN places USING(place), "
        "n"};
    testing::runSql(path, statements);
  }

 private slots:
  void theFiveThousandthPlaceCostsAsTheFirst() {
    const Plan plan = planOf({51, 10, 10});
    const QString path = folder_.filePath("long.fieldtrue");
    { FT_VERIFY_OK(SessionStore::create(path, plan, {})); }
    fill(path);
    Bench early(folder_.filePath("short.fieldtrue"), plan);
    Bench late(path, plan, false);
    late.tracker->reference_from_tracker = {};
    QCOMPARE(late.controller.status().recorded->n_done, std::size_t{kTaken});
    int n_tables = 0, n_places = 0;
    std::size_t n_samples = 0;
    connect(&late.controller, &AcquisitionController::tablesReady, this, [&] { ++n_tables; });
    connect(&late.controller, &AcquisitionController::placeChanged, this,
            [&](int, const std::vector<Node>& nodes, const std::vector<Sample>& samples) {
              n_places += !nodes.empty();
              n_samples += samples.size();
            });
    // The reading that completes a take: what it costs is the storing, and all that follows from it. Taken in turn, so
    // that a busy machine bears on both alike.
    const auto cost_s = [](Bench& bench) {
      bench.tracker->setDownAt(bench.placePose(*bench.controller.status().current));
      bench.controller.take();
      for (int n = 0; n < 59; ++n) bench.tracker->send(bench.tracker->true_pose);
      const double before_s = computed_s();
      bench.tracker->send(bench.tracker->true_pose);
      return computed_s() - before_s;
    };
    std::vector<double> early_s, late_s;
    for (int place = 0; place < 41; ++place) {
      early_s.push_back(cost_s(early));
      late_s.push_back(cost_s(late));
    }
    QCOMPARE(early.stored.size(), std::size_t{41});
    QCOMPARE(late.stored.size(), std::size_t{41});
    const double ratio = usual(late_s) / usual(early_s);
    qInfo("a place after %d costs %.2f ms, one of the first %.2f ms", kTaken, 1e3 * usual(late_s),
          1e3 * usual(early_s));
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    const double most = 4.0;  // Their allocator looks through a heap that grows with the session.
#else
    const double most = 1.5;
#endif
    QVERIFY2(ratio <= most, qPrintable(QString("%1 times the first").arg(ratio)));
    // The window is told of the place, not of the session.
    QCOMPARE(n_tables, 0);
    QCOMPARE(n_places, 41);
    QCOMPARE(n_samples, std::size_t{2460});
  }
};

FIELDTRUE_TEST(SessionGrowthTest)
#include "session_growth_test.moc"
