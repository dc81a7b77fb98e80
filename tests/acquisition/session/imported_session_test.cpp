#include "acquisition/session/imported_session.h"

#include <QDir>
#include <QFileInfo>
#include <QTemporaryDir>
#include <QTest>
#include <set>

#include "acquisition/session/session_store.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

/// A recording of another program comes back from the session as it went in.
class ImportedSessionTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() { QVERIFY(folder_.isValid()); }

  void aMeanKeepsWhatItLacks() {
    Node bare;
    bare.node = 7;
    bare.has_orientation = false;
    bare.tracker_from_sensor.position_m = {0.1, 0.2, 0.3};
    bare.reference_from_sensor.position_m = {0.4, 0.5, 0.6};
    const CalibrationTable back = through({fullMetadata(), {bare}}, {}).nodeTable().value();
    QCOMPARE(back.nodes.size(), std::size_t{1});
    const Node& node = back.nodes[0];
    QVERIFY(node.node == 7 && node.visit == 0 && !node.has_orientation && !node.covariance_m2 && !node.sd_rot_rad);
    QVERIFY(!node.t_start_s && !node.t_end_s && node.n_used == 1 && node.n_effective == 1.0);
    QCOMPARE(node.tracker_from_sensor.position_m, bare.tracker_from_sensor.position_m);
    QCOMPARE(node.reference_from_sensor.position_m, bare.reference_from_sensor.position_m);
    QCOMPARE(back.metadata.frame, std::string("room"));
    QCOMPARE(back.metadata.other.at("operator"), std::string("Zoë"));
  }

  void aMeanKeepsWhatItHas() {
    Node full = node(3, 2, 1);
    full.role = NodeRole::kValidation;
    full.index = {1, 2, 3};
    full.covariance_m2 = Eigen::Vector3d(1e-6, 4e-6, 9e-6).asDiagonal();
    full.sd_rot_rad = 0.01;
    full.n_used = 58;
    full.n_rejected = 2;
    full.n_effective = 12.5;
    full.t_start_s = 4.0;
    full.t_end_s = 5.0;
    const Node back = through({{}, {full}}, {}).nodeTable()->nodes.at(0);
    QVERIFY(back.node == 3 && back.visit == 2 && back.sensor == 1 && back.role == NodeRole::kValidation);
    QVERIFY(back.index == full.index && back.n_used == 58 && back.n_rejected == 2 && back.n_effective == 12.5);
    QVERIFY(back.t_start_s == 4.0 && back.t_end_s == 5.0 && back.sd_rot_rad == 0.01);
    QVERIFY((*back.covariance_m2 - *full.covariance_m2).norm() < 1e-18);
    QCOMPARE(back.tracker_from_sensor.orientation.coeffs(), full.tracker_from_sensor.orientation.coeffs());
  }

  void skippedStaysSkipped() {
    Node skipped = node(1, 0, 0);
    skipped.role = NodeRole::kSkipped;
    const SessionStore store = through({{}, {node(0, 0, 0), skipped}}, {});
    QCOMPARE(store.nodeTable()->nodes.at(1).role, NodeRole::kSkipped);
    QVERIFY((*store.states())[0] == PlaceState::kDone && (*store.states())[1] == PlaceState::kSkipped);
  }

  void sensorsAtOnePlaceAreOneTake() {
    const CalibrationTable table{{}, {node(5, 0, 0), node(5, 0, 1), node(5, 1, 0), node(5, 1, 1)}};
    const SessionStore store = through(table, {});
    QCOMPARE(store.places().size(), std::size_t{2});
    const CalibrationTable back = store.nodeTable().value();
    QCOMPARE(back.nodes.size(), std::size_t{4});
    for (std::size_t i = 0; i < 4; ++i) {
      QCOMPARE(back.nodes[i].sensor, table.nodes[i].sensor);
      QCOMPARE(back.nodes[i].visit, table.nodes[i].visit);
    }
  }

  void whereTheyDifferInMoreTheyGetVisitsOfTheirOwn() {
    Node elsewhere = node(5, 0, 1);
    elsewhere.reference_from_sensor.position_m.x() += 0.04;
    const CalibrationTable table{{}, {node(5, 0, 0), elsewhere, node(5, 0, 0)}};
    const CalibrationTable back = through(table, {}).nodeTable().value();
    QCOMPARE(back.nodes.size(), std::size_t{3});
    std::set<int> visits;
    for (std::size_t i = 0; i < 3; ++i) {
      QCOMPARE(back.nodes[i].sensor, table.nodes[i].sensor);
      visits.insert(back.nodes[i].visit);
    }
    QCOMPARE(visits.size(), std::size_t{3});
  }

  void samplesGoToTheirTakes() {
    Node mean = node(2, 0, 1);
    SampleTable samples;
    for (const Sample& sample : samplesOf(4)) samples.rows.push_back({2, 0, sample});
    samples.rows.push_back({-1, 0, samplesOf(5).front()});
    const SessionStore store = through({{}, {mean}}, samples);
    QVERIFY(sameSamples(store.samples(0).value(), samplesOf(4)));
    QCOMPARE(store.sampleTable()->rows.size(), samples.rows.size());
    QCOMPARE(store.sampleTable()->rows.back().node, -1);
  }

  void nothingIsLeftOfWhatCannotBe() {
    const QString path = folder_.filePath("far.fieldtrue");
    Node far = node(0, 0, 0);
    far.reference_from_sensor.position_m.x() = 5000.0;
    const auto refused = makeSession(path, {{}, {far}}, {}, "far.csv");
    QVERIFY(!refused);
    FT_VERIFY_MATCH(holdsAll(refused.error().message, {"far.csv", "x_m"}));
    QVERIFY(!QFileInfo::exists(path));
    // Nor of one whose folder is not there.
    QVERIFY(!makeSession(folder_.filePath("absent/a.fieldtrue"), {{}, {node(0, 0, 0)}}, {}, "a.csv"));
    FT_VERIFY_OK(makeSession(folder_.filePath("whole.fieldtrue"), {{}, {node(0, 0, 0)}}, {}, "a.csv"));
    // One file: nothing beside it, neither the one it was written as nor the database's own.
    QCOMPARE(QDir(folder_.path()).entryList({"whole*", "far*", "absent*"}, QDir::AllEntries | QDir::Hidden),
             QStringList({"whole.fieldtrue"}));
  }

  void anotherSessionIsNotReplaced() {
    const QString path = folder_.filePath("twice.fieldtrue");
    FT_VERIFY_OK(makeSession(path, {{}, {node(0, 0, 0)}}, {}, "a.csv"));
    QVERIFY(!makeSession(path, {{}, {node(9, 0, 0)}}, {}, "b.csv"));
    QCOMPARE(SessionStore::open(path)->nodeTable()->nodes.at(0).node, 0);
  }

 private:
  static Node node(int number, int visit, int sensor) {
    Node row;
    row.node = number;
    row.visit = visit;
    row.sensor = sensor;
    row.tracker_from_sensor = {{0.1 * number, 0.2, 0.3}, rotationFromVector({0.1, 0.2, 0.3})};
    row.reference_from_sensor = {{0.1 * number, 0.21, 0.3}, rotationFromVector({0.1, 0.2, 0.31})};
    return row;
  }

  SessionStore through(const CalibrationTable& table, const std::optional<SampleTable>& samples) {
    const QString path = folder_.filePath(QStringLiteral("s%1.fieldtrue").arg(++count_));
    const auto made = makeSession(path, table, samples, "test.csv");
    if (!made) qFatal("%s", made.error().message.c_str());
    return SessionStore::open(path).value();
  }

  QTemporaryDir folder_;
  int count_ = 0;
};

FIELDTRUE_TEST(ImportedSessionTest)
#include "imported_session_test.moc"
