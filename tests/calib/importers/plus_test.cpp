#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <map>

#include "calib/importers/rows.h"
#include "calib/tables/csv_reader.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

namespace {

Result<Import> importPlus(const std::filesystem::path& path, const std::map<std::string, std::string>& given) {
  const Importer importer = plusImporter();
  const auto settings = resolveSettings(importer.id, importer.settings, given);
  if (!settings) return tl::unexpected(settings.error());
  return importer.read(path, std::nullopt, *settings);
}

/// What the recording's own nodes.csv says of a landmark.
struct Landmark {
  int samples = 0;
  Eigen::Vector3d true_mm, mean_mm, sd_mm;
};

std::map<int, Landmark> landmarks() {
  std::ifstream in(*realData("pluslib_fcal/nodes.csv"));
  auto reader = CsvReader::open(in, "nodes.csv").value();
  std::map<int, Landmark> rows;
  while (reader.next().value()) {
    const auto vector = [&](const std::string& stem) {
      return Eigen::Vector3d(reader.number(*reader.find(stem + "_x_mm")), reader.number(*reader.find(stem + "_y_mm")),
                             reader.number(*reader.find(stem + "_z_mm")));
    };
    rows[reader.integer(*reader.find("landmark"))] = {reader.integer(*reader.find("n")), vector("true"),
                                                      vector("tip_mean"), vector("tip_sd")};
  }
  return rows;
}

constexpr const char* kHead =
    "frame,t_s,landmark,true_x_mm,true_y_mm,true_z_mm,tip_x_mm,tip_y_mm,tip_z_mm,"
    "stylus_x_mm,stylus_y_mm,stylus_z_mm,stylus_qw,stylus_qx,stylus_qy,stylus_qz\n";

}  // namespace

class PlusTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() { QVERIFY(folder_.isValid()); }

  void averagesLandmarks() {
    const auto import = importText(
        "0,0.0,0,nan,nan,nan,9,9,9,1,1,1,1,0,0,0\n"
        "1,0.1,2,5,6,7,1,2,3,10,20,30,0,1,0,0\n"
        "2,0.2,2,5,6,7,3,4,5,10,20,30,0,1,0,0\n",
        {{"reject", "false"}});
    FT_VERIFY_OK(import);
    QVERIFY(import->table && import->samples);
    QCOMPARE(import->samples->rows.size(), std::size_t{3});
    QCOMPARE(import->samples->rows[0].node, -1);
    QCOMPARE(import->samples->rows[1].node, 2);
    FT_VERIFY_MATCH(near(*import->samples->metadata.rate_hz, 10.0, 1e-9));
    QCOMPARE(import->table->nodes.size(), std::size_t{1});
    const Node& node = import->table->nodes[0];
    QVERIFY(node.node == 2 && node.n_used == 2 && !node.has_orientation && !node.sd_rot_rad);
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m, Eigen::Vector3d(0.005, 0.006, 0.007), 1e-15));
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, Eigen::Vector3d(0.002, 0.003, 0.004), 1e-15));
    QVERIFY(*node.t_start_s == 0.1 && *node.t_end_s == 0.2);
  }

  void otherBodiesHaveNoTruth() {
    const auto import = importText("1,0.1,2,5,6,7,1,2,3,10,20,30,0,1,0,0\n", {{"body", "stylus"}});
    FT_VERIFY_OK(import);
    QVERIFY(!import->table && import->samples);
    FT_VERIFY_MATCH(near(import->samples->rows[0].sample.tracker_from_sensor,
                         Pose{{0.01, 0.02, 0.03}, Eigen::Quaterniond(0, 1, 0, 0)}, 1e-15, 1e-15));
    FT_VERIFY_MATCH(holdsAll(import->notes.back(), {"no true positions of the stylus: samples only"}));
  }

  void missingMarksAreNotAveraged() {
    const auto import = importText(
        "1,0.1,2,5,6,7,1,2,3,1,1,1,1,0,0,0\n"
        "2,0.2,2,5,6,7,-3.7e28,-3.7e28,-3.7e28,1,1,1,1,0,0,0\n",
        {});
    FT_VERIFY_OK(import);
    QCOMPARE(import->samples->rows[1].sample.status, std::string("missing"));
    QVERIFY(import->table->nodes[0].n_used == 1 && import->table->nodes[0].n_rejected == 1);
    FT_VERIFY_MATCH(near(import->table->nodes[0].tracker_from_sensor.position_m.x(), 0.001, 1e-15));
    FT_VERIFY_MATCH(
        holdsAll(import->notes.back(), {"Landmark 2: 1 of 2 samples used", "rejected: sample 2 status missing"}));
  }

  void refuses_data() {
    QTest::addColumn<QByteArray>("rows");
    QTest::addColumn<QByteArray>("body");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("no truth at a landmark") << QByteArray("1,0.1,2,nan,6,7,1,2,3,1,1,1,1,0,0,0\n") << QByteArray("tip")
                                            << QByteArray("line 2, column true_x_mm: 'nan'");
    QTest::newRow("two truths") << QByteArray("1,0,2,5,6,7,1,2,3,1,1,1,1,0,0,0\n2,0,2,5,6,8,1,2,3,1,1,1,1,0,0,0\n")
                                << QByteArray("tip")
                                << QByteArray("line 3, column true_x_mm: landmark 2 had another true position");
    QTest::newRow("zero quaternion") << QByteArray("1,0.1,2,5,6,7,1,2,3,1,1,1,0,0,0,0\n") << QByteArray("stylus")
                                     << QByteArray("line 2, column stylus_qw: the quaternion is zero");
    QTest::newRow("body not there") << QByteArray("1,0.1,2,5,6,7,1,2,3,1,1,1,1,0,0,0\n") << QByteArray("reference")
                                    << QByteArray("line 1: the header lacks the required columns ref_x_mm");
    QTest::newRow("no rows") << QByteArray() << QByteArray("tip") << QByteArray("has a header but no rows");
  }
  void refuses() {
    QFETCH(QByteArray, rows);
    QFETCH(QByteArray, body);
    QFETCH(QByteArray, says);
    const auto import = importText(rows.toStdString(), {{"body", body.toStdString()}});
    QVERIFY(!import);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"samples.csv", says}));
  }

  void realMeansAgreeWithTheirTable() {
    FT_REQUIRE_REAL_DATA();
    const auto import = importPlus(*realData("pluslib_fcal/samples.csv"), {{"reject", "false"}});
    FT_VERIFY_OK(import);
    QCOMPARE(import->samples->rows.size(), std::size_t{1000});
    FT_VERIFY_MATCH(near(*import->table->metadata.rate_hz, 15.0, 0.1));
    const std::map<int, Landmark> expected = landmarks();
    QCOMPARE(import->table->nodes.size(), expected.size());
    for (const Node& node : import->table->nodes) {
      const Landmark& landmark = expected.at(node.node);
      QVERIFY(node.n_used >= 82 && node.n_used <= 99 && node.n_rejected == 0);
      QCOMPARE(node.n_used, landmark.samples);
      FT_VERIFY_MATCH(near(1e3 * node.tracker_from_sensor.position_m, landmark.mean_mm, 0.001));
      FT_VERIFY_MATCH(near(1e3 * node.reference_from_sensor.position_m, landmark.true_mm, 0.001));
      const Eigen::Vector3d sd_mm = 1e3 * node.covariance_m2->diagonal().cwiseSqrt();
      FT_VERIFY_MATCH(near(sd_mm, landmark.sd_mm, 0.001));
      QVERIFY(node.n_effective > 1.0 && node.n_effective < node.n_used);
    }
    std::size_t with_correlation = 0;
    for (const std::string& note : import->notes)
      with_correlation += note.find("autocorrelation 0.") != std::string::npos;
    QCOMPARE(with_correlation, expected.size());
  }

  void realRejectionsAreListed() {
    FT_REQUIRE_REAL_DATA();
    const auto import = importPlus(*realData("pluslib_fcal/samples.csv"), {});
    FT_VERIFY_OK(import);
    int rejected = 0;
    for (const Node& node : import->table->nodes) rejected += node.n_rejected;
    QVERIFY(rejected > 0);
    int listed = 0;
    for (const std::string& note : import->notes)
      listed += int(QByteArray::fromStdString(note).count("mm from the median (limit"));
    QCOMPARE(listed, rejected);
  }

  void realQuantum_data() {
    QTest::addColumn<QByteArray>("body");
    QTest::newRow("stylus") << QByteArray("stylus");
    QTest::newRow("reference") << QByteArray("reference");
  }
  void realQuantum() {
    FT_REQUIRE_REAL_DATA();
    QFETCH(QByteArray, body);
    const auto import = importPlus(*realData("pluslib_fcal/samples.csv"), {{"body", body.toStdString()}});
    FT_VERIFY_OK(import);
    FT_VERIFY_MATCH(near(import->samples->metadata.quantum_m.value_or(0.0), 914.4e-3 / 8192.0, 1e-9));
    FT_VERIFY_MATCH(holdsAll(import->notes[0], {"multiples of 0.11162 mm"}));
  }

 private:
  Result<Import> importText(const std::string& rows, const std::map<std::string, std::string>& given) {
    const std::filesystem::path path = std::filesystem::path(folder_.path().toStdString()) / "samples.csv";
    std::ofstream(path) << kHead << rows;
    return importPlus(path, given);
  }
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(PlusTest)
#include "plus_test.moc"
