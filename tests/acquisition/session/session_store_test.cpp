#include "acquisition/session/session_store.h"

#include <QDir>
#include <QElapsedTimer>
#include <QProcess>
#include <QTest>
#include <cmath>
#include <cstdio>
#include <random>

#include "acquisition/plan/place_state.h"
#include "tests/acquisition/session/raw_sql.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using testing::fullMetadata;
using testing::kSamples;
using testing::newStore;
using testing::opened;
using testing::sameSamples;
using testing::samplesOf;
using testing::smallPlan;
using testing::storeTake;

namespace {

/// Argument with which this program only tries to open a session and prints what came of it.
constexpr const char* kTryOpen = "--try-open";

}  // namespace

class SessionStoreTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void newSessionIsAllPlanned() {
    const QString path = folder_.newPath();
    SessionStore store = newStore(path);
    QCOMPARE(store.places().size(), std::size_t{12});
    QCOMPARE(store.states().value(), std::vector<PlaceState>(12, PlaceState::kPlanned));
    QVERIFY(store.nodeTable().value().nodes.empty());
    QVERIFY(!store.canUndo().value() && !store.canRedo().value());
    QVERIFY(!store.newestSample_s().value());
  }

  void beginIsKept() {
    const QString path = folder_.newPath();
    const QDateTime begin({2024, 2, 29}, {23, 59, 59, 123}, Qt::UTC);
    {
      const auto store = SessionStore::create(path, {}, {}, begin);
      FT_VERIFY_OK(store);
      QCOMPARE(store->created(), begin);
    }
    const auto store = SessionStore::open(path);
    FT_VERIFY_OK(store);
    QCOMPARE(store->created(), begin);
  }

  void everythingSurvivesClosing() {
    const QString path = folder_.newPath();
    {
      SessionStore store = newStore(path);
      FT_VERIFY_OK(storeTake(store, 0, 10));
      FT_VERIFY_OK(storeTake(store, 1, 11, "moved once"));
      FT_VERIFY_OK(store.skip(2, "a pillar stands there"));
      FT_VERIFY_OK(store.setState("page", "fit"));
      FT_VERIFY_OK(store.setState("page", "compare"));
      FT_VERIFY_OK(store.storeFit("first", "{1}"));
      FT_VERIFY_OK(store.storeFit("second", "{2}"));
      FT_VERIFY_OK(store.addEvent("device", "lost"));
    }
    SessionStore store = opened(path);
    const auto places = fieldtrue::acquisition::places(smallPlan());
    for (std::size_t i = 0; i < places.size(); ++i) {
      QCOMPARE(store.places()[i].node, places[i].node);
      QCOMPARE(store.places()[i].visit, places[i].visit);
      QCOMPARE(store.places()[i].index, places[i].index);
      FT_VERIFY_MATCH(testing::sameBits(store.places()[i].reference_from_sensor, places[i].reference_from_sensor));
    }
    QVERIFY(toJson(store.plan()) == toJson(smallPlan()));
    QCOMPARE(store.states().value()[0], PlaceState::kDone);
    QCOMPARE(store.states().value()[1], PlaceState::kSuspicious);
    QCOMPARE(store.states().value()[2], PlaceState::kSkipped);
    QCOMPARE(store.state("page").value(), std::string("compare"));
    QCOMPARE(store.state("nothing").value(), std::string());
    QVERIFY((store.fits().value() ==
             std::vector<std::pair<std::string, std::string>>{{"second", "{2}"}, {"first", "{1}"}}));
    QVERIFY((store.events().value() == std::vector<std::pair<std::string, std::string>>{{"device", "lost"}}));
    QVERIFY(sameSamples(store.samples(0).value(), samplesOf(10)));
    QVERIFY(sameSamples(store.samples(1).value(), samplesOf(11)));
    QVERIFY(store.samples(2).value().empty());
    QCOMPARE(store.sampleTable().value().rows.size(), std::size_t(2 * kSamples));
    QCOMPARE(*store.newestSample_s().value(), samplesOf(11).back().time_s);
  }

  void metadataIsKept() {
    const QString path = folder_.newPath();
    { SessionStore store = newStore(path); }
    SessionStore store = opened(path);
    const TableMetadata kept = store.metadata(), expected = fullMetadata();
    QCOMPARE(kept.frame, expected.frame);
    QVERIFY(kept.tracker == expected.tracker && kept.rig == expected.rig && kept.date == expected.date);
    QVERIFY(kept.excitation == expected.excitation && kept.carrier_hz == expected.carrier_hz);
    QVERIFY(kept.rate_hz == expected.rate_hz && kept.quantum_m == expected.quantum_m);
    QVERIFY(kept.jig_tolerance_m == expected.jig_tolerance_m && kept.jig_tolerance_rad == expected.jig_tolerance_rad);
    QVERIFY(kept.alignment_known && kept.alignment_tolerance_m == expected.alignment_tolerance_m);
    QVERIFY(kept.alignment_tolerance_rad == expected.alignment_tolerance_rad && kept.other == expected.other);
    TableMetadata changed;
    changed.tracker = "another";
    FT_VERIFY_OK(store.setMetadata(changed));
    QVERIFY(store.nodeTable().value().metadata.tracker == changed.tracker && !store.nodeTable().value().metadata.rig);
  }

  void nodeHoldsWhatTheSamplesSay() {
    SessionStore store = newStore(folder_.newPath());
    FT_VERIFY_OK(storeTake(store, 4, 3));
    const NodeStatistics expected = averageSamples(samplesOf(3)).value();
    const Node node = store.nodes(4).value().at(0);
    QCOMPARE(node.node, store.places()[4].node);
    QCOMPARE(node.index, store.places()[4].index);
    QCOMPARE(node.sensor, 1);
    FT_VERIFY_MATCH(testing::sameBits(node.reference_from_sensor, store.places()[4].reference_from_sensor));
    FT_VERIFY_MATCH(testing::sameBits(node.tracker_from_sensor, expected.mean));
    QVERIFY(*node.covariance_m2 == expected.covariance_m2);
    QCOMPARE(*node.sd_rot_rad, expected.sd_rot_rad);
    QCOMPARE(node.n_effective, expected.n_effective);
    QCOMPARE(std::size_t(node.n_used), expected.n_used);
    QCOMPARE(std::size_t(node.n_rejected), expected.rejections.size());
    QVERIFY(node.n_rejected >= 6);
    QCOMPARE(*node.t_start_s, 3.0);
    QCOMPARE(*node.t_end_s, 3.0 + 59 / 120.0);
    QVERIFY(store.nodes(5).value().empty());
  }

  void retakeSupersedesAndUndoBringsBack() {
    const QString path = folder_.newPath();
    SessionStore store = newStore(path);
    FT_VERIFY_OK(storeTake(store, 0, 1));
    FT_VERIFY_OK(storeTake(store, 0, 2));
    QCOMPARE(store.nodeTable().value().nodes.size(), std::size_t{1});
    QVERIFY(sameSamples(store.samples(0).value(), samplesOf(2)));
    QCOMPARE(store.undo().value(), std::optional<std::size_t>(0));
    QVERIFY(sameSamples(store.samples(0).value(), samplesOf(1)));
    QCOMPARE(store.redo().value(), std::optional<std::size_t>(0));
    QVERIFY(sameSamples(store.samples(0).value(), samplesOf(2)));
  }

  void skippingATakenPlaceMarksItsRow() {
    SessionStore store = newStore(folder_.newPath());
    FT_VERIFY_OK(storeTake(store, 0, 1));
    FT_VERIFY_OK(store.skip(0, "wobbly"));
    FT_VERIFY_OK(store.skip(1, "pillar"));
    const CalibrationTable table = store.nodeTable().value();
    QCOMPARE(table.nodes.size(), std::size_t{1});
    QVERIFY(table.nodes[0].role == NodeRole::kSkipped);
    FT_VERIFY_OK(storeTake(store, 0, 2));
    QVERIFY(store.nodeTable().value().nodes[0].role == NodeRole::kFit);
    QCOMPARE(store.states().value()[0], PlaceState::kDone);
  }

  /// Hundreds of random actions against the plainest model of undo: a list of actions and a position in it.
  void undoAnyNumberOfTimes() {
    SessionStore store = newStore(folder_.newPath());
    struct Action {
      std::size_t place;
      int take;  // -1: skip
    };
    std::vector<Action> actions;
    std::size_t position = 0;
    std::mt19937_64 random(3);
    for (int step = 0; step < 200; ++step) {
      const auto what = random() % 8;
      if (what < 3) {
        const auto expected = position > 0 ? std::optional(actions[--position].place) : std::nullopt;
        QCOMPARE(store.undo().value(), expected);
      } else if (what < 5) {
        const auto expected = position < actions.size() ? std::optional(actions[position++].place) : std::nullopt;
        QCOMPARE(store.redo().value(), expected);
      } else {
        const std::size_t place = random() % 12;
        actions.resize(position);
        actions.push_back({place, what == 7 ? -1 : step});
        ++position;
        FT_VERIFY_OK(what == 7 ? store.skip(place, "x") : storeTake(store, place, step));
      }
      std::vector<PlaceState> expected(12, PlaceState::kPlanned);
      std::vector<int> takes(12, -1);
      for (std::size_t i = 0; i < position; ++i) {
        expected[actions[i].place] = actions[i].take < 0 ? PlaceState::kSkipped : PlaceState::kDone;
        if (actions[i].take >= 0) takes[actions[i].place] = actions[i].take;
      }
      QCOMPARE(store.states().value(), expected);
      QCOMPARE(store.canUndo().value(), position > 0);
      QCOMPARE(store.canRedo().value(), position < actions.size());
      const std::size_t looked_at = random() % 12;
      QVERIFY(sameSamples(store.samples(looked_at).value(),
                          takes[looked_at] < 0 ? std::vector<Sample>{} : samplesOf(takes[looked_at])));
    }
  }

  void oneFileWhenClosed() {
    const QString path = folder_.newPath();
    {
      SessionStore store = newStore(path);
      FT_VERIFY_OK(storeTake(store, 0, 1));
    }
    const QString name = QFileInfo(path).fileName();
    QCOMPARE(QDir(folder_.path()).entryList({name + "*"}, QDir::Files), QStringList{name});
    SessionStore moved = opened(path);
    SessionStore again = std::move(moved);
    QCOMPARE(again.nodeTable().value().nodes.size(), std::size_t{1});
  }

  void secondProgramIsKeptOut() {
    const QString path = folder_.newPath();
    {
      SessionStore store = newStore(path);
      const auto second = SessionStore::open(path);
      QVERIFY(!second && second.error().code == ErrorCode::kIo);
      FT_VERIFY_MATCH(testing::holdsAll(second.error().message, {"open in another program"}));
      // A real second program too: SQLite keeps its own account of the locks within one.
      QProcess other;
      other.start(QCoreApplication::applicationFilePath(), {"session_store_test", kTryOpen, path});
      QVERIFY(other.waitForFinished());
      FT_VERIFY_MATCH(testing::holdsAll(other.readAllStandardOutput().toStdString(), {"open in another program"}));
      FT_VERIFY_OK(storeTake(store, 0, 1));
    }
    QCOMPARE(opened(path).nodeTable().value().nodes.size(), std::size_t{1});
  }

  void wrongFilesAreNamed_data() {
    QTest::addColumn<QByteArray>("content");
    QTest::newRow("empty") << QByteArray();
    QTest::newRow("text") << QByteArray("node,x_m\n").repeated(200);
    QTest::newRow("short") << QByteArray("SQLite format 3");
    QTest::newRow("zeros") << QByteArray(8192, '\0');
  }
  void wrongFilesAreNamed() {
    QFETCH(QByteArray, content);
    const QString path = folder_.newPath();
    QFile file(path);
    QVERIFY(file.open(QIODevice::WriteOnly));
    file.write(content);
    file.close();
    const auto store = SessionStore::open(path);
    QVERIFY(!store);
    QVERIFY2(store.error().code == ErrorCode::kBadInput, store.error().message.c_str());
    FT_VERIFY_MATCH(testing::holdsAll(store.error().message, {"is not a Fieldtrue session"}));
    QFile after(path);
    QVERIFY(after.open(QIODevice::ReadOnly));
    QCOMPARE(after.readAll(), content);
  }

  void damagedFilesAreNamed_data() {
    QTest::addColumn<double>("kept");
    QTest::newRow("half is missing") << 0.5;
    QTest::newRow("the end is missing") << 0.95;
  }
  void damagedFilesAreNamed() {
    QFETCH(double, kept);
    const QString path = folder_.newPath();
    {
      SessionStore store = newStore(path);
      for (std::size_t place = 0; place < 12; ++place) FT_VERIFY_OK(storeTake(store, place, 1));
    }
    QVERIFY(QFile::resize(path, static_cast<qint64>(kept * static_cast<double>(QFileInfo(path).size()))));
    const auto store = SessionStore::open(path);
    QVERIFY(!store);
    QVERIFY2(store.error().code == ErrorCode::kBadInput, store.error().message.c_str());
    FT_VERIFY_MATCH(testing::holdsAll(store.error().message, {"damaged"}));
  }

  void newerVersionIsNamed() {
    const QString path = folder_.newPath();
    { SessionStore store = newStore(path); }
    testing::runSql(path, {"PRAGMA user_version=2"});
    const auto store = SessionStore::open(path);
    QVERIFY(!store && store.error().code == ErrorCode::kNewerVersion);
    FT_VERIFY_MATCH(testing::holdsAll(store.error().message, {"newer version of Fieldtrue", "format 2"}));
  }

  void otherDatabaseIsNamed() {
    const QString path = folder_.newPath();
    testing::runSql(path, {"CREATE TABLE recipes(name TEXT)"});
    const auto store = SessionStore::open(path);
    QVERIFY(!store && store.error().code == ErrorCode::kBadInput);
  }

  void missingAndExistingFiles() {
    const auto missing = SessionStore::open(folder_.newPath());
    QVERIFY(!missing && missing.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(testing::holdsAll(missing.error().message, {"no such session file"}));
    const auto folder = SessionStore::open(folder_.path());
    QVERIFY(!folder && folder.error().code == ErrorCode::kIo);
    const QString path = folder_.newPath();
    { SessionStore store = newStore(path); }
    const auto twice = SessionStore::create(path, smallPlan(), {});
    QVERIFY(!twice && twice.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(testing::holdsAll(twice.error().message, {"exists already"}));
    const auto nowhere = SessionStore::create(folder_.filePath("no/such/a.fieldtrue"), smallPlan(), {});
    QVERIFY(!nowhere && nowhere.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(testing::holdsAll(nowhere.error().message, {"there is no folder"}));
  }

  void largePlanIsQuick() {
    Plan plan;
    plan.counts = {50, 20, 10};
    const QString path = folder_.newPath();
    auto store = SessionStore::create(path, plan, {});
    FT_VERIFY_OK(store);
    QCOMPARE(store->places().size(), std::size_t{10000});
    QElapsedTimer timer;
    timer.start();
    for (std::size_t place = 0; place < 20; ++place) FT_VERIFY_OK(storeTake(*store, place, int(place)));
    const double each_ms = static_cast<double>(timer.elapsed()) / 20.0;
    QVERIFY2(each_ms < 250.0, qPrintable(QString("%1 ms a take").arg(each_ms)));
  }
};

namespace {

int runWithAnOpener(int argc, char** argv) {
  QCoreApplication application(argc, argv);
  if (argc == 3 && std::string(argv[1]) == kTryOpen) {
    const auto store = SessionStore::open(QString::fromLocal8Bit(argv[2]));
    std::puts(store ? "opened" : store.error().message.c_str());
    return 0;
  }
  SessionStoreTest test;
  return fieldtrue::testing::runTest(test, argc, argv);
}

}  // namespace

FIELDTRUE_TEST_PROGRAM(runWithAnOpener)
#include "session_store_test.moc"
