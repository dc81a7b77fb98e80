#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QThread>
#include <QThreadPool>
#include <semaphore>

#include "acquisition/session/session_store.h"
#include "tests/acquisition/session/raw_sql.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"
#include "tests/widgets/session_fixture.h"
#include "widgets/workbench/workbench.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using namespace fieldtrue::widgets;

namespace {

constexpr std::size_t kPlaces = 18;

/// The one thread of the pool is taken until it is let go: what is begun meanwhile waits.
class BusyPool {
 public:
  BusyPool() {
    QThreadPool::globalInstance()->setMaxThreadCount(1);
    QThreadPool::globalInstance()->start([this] { let_go_.acquire(); });
  }
  ~BusyPool() {
    finish();
    QThreadPool::globalInstance()->setMaxThreadCount(QThread::idealThreadCount());
  }
  /// Returns when everything that waited is done, and nobody has been told of it.
  void finish() {
    if (!std::exchange(is_let_go_, true)) let_go_.release();
    QThreadPool::globalInstance()->waitForDone();
  }

 private:
  std::binary_semaphore let_go_{0};
  bool is_let_go_ = false;
};

}  // namespace

/// A calibration is of the session whose rows it was fitted on, and it is known whether that one keeps it.
class SessionChangeTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;

  /// A session with every place of a bent room taken.
  QString makeSession(const QString& name) {
    const QString path = folder_.filePath(name);
    makeTakenSession(path, {3, 3, 2});
    return path;
  }

  static void open(Workbench& workbench, const QString& path) {
    workbench.openSession(path);
    QTRY_COMPARE(workbench.sessionPath(), path);
    QTRY_COMPARE(workbench.table().nodes.size(), kPlaces);
  }
  static void fitAffine(Workbench& workbench) {
    workbench.fit(*calibration::parseCorrectorChoice("affine", "none"), calibration::AlignMode::kRigid);
  }
  static std::size_t fitsIn(const QString& path) {
    const auto store = acquisition::SessionStore::open(path);
    return store ? store->fits().value().size() : 99;
  }

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    keepIn(folder_);
  }
  void cleanup() { QThreadPool::globalInstance()->waitForDone(); }

  void aFitThatRunsEndsWithItsSession() {
    const QString a = makeSession("runs_a.fieldtrue"), b = makeSession("runs_b.fieldtrue");
    {
      Workbench workbench;
      open(workbench, a);
      BusyPool pool;
      fitAffine(workbench);
      QVERIFY(workbench.isFitting());
      QSignalSpy fitting(&workbench, &Workbench::fittingChanged);
      open(workbench, b);
      QVERIFY(!workbench.isFitting());
      QCOMPARE(fitting.size(), qsizetype{1});
      pool.finish();
      QTest::qWait(100);
      QVERIFY(!workbench.corrector());
    }
    QCOMPARE(fitsIn(b), std::size_t{0});
  }

  /// The other session is open already, and the window is told only after the fit is.
  void aFitThatEndsOnTheWayIsNotOfTheNextSession() {
    const QString a = makeSession("way_a.fieldtrue"), b = makeSession("way_b.fieldtrue");
    {
      Workbench workbench;
      open(workbench, a);
      BusyPool pool;
      fitAffine(workbench);
      pool.finish();
      workbench.openSession(b);
      QThread::msleep(200);
      QTRY_COMPARE(workbench.sessionPath(), b);
      QTest::qWait(100);
      QVERIFY(!workbench.corrector());
    }
    QCOMPARE(fitsIn(b), std::size_t{0});
  }

  void aCalibrationIsKeptOnceItIsStored() {
    const QString path = makeSession("kept.fieldtrue");
    {
      Workbench workbench;
      open(workbench, path);
      fitAffine(workbench);
      QTRY_VERIFY(workbench.corrector().has_value());
      QTRY_COMPARE(workbench.correctorIsKept(), std::optional(true));
    }
    QCOMPARE(fitsIn(path), std::size_t{1});
    Workbench again;
    open(again, path);
    QTRY_COMPARE(again.correctorIsKept(), std::optional(true));
  }

  void aCalibrationThatCannotBeStoredIsNotKept() {
    const QString path = makeSession("refused.fieldtrue");
    runSql(path, {"CREATE TRIGGER refuse BEFORE INSERT ON fits BEGIN SELECT RAISE(ABORT, 'refused'); END"});
    Workbench workbench;
    open(workbench, path);
    fitAffine(workbench);
    QTRY_VERIFY(workbench.corrector().has_value());
    QTRY_COMPARE(workbench.correctorIsKept(), std::optional(false));
  }
};

FIELDTRUE_TEST(SessionChangeTest)
#include "session_change_test.moc"
