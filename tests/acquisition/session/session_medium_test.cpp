#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <QDir>
#include <QTemporaryDir>
#include <QTest>
#include <functional>

#include "acquisition/session/session_store.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using testing::Bench;
using testing::fullMetadata;
using testing::sameSamples;
using testing::samplesOf;
using testing::smallPlan;
using testing::storeTake;

namespace {

/// Runs the body in a process of its own that permission bits bind, also where the tests run as root.
/// @return what the body returned; 99 when the process could not give up its rights
int asSomebody(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    if (geteuid() == 0 && (setresgid(kNobody, kNobody, kNobody) != 0 || setresuid(kNobody, kNobody, kNobody) != 0)) {
      _exit(99);
    }
    _exit(body());
  }
  int status = -1;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

QByteArray contentOf(const QString& path) {
  QFile file(path);
  return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray();
}

bool holds(const std::vector<std::string>& remarks, const std::string& part) {
  return remarks.size() == 1 && remarks[0].find(part) != std::string::npos;
}

}  // namespace

/// Sessions that cannot be written to where they are, and copies of sessions that were open.
class SessionMediumTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  int n_folders_ = 0;

  /// A session whose writer was killed: one place in the file, the second only in its `-wal`.
  QString crashedSession() {
    const QDir folder(folder_.path());
    const QString name = QString::number(n_folders_++);
    folder.mkdir(name);
    const QString path = folder.filePath(name + "/jig.fieldtrue");
    {
      auto store = SessionStore::create(path, smallPlan(), fullMetadata());
      if (!store || !storeTake(*store, 0, 1)) qFatal("not made");
    }
    const pid_t child = fork();
    if (child == 0) {
      auto store = SessionStore::open(path);
      if (!store || !storeTake(*store, 1, 2)) _exit(1);
      _exit(0);  // Without destructors, as when the program dies.
    }
    int status = -1;
    waitpid(child, &status, 0);
    if (status != 0 || !QFileInfo::exists(path + "-wal")) qFatal("did not crash as it should");
    chmod(folder_.path().toLocal8Bit().constData(), 0755);
    return path;
  }

 private slots:
  void whatCannotBeWrittenToIsOpenedAsACopy_data() {
    QTest::addColumn<int>("file_mode");
    QTest::addColumn<int>("folder_mode");
    QTest::newRow("file and folder") << 0444 << 0555;
    QTest::newRow("file") << 0444 << 0777;
    QTest::newRow("folder") << 0666 << 0555;
  }
  void whatCannotBeWrittenToIsOpenedAsACopy() {
    QFETCH(int, file_mode);
    QFETCH(int, folder_mode);
    const QString path = crashedSession();
    const QByteArray before = contentOf(path), wal_before = contentOf(path + "-wal");
    QVERIFY(chmod(path.toLocal8Bit().constData(), static_cast<mode_t>(file_mode)) == 0);
    QVERIFY(chmod((path + "-wal").toLocal8Bit().constData(), static_cast<mode_t>(file_mode)) == 0);
    const QByteArray folder = QFileInfo(path).absolutePath().toLocal8Bit();
    QVERIFY(chmod(folder.constData(), static_cast<mode_t>(folder_mode)) == 0);
    const int came = asSomebody([&path] {
      auto store = SessionStore::open(path);
      if (!store) return 1;
      if (!store->isReadOnly() || store->path() != path) return 2;
      if (!holds(store->remarks(), path.toStdString() + ": the file or its folder cannot be written to, so a private "
                                                        "copy was opened and nothing will be stored")) {
        return 3;
      }
      // Both places: the second is in the -wal only.
      const auto first = store->samples(0), second = store->samples(1);
      if (!first || !sameSamples(*first, samplesOf(1))) return 4;
      if (!second || !sameSamples(*second, samplesOf(2))) return 5;
      const auto stored = storeTake(*store, 2, 3);
      if (stored ||
          stored.error().message.find("not stored, for the session is open as a private copy") == std::string::npos) {
        return 6;
      }
      return store->nodeTable().value().nodes.size() == 2 && store->setState("page", "compare") ? 0 : 7;
    });
    QVERIFY(chmod(folder.constData(), 0755) == 0);
    QCOMPARE(came, 0);
    QCOMPARE(contentOf(path), before);
    QCOMPARE(contentOf(path + "-wal"), wal_before);
  }

  void takesIntoACopyAreRefused() {
    const QString path = crashedSession();
    const QByteArray folder = QFileInfo(path).absolutePath().toLocal8Bit();
    QVERIFY(chmod(path.toLocal8Bit().constData(), 0444) == 0);
    QVERIFY(chmod((path + "-wal").toLocal8Bit().constData(), 0444) == 0);
    QVERIFY(chmod(folder.constData(), 0555) == 0);
    const int came = asSomebody([&path] {
      QStringList remarks;
      Bench bench(folderless());
      QObject::connect(&bench.controller, &AcquisitionController::remarked,
                       [&](const QString& text) { remarks << text; });
      bench.controller.openSession(path, {});
      if (remarks.size() != 1 || !remarks[0].contains("private copy")) return 1;
      const AcquisitionStatus status = bench.controller.status();
      if (!status.session->read_only || status.session->path != path || status.recorded->n_done != 2) return 2;
      if (status.reason != "nothing can be stored: the session's file cannot be written to") return 3;
      bench.controller.take();
      if (bench.take_failures.size() != 1 || !bench.take_failures[0].startsWith("Nothing can be stored")) return 4;
      bench.controller.setAutomatic(true);
      bench.takeHere();
      bench.tracker->stand(5.0);
      QFile::remove(folderless());
      return bench.stored.empty() && bench.failures.isEmpty() ? 0 : 5;
    });
    QVERIFY(chmod(folder.constData(), 0755) == 0);
    QCOMPARE(came, 0);
  }

  void aCrashInPlaceIsMadeWholeAndNothingIsSaid() {
    const QString path = crashedSession();
    const auto store = SessionStore::open(path);
    FT_VERIFY_OK(store);
    QVERIFY2(store->remarks().empty(), store->remarks().empty() ? "" : store->remarks()[0].c_str());
    QCOMPARE(store->nodeTable().value().nodes.size(), std::size_t{2});
    // Whole already while it is open: a copy of the file alone has both places.
    const QString copy = folder_.filePath("whole-copy.fieldtrue");
    QVERIFY(QFile::copy(path, copy));
    const auto copied = SessionStore::open(copy);
    FT_VERIFY_OK(copied);
    QCOMPARE(copied->nodeTable().value().nodes.size(), std::size_t{2});
  }

  void aCopyWithoutItsWalSaysSoUntilItIsGoneOnWith() {
    const QString path = crashedSession();
    const QString copy = folder_.filePath("alone.fieldtrue");
    QVERIFY(QFile::copy(path, copy));
    for (int opening = 0; opening < 2; ++opening) {
      auto store = SessionStore::open(copy);
      FT_VERIFY_OK(store);
      QCOMPARE(store->nodeTable().value().nodes.size(), std::size_t{1});
      QVERIFY(holds(store->remarks(), copy.toStdString() +
                                          ": this file was copied while its session was open, or after "
                                          "a crash, without the file alone.fieldtrue-wal"));
      if (opening == 1) FT_VERIFY_OK(storeTake(*store, 1, 7));
    }
    const auto after = SessionStore::open(copy);
    FT_VERIFY_OK(after);
    QVERIFY(after->remarks().empty());
    // With it nothing is missing, and nothing is said.
    const QString both = folder_.filePath("both.fieldtrue");
    QVERIFY(QFile::copy(path, both) && QFile::copy(path + "-wal", both + "-wal"));
    const auto whole = SessionStore::open(both);
    FT_VERIFY_OK(whole);
    QVERIFY(whole->remarks().empty());
    QCOMPARE(whole->nodeTable().value().nodes.size(), std::size_t{2});
  }

  void aClosedSessionSaysNothing() {
    const QString path = folder_.filePath("closed.fieldtrue");
    { FT_VERIFY_OK(SessionStore::create(path, smallPlan(), fullMetadata())); }
    const QString copy = folder_.filePath("closed-copy.fieldtrue");
    QVERIFY(QFile::copy(path, copy));
    const auto store = SessionStore::open(copy);
    FT_VERIFY_OK(store);
    QVERIFY(store->remarks().empty() && !store->isReadOnly());
  }

 private:
  /// A place for a session anybody may make.
  static QString folderless() {
    return QDir::tempPath() + QString("/fieldtrue-medium-%1.fieldtrue").arg(QCoreApplication::applicationPid());
  }
};

FIELDTRUE_TEST(SessionMediumTest)
#include "session_medium_test.moc"
