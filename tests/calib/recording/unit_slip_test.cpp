#include "calib/recording/unit_slip.h"

#include <QElapsedTimer>
#include <QTest>
#include <filesystem>
#include <map>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "calib/tables/table_io.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

CalibrationTable gridTable(std::array<int, 3> counts = {4, 4, 3}) {
  SyntheticOptions options;
  options.counts = counts;
  options.smooth_distortion_m = 0.02;
  options.reference_from_tracker = {Eigen::Vector3d(0.7, -1.2, 0.4), rotationFromVector(Eigen::Vector3d(0.4, 0.2, -2))};
  SyntheticNoise noise;
  noise.position_sd_m = 0.001;
  return syntheticTable(options, noise);
}

CalibrationTable scaled(CalibrationTable table, double true_factor, double tracked_factor) {
  for (Node& node : table.nodes) {
    node.reference_from_sensor.position_m *= true_factor;
    node.tracker_from_sensor.position_m *= tracked_factor;
  }
  return table;
}

void mirrorSome(CalibrationTable& table) {
  for (std::size_t i = 0; i < table.nodes.size(); i += 3) table.nodes[i].tracker_from_sensor.position_m *= -1.0;
}

/// Every real recording that has true positions.
std::vector<std::pair<std::string, CalibrationTable>> realTables() {
  std::vector<std::pair<std::string, CalibrationTable>> tables;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(*realData("lighthouse"))) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".nodes.csv")) tables.emplace_back(name, readNodeTable(entry.path()).value().table);
  }
  const auto import = [&](const std::string& id, const std::string& path,
                          const std::map<std::string, std::string>& settings) {
    const importers::Importer& importer = *importers::findImporter(id).value();
    const Settings resolved = resolveSettings(id, importer.settings, settings).value();
    tables.emplace_back(path, importer.read(*realData(path), std::nullopt, resolved).value().table.value());
  };
  for (const std::string& condition : importers::findImporter("anser").value()->settings.front().choices)
    import("anser", "anser_duplo/nodes.csv", {{ "condition", condition }});
  import("plus", "pluslib_fcal/samples.csv", {});
  return tables;
}

}  // namespace

/// Positions in another unit than metres are noticed by their distances alone.
class UnitSlipTest : public QObject {
  Q_OBJECT
 private slots:
  void slipsAreNamed_data() {
    QTest::addColumn<double>("factor");
    QTest::addColumn<QByteArray>("named");
    for (const UnitSlip& slip : kUnitSlips) {
      const QByteArray named = QByteArray::number(slip.factor) + ", " + slip.words;
      QTest::addRow("true positions by %g", slip.factor) << slip.factor << named;
      QTest::addRow("readings by %g", slip.factor) << 1.0 / slip.factor << named;
    }
  }
  void slipsAreNamed() {
    QFETCH(double, factor);
    QFETCH(QByteArray, named);
    CalibrationTable table = gridTable();
    FT_VERIFY_OK(checkUnits(table));
    const auto check = [&](const char* which) {
      const auto true_off = checkUnits(scaled(table, factor, 1.0));
      QVERIFY2(!true_off, which);
      QCOMPARE(true_off.error().code, ErrorCode::kBadInput);
      FT_VERIFY_MATCH(
          holdsAll(true_off.error().message, {factor > 1.0 ? "the true positions lie" : "the readings lie", named}));
      const auto tracked_off = checkUnits(scaled(table, 1.0, 1.0 / factor));
      QVERIFY2(!tracked_off, which);
      FT_VERIFY_MATCH(holdsAll(tracked_off.error().message, {named}));
    };
    check("plain");
    mirrorSome(table);
    FT_VERIFY_OK(checkUnits(table));
    check("every third reading in the other hemisphere");
  }

