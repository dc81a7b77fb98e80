#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <fstream>

#include "calib/geometry/geometry.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

namespace {

Result<Import> importWith(const std::string& id, const std::filesystem::path& path,
                          const std::optional<std::filesystem::path>& truth,
                          const std::map<std::string, std::string>& given) {
  const Importer& importer = **findImporter(id);
  const auto settings = resolveSettings(id, importer.settings, given);
  if (!settings) return tl::unexpected(settings.error());
  return importer.read(path, truth, *settings);
}

double rigidRms_mm(const std::vector<Node>& nodes) {
  std::vector<Eigen::Vector3d> from_m;
  std::vector<Eigen::Vector3d> to_m;
  for (const Node& node : nodes) {
    from_m.push_back(node.tracker_from_sensor.position_m);
    to_m.push_back(node.reference_from_sensor.position_m);
  }
  const Pose reference_from_tracker = fitRigid(from_m, to_m).value();
  double sum_m2 = 0.0;
  for (std::size_t i = 0; i < from_m.size(); ++i)
    sum_m2 += (reference_from_tracker * from_m[i] - to_m[i]).squaredNorm();
  return 1e3 * std::sqrt(sum_m2 / static_cast<double>(from_m.size()));
}

constexpr const char* kTwoConditions =
    "condition,node,true_x_mm,true_y_mm,true_z_mm,tracked_x_mm,tracked_y_mm,tracked_z_mm\n"
    "steel_shield,0,0,0,0,1,2,3\n"
    "mine,0,0,0,0,1,2,3\n"
    "steel_shield,7,31.75,0,0,4,5,6\n";

}  // namespace

class AnserTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    path_ = std::filesystem::path(folder_.path().toStdString()) / "nodes.csv";
  }

  void takesOneCondition() {
    std::ofstream(path_) << kTwoConditions;
    const auto import = importWith("anser", path_, {}, {{"condition", "steel_shield"}});
    FT_VERIFY_OK(import);
    QVERIFY(import->table && !import->samples);
    QCOMPARE(import->table->nodes.size(), std::size_t{2});
    const Node& node = import->table->nodes[1];
    QVERIFY(node.node == 7 && !node.has_orientation && !node.covariance_m2);
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m, Eigen::Vector3d(0.03175, 0, 0), 1e-15));
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, Eigen::Vector3d(0.004, 0.005, 0.006), 1e-15));
    QVERIFY(import->table->metadata.frame == "jig" && !import->table->metadata.alignment_known);
  }

  void namesTheConditionsFound() {
    std::ofstream(path_) << kTwoConditions;
    const auto absent = importWith("anser", path_, {}, {});
    QVERIFY(!absent && absent.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(absent.error().message, {"nodes.csv has no condition standard_data_grid",
                                                      "its conditions are steel_shield, mine"}));
    const auto unknown = importWith("anser", path_, {}, {{"condition", "steel"}});
    QVERIFY(!unknown);
    FT_VERIFY_MATCH(holdsAll(unknown.error().message, {"condition must be one of standard_data_grid", "got 'steel'"}));
  }

  void refusesBadRows_data() {
    QTest::addColumn<QByteArray>("row");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("NaN") << QByteArray("steel_shield,8,0,0,0,nan,2,3\n")
                         << QByteArray("line 5, column tracked_x_mm: 'nan'");
    QTest::newRow("repeated") << QByteArray("steel_shield,7,0,0,0,1,2,3\n")
                              << QByteArray("line 5, column node: node 7 comes twice");
    QTest::newRow("short") << QByteArray("steel_shield,8,0,0\n") << QByteArray("line 5: the row has 4 fields");
  }
  void refusesBadRows() {
    QFETCH(QByteArray, row);
    QFETCH(QByteArray, says);
    std::ofstream(path_) << kTwoConditions << row.toStdString();
    const auto import = importWith("anser", path_, {}, {{"condition", "steel_shield"}});
    QVERIFY(!import);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {says}));
  }

  // Figures of data/README.md and of the originals beside the table.
  void realConditions_data() {
    QTest::addColumn<QByteArray>("condition");
    QTest::addColumn<QByteArray>("raw");
    QTest::addColumn<double>("rms_mm");
    QTest::newRow("standard") << QByteArray("standard_data_grid") << QByteArray("standard_data_grid") << 2.26;
    QTest::newRow("interpolate") << QByteArray("interpolate_data_grid") << QByteArray("interpolate_data_grid") << 2.08;
    QTest::newRow("probe_calibrate") << QByteArray("interpolate_data_grid_probe_calibrate")
                                     << QByteArray("interpolate_data_grid_probe_calibrate") << 2.40;
    QTest::newRow("finer_points") << QByteArray("finer_mesh_points") << QByteArray("finer_mesh_points") << 4.53;
    QTest::newRow("finer_3axis") << QByteArray("finer_mesh_3axis") << QByteArray("finer_mesh_3axis") << 2.46;
    QTest::newRow("steel_shield") << QByteArray("steel_shield") << QByteArray("steel_shield") << 5.21;
  }
  void realConditions() {
    FT_REQUIRE_REAL_DATA();
    QFETCH(QByteArray, condition);
    QFETCH(QByteArray, raw);
    QFETCH(double, rms_mm);
    const auto import =
        importWith("anser", *realData("anser_duplo/nodes.csv"), {}, {{"condition", condition.toStdString()}});
    FT_VERIFY_OK(import);
    const std::vector<Node>& nodes = import->table->nodes;
    QCOMPARE(nodes.size(), std::size_t{41});
    // The figure has two decimals: 0.005 of its own rounding within the 0.01 asked for.
    FT_VERIFY_MATCH(near(rigidRms_mm(nodes), rms_mm, 0.01));
    const std::filesystem::path truth = writeTruth(nodes);
    const auto original = importWith("fcsv", *realData("anser_duplo/raw/" + raw.toStdString() + ".fcsv"), truth, {});
    FT_VERIFY_OK(original);
    QCOMPARE(original->table->nodes.size(), std::size_t{41});
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Node& node = original->table->nodes[i];
      FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, nodes[i].tracker_from_sensor.position_m, 1e-12));
      FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m, nodes[i].reference_from_sensor.position_m, 1e-12));
      QVERIFY(!node.has_orientation);
    }
  }

 private:
  std::filesystem::path writeTruth(const std::vector<Node>& nodes) const {
    const std::filesystem::path path = path_.parent_path() / "truth.csv";
    std::ofstream out(path);
    out.precision(12);
    out << "true_x_mm,true_y_mm,true_z_mm\n";
    for (const Node& node : nodes) {
      const Eigen::Vector3d p_mm = 1e3 * node.reference_from_sensor.position_m;
      out << p_mm.x() << ',' << p_mm.y() << ',' << p_mm.z() << '\n';
    }
    return path;
  }
  QTemporaryDir folder_;
  std::filesystem::path path_;
};

FIELDTRUE_TEST(AnserTest)
#include "anser_test.moc"