  /// Of several sensors the one that stood still, or was read in another unit, is named; the others are of one scale.
  void theSensorAtFaultIsNamed() {
    CalibrationTable table = gridTable();
    const std::vector<Node> first = table.nodes;
    for (Node node : first) {
      node.sensor = 1;
      table.nodes.push_back(node);
    }
    FT_VERIFY_OK(checkUnits(table));
    CalibrationTable still = table, slipped = table;
    for (Node& node : still.nodes)
      if (node.sensor == 1) node.tracker_from_sensor.position_m = {0.2, 0.1, 0.3};
    for (Node& node : slipped.nodes)
      if (node.sensor == 0) node.tracker_from_sensor.position_m *= 39.37;
    const auto stood = checkUnits(still), other_unit = checkUnits(slipped);
    QVERIFY(!stood && !other_unit);
    FT_VERIFY_MATCH(holdsAll(stood.error().message,
                             {"sensor 1: most places share one reading", "moved with the jig", "role skipped"}));
    QVERIFY2(stood.error().message.find("metres") == std::string::npos, stood.error().message.c_str());
    FT_VERIFY_MATCH(holdsAll(other_unit.error().message, {"sensor 0: the readings lie", "both must be in metres"}));
  }

  void theBoundsAreAFactorOfTwo() {
    // Undistorted, so that every distance has the factor exactly.
    const CalibrationTable exact = syntheticTable();
    FT_VERIFY_OK(checkUnits(scaled(exact, 1.98, 1.0)));
    FT_VERIFY_OK(checkUnits(scaled(exact, 1.0, 1.98)));
    QVERIFY(!checkUnits(scaled(exact, 2.02, 1.0)));
    QVERIFY(!checkUnits(scaled(exact, 1.0, 2.02)));
  }

  void theExtentCountsWhereBothAreWrong() {
    SyntheticOptions around_transmitter;  // So that readings stay within reach: 0.8 m wide, 0.4 m to either side.
    around_transmitter.origin_m = {-0.4, -0.4, -0.3};
    const CalibrationTable table = syntheticTable(around_transmitter);
    const auto wide = checkUnits(scaled(table, 1000.0, 1000.0));
    QVERIFY(!wide);
    FT_VERIFY_MATCH(holdsAll(wide.error().message, {"100 places", "800 m", "30 m"}));
    FT_VERIFY_OK(checkUnits(scaled(table, 37.0, 37.0)));
    QVERIFY(!checkUnits(scaled(table, 38.0, 38.0)));
    const auto narrow = checkUnits(scaled(table, 0.001, 0.001));
    QVERIFY(!narrow);
    FT_VERIFY_MATCH(holdsAll(narrow.error().message, {"100 places", "within 0.8 mm"}));
    FT_VERIFY_OK(checkUnits(scaled(table, 0.0013, 0.0013)));
  }

  void fewPlacesAreJudgedByExtentOnly() {
    CalibrationTable three = syntheticTable();
    three.nodes.resize(3);
    FT_VERIFY_OK(checkUnits(scaled(three, 25.4, 1.0)));
    QVERIFY(!checkUnits(scaled(three, 1000.0, 1.0)));
    CalibrationTable one = three;
    one.nodes.resize(1);
    FT_VERIFY_OK(checkUnits(one));
    FT_VERIFY_OK(checkUnits(CalibrationTable{}));
    // Many visits of one place are one place.
    one.nodes.assign(50, one.nodes.front());
    FT_VERIFY_OK(checkUnits(one));
  }

  void mirroredAxesAndBadLayersAreNoSlip() {
    CalibrationTable table = gridTable();
    for (Node& node : table.nodes) node.tracker_from_sensor.position_m.y() *= -1.0;
    FT_VERIFY_OK(checkUnits(table));
    // One layer of five noted in millimetres.
    table = gridTable({4, 4, 5});
    for (Node& node : table.nodes)
      if ((*node.index)[2] == 0) node.reference_from_sensor.position_m.z() *= 10.0;
    FT_VERIFY_OK(checkUnits(table));
    table = gridTable();
    for (Node& node : table.nodes) node.tracker_from_sensor.position_m *= -1.0;
    FT_VERIFY_OK(checkUnits(table));
    table = scaled(gridTable(), 1000.0, 1.0);
    for (Node& node : table.nodes) node.tracker_from_sensor.position_m.y() *= -1.0;
    QVERIFY(!checkUnits(table));
  }

  void readingsThatStandStillAreNoUnit() {
    CalibrationTable table = gridTable();
    for (Node& node : table.nodes) node.tracker_from_sensor.position_m = Eigen::Vector3d(0.3, 0.2, 0.1);
    const auto still = checkUnits(table);
    QVERIFY(!still);
    FT_VERIFY_MATCH(holdsAll(still.error().message, {"share one reading"}));
  }

  void skippedRowsDoNotCount() {
    CalibrationTable table = gridTable();
    table.nodes.front().role = NodeRole::kSkipped;
    table.nodes.front().reference_from_sensor.position_m.x() = 500.0;
    FT_VERIFY_OK(checkUnits(table));
  }

  void aReadingThatNoTrackerReachesIsNamed() {
    CalibrationTable table = gridTable();
    Node& far = table.nodes[5];
    far.sensor = 2;
    far.tracker_from_sensor.position_m.y() = -30.0;
    FT_VERIFY_OK(checkUnits(table));
    far.tracker_from_sensor.position_m.y() = -1e6;
    const auto checked = checkUnits(table);
    QVERIFY(!checked);
    QCOMPARE(checked.error().code, ErrorCode::kBadInput);
    QCOMPARE(checked.error().message,
             std::string("node 5, sensor 2, visit 0, column y_m: the reading lies at -1e+06 m, farther than the 30 m "
                         "that any tracker reaches; readings must be in metres"));
    std::vector<int> lines;
    for (std::size_t i = 0; i < table.nodes.size(); ++i) lines.push_back(static_cast<int>(10 + i));
    QVERIFY(checkUnits(table, lines).error().message.starts_with("line 15, column y_m: "));
    CalibrationTable two{table.metadata, {table.nodes[4], far}};
    QVERIFY(!checkUnits(two));
    CalibrationTable one{table.metadata, {far}};
    QVERIFY(!checkUnits(one));
    // What is flagged is no reading.
    far.role = NodeRole::kSkipped;
    FT_VERIFY_OK(checkUnits(table));
  }

  void thousandsOfPlacesTakeNoTime() {
    const CalibrationTable table = gridTable({20, 20, 20});
    QElapsedTimer timer;
    timer.start();
    FT_VERIFY_OK(checkUnits(table));
    const qint64 plain_ms = timer.restart();
    const auto slip = checkUnits(scaled(table, 1000.0, 1.0));
    QVERIFY(!slip);
    const qint64 slip_ms = timer.elapsed();
    qInfo("%lld ms, with a slip %lld ms", static_cast<long long>(plain_ms), static_cast<long long>(slip_ms));
    QVERIFY(plain_ms < 5000);
    QVERIFY(slip_ms < 30000);
    QCOMPARE(checkUnits(scaled(table, 1000.0, 1.0)).error().message, slip.error().message);
  }

  void realTablesPass() {
    FT_REQUIRE_REAL_DATA();
    const auto tables = realTables();
    QVERIFY2(tables.size() >= 15, qPrintable(QString::number(tables.size())));
    for (const auto& [name, table] : tables) {
      const auto checked = checkUnits(table);
      QVERIFY2(checked, (name + ": " + (checked ? "" : checked.error().message)).c_str());
      const auto slipped = checkUnits(scaled(table, 1000.0, 1.0));
      QVERIFY2(!slipped, name.c_str());
      FT_VERIFY_MATCH(holdsAll(slipped.error().message, {"1000, millimetres for metres"}));
    }
  }

  void readingsAreHeldAgainstTheRegion_data() {
    QTest::addColumn<double>("factor");
    QTest::addColumn<QByteArray>("named");
    QTest::newRow("metres") << 1.0 << QByteArray();
    for (const UnitSlip& slip : kUnitSlips) {
      if (slip.factor < 5.0) continue;  // Three times farther is within what is asked.
      const QByteArray number = QByteArray::number(slip.factor) + " (" + slip.words + ")";
      QTest::addRow("times %g", slip.factor) << slip.factor << "divided by " + number;
      QTest::addRow("by %g", slip.factor) << 1.0 / slip.factor << "multiplied by " + number;
    }
  }
  void readingsAreHeldAgainstTheRegion() {
    QFETCH(double, factor);
    QFETCH(QByteArray, named);
    // Far from the transmitter, so that no shrunken reading comes near it.
    SyntheticOptions options;
    options.origin_m = {1.5, 0.5, 0.5};
    const CalibrationTable table = syntheticTable(options);
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, {}, calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    std::vector<Eigen::Vector3d> tracked_m;
    for (const Node& node : table.nodes) tracked_m.push_back(node.tracker_from_sensor.position_m);
    ReadingUnits units(corrector->region(), tracked_m);
    FT_VERIFY_OK(units.check());
    for (const Eigen::Vector3d& p_m : tracked_m) units.add(factor * p_m);
    // A few that fit nowhere change nothing.
    for (int i = 0; i < 40; ++i) units.add(Eigen::Vector3d(1e7, 0, 0));
    const auto checked = units.check();
    if (named.isEmpty()) {
      FT_VERIFY_OK(checked);
      return;
    }
    QVERIFY(!checked);
    FT_VERIFY_MATCH(holdsAll(checked.error().message, {"no reading of 140", named, "100 would"}));
    // One reading near the region, and nothing is said.
    units.add(tracked_m.front() + Eigen::Vector3d(0.1, 0.0, 0.0));
    FT_VERIFY_OK(units.check());
  }

  void feetHardlyLeaveTheEnlargedRegion() {
    SyntheticOptions options;
    options.origin_m = {0.6, 0.4, 0.4};
    const CalibrationTable table = syntheticTable(options);
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, {}, calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    std::vector<Eigen::Vector3d> tracked_m;
    for (const Node& node : table.nodes) tracked_m.push_back(node.tracker_from_sensor.position_m);
    const auto said = [&](double factor, std::size_t n_readings) {
      ReadingUnits units(corrector->region(), tracked_m);
      for (std::size_t i = 0; i < n_readings; ++i) units.add(factor * tracked_m[i]);
      const auto checked = units.check();
      return checked ? std::string() : checked.error().message;
    };
    FT_VERIFY_MATCH(holdsAll(said(3.28, 100), {"no reading of 100", "divided by 3.28 (feet for metres)", "would"}));
    // Fewer than ten may lie beside the region by chance, and a person may walk three times as far.
    QCOMPARE(said(3.28, 9), std::string());
    QCOMPARE(said(1.0, 100), std::string());
    ReadingUnits walk(corrector->region(), tracked_m);
    for (const Eigen::Vector3d& p_m : tracked_m) walk.add(p_m + Eigen::Vector3d(0.0, 1.2, 0.0));
    FT_VERIFY_OK(walk.check());
  }

  void readingsElsewhereAreNoSlip() {
    SyntheticOptions options;
    options.origin_m = {1.5, 0.5, 0.5};
    const CalibrationTable table = syntheticTable(options);
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, {}, calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    std::vector<Eigen::Vector3d> tracked_m;
    for (const Node& node : table.nodes) tracked_m.push_back(node.tracker_from_sensor.position_m);
    ReadingUnits units(corrector->region(), tracked_m);
    // Another corner of the room, some metres off: no slip brings it back.
    for (const Eigen::Vector3d& p_m : tracked_m) units.add(Eigen::Vector3d(-3.0, 4.0, -2.0) + 0.1 * p_m);
    FT_VERIFY_OK(units.check());
  }
};

FIELDTRUE_TEST(UnitSlipTest)
#include "unit_slip_test.moc"
