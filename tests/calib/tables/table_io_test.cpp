#include "calib/tables/table_io.h"

#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <random>
#include <sstream>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

auto nodesOf(const std::string& text) {
  std::istringstream in(text);
  return readNodeTable(in, "t.nodes.csv");
}

auto samplesOf(const std::string& text) {
  std::istringstream in(text);
  return readSampleTable(in, "t.samples.csv");
}

template <class Table>
std::string textOf(const Table& table) {
  std::ostringstream out;
  if constexpr (std::is_same_v<Table, SampleTable>) {
    writeSampleTable(out, table);
  } else {
    writeNodeTable(out, table);
  }
  return out.str();
}

/// A row with every column given and one with only what is required, in an order of its own.
const char* const kFull =
    "# frame: room\n"
    "# tracker: Fastrak\n"
    "# jig_tolerance_m: 0.0005\n"
    "# alignment: known\n"
    "# operator: A: B\n"
    "# a remark without a key\n"
    "role,z_m,y_m,x_m,node,sensor,visit,i,j,k,x_true_m,y_true_m,z_true_m,qw_true,qx_true,qy_true,qz_true,qw,qx,qy,qz,"
    "sd_x_m,sd_y_m,sd_z_m,cov_xy_m2,cov_xz_m2,cov_yz_m2,sd_rot_rad,n_used,n_rejected,n_effective,t_start_s,t_end_s\n"
    "validation,0.3,0.2,0.1,5,1,2,3,-4,5,1,2,3,0,1,0,0,-0.6,0,0,0.8,"
    "0.001,0.002,0.003,1e-6,-2e-6,3e-6,0.01,58,2,7.5,10.25,12\n"
    ",6,5,4,6,,,,,,7,8,9,,,,,,,,,,,,,,,,,,,,\n";

}  // namespace

class TableIoTest : public QObject {
  Q_OBJECT

 private slots:
  void readsEveryColumn() {
    const auto reading = nodesOf(kFull);
    FT_VERIFY_OK(reading);
    QVERIFY(reading->notes.empty());
    QCOMPARE(reading->table.nodes.size(), std::size_t{2});
    const Node& node = reading->table.nodes[0];
    QVERIFY(node.node == 5 && node.sensor == 1 && node.visit == 2 && node.role == NodeRole::kValidation);
    QVERIFY((*node.index == std::array<int, 3>{3, -4, 5}));
    FT_VERIFY_MATCH(sameBits(node.reference_from_sensor, Pose{{1, 2, 3}, Eigen::Quaterniond(0, 1, 0, 0)}));
    FT_VERIFY_MATCH(
        near(node.tracker_from_sensor, Pose{{0.1, 0.2, 0.3}, Eigen::Quaterniond(0.6, 0, 0, -0.8)}, 0, 1e-15));
    QVERIFY(node.tracker_from_sensor.orientation.w() > 0.0 && node.has_orientation);
    Eigen::Matrix3d covariance;
    covariance << 1e-6, 1e-6, -2e-6, 1e-6, 4e-6, 3e-6, -2e-6, 3e-6, 9e-6;
    FT_VERIFY_MATCH(near(*node.covariance_m2, covariance, 1e-20));
    QVERIFY(*node.sd_rot_rad == 0.01 && node.n_used == 58 && node.n_rejected == 2 && node.n_effective == 7.5);
    QVERIFY(*node.t_start_s == 10.25 && *node.t_end_s == 12.0);
  }

  void readsMetadata() {
    const TableMetadata metadata = nodesOf(kFull)->table.metadata;
    QCOMPARE(metadata.frame, std::string("room"));
    QCOMPARE(*metadata.tracker, std::string("Fastrak"));
    QCOMPARE(*metadata.jig_tolerance_m, 0.0005);
    QVERIFY(metadata.alignment_known && !metadata.rate_hz);
    QCOMPARE(metadata.other.size(), std::size_t{1});
    QCOMPARE(metadata.other.at("operator"), std::string("A: B"));
  }

  void fillsDefaults() {
    const Node node = nodesOf(kFull)->table.nodes[1];
    QVERIFY(node.node == 6 && node.sensor == 0 && node.visit == 0 && node.role == NodeRole::kFit && !node.index);
    FT_VERIFY_MATCH(sameBits(node.reference_from_sensor, Pose{{7, 8, 9}, Eigen::Quaterniond::Identity()}));
    QVERIFY(!node.has_orientation && !node.covariance_m2 && !node.sd_rot_rad && !node.t_start_s && !node.t_end_s);
    QVERIFY(node.n_used == 1 && node.n_rejected == 0 && node.n_effective == 1.0);
    const auto bare = nodesOf("node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,n_used\n1,1,2,3,4,5,6,42\n");
    FT_VERIFY_OK(bare);
    QVERIFY(bare->table.nodes[0].n_effective == 42.0 && bare->table.metadata.frame == "jig");
    QVERIFY(!bare->table.nodes[0].has_orientation && !bare->table.metadata.alignment_known);
    FT_VERIFY_MATCH(holdsAll(bare->notes.at(0), {"t.nodes.csv", "positions only"}));
  }

  void visitsCountUpPerNodeAndSensor() {
    const auto reading = nodesOf(
        "node,sensor,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n"
        "3,0,0,0,0,0,0,0\n3,1,0,0,0,0,0,0\n4,0,0,0,0,0,0,0\n3,0,0,0,0,0,0,0\n3,0,0,0,0,0,0,0\n3,1,0,0,0,0,0,0\n");
    FT_VERIFY_OK(reading);
    std::vector<int> visits;
    for (const Node& node : reading->table.nodes) visits.push_back(node.visit);
    QVERIFY((visits == std::vector<int>{0, 0, 0, 1, 2, 1}));
  }

  void acceptsForeignText_data() {
    QTest::addColumn<QByteArray>("text");
    const QByteArray head = "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n";
    QTest::newRow("byte-order mark") << "\xEF\xBB\xBF" + head + "1,1,2,3,4,5,6\n";
    QTest::newRow("byte-order mark before metadata") << "\xEF\xBB\xBF# frame: jig\n" + head + "1,1,2,3,4,5,6\n";
    QTest::newRow("CRLF") << QByteArray(head + "1,1,2,3,4,5,6\n").replace("\n", "\r\n");
    QTest::newRow("no line end") << head + "1,1,2,3,4,5,6";
    QTest::newRow("blank lines") << "\n" + head + "\n1,1,2,3,4,5,6\n\n\n";
    QTest::newRow("blanks") << QByteArray(" node , x_true_m,y_true_m\t,z_true_m,x_m,y_m,z_m\n 1 ,1, 2,3,4,5,6 \n");
    QTest::newRow("quotes") << QByteArray(
        "\"node\",x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n\"1\",\"1\",2,3,4,5,\"6\"\n");
    QTest::newRow("spreadsheet's whole numbers") << head + "1.0,1,2,3,4,5,6\n";
    QTest::newRow("signs and exponents") << head + "1,+1,2.0,3e0,+4.,.5e1,6E+0\n";
    QTest::newRow("metadata after the rows") << head + "1,1,2,3,4,5,6\n# frame: jig\n";
  }
  void acceptsForeignText() {
    QFETCH(QByteArray, text);
    const auto reading = nodesOf(text.toStdString());
    FT_VERIFY_OK(reading);
    QCOMPARE(reading->table.nodes.size(), std::size_t{1});
    const Node& node = reading->table.nodes[0];
    QCOMPARE(node.node, 1);
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m, Eigen::Vector3d(1, 2, 3), 0.0));
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, Eigen::Vector3d(4, 5, 6), 0.0));
    QCOMPARE(reading->table.metadata.frame, std::string("jig"));
  }

  void onlyTheHeadHoldsMetadata() {
    const std::string head = "# frame: room\nnode,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n";
    const auto reading = nodesOf(head +
                                 "1,1,2,3,4,5,6\n# frame: tracker\n# alignment: known\n2,1,2,3,4,5,6\n"
                                 "# jig_tolerance_m: nonsense\n# moved the lamp at 10:30\n# operator: B\n");
    FT_VERIFY_OK(reading);
    QCOMPARE(reading->table.nodes.size(), std::size_t{2});
    QCOMPARE(reading->table.metadata.frame, std::string("room"));
    QVERIFY(!reading->table.metadata.alignment_known);
    QVERIFY(!reading->table.metadata.jig_tolerance_m);
    QVERIFY(reading->table.metadata.other.empty());
    FT_VERIFY_MATCH(holdsAll(reading->notes.at(0), {"t.nodes.csv, line 4", "# frame: tracker", "3 more", "comment"}));
    const auto samples = samplesOf("node,t_s,x_m,y_m,z_m\n0,0,1,2,3\n# rate_hz: 5\n0,1,1,2,3\n");
    FT_VERIFY_OK(samples);
    QVERIFY(!samples->table.metadata.rate_hz);
    FT_VERIFY_MATCH(holdsAll(samples->notes.at(0), {"line 3", "# rate_hz: 5", "stands", "comment"}));
    // A mere remark is no metadata and needs no note.
    const auto remark = nodesOf(head + "1,1,2,3,4,5,6\n# moved the lamp at 10:30\n");
    FT_VERIFY_OK(remark);
    for (const std::string& note : remark->notes) QVERIFY2(note.find("comment") == std::string::npos, note.c_str());
  }

  void notesUnknownColumns() {
    const auto reading =
        nodesOf("node,colour,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,qw,qx,qy,qz,x_mm\n1,red,1,2,3,4,5,6,1,0,0,0,9\n");
    FT_VERIFY_OK(reading);
    QCOMPARE(reading->notes.size(), std::size_t{1});
    FT_VERIFY_MATCH(holdsAll(reading->notes[0], {"t.nodes.csv", "colour, x_mm are not known and were ignored"}));
  }

  void asksAboutMetadataThatLooksLikeAnother() {
    const std::string rows = "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,qw,qx,qy,qz\n1,1,2,3,4,5,6,1,0,0,0\n";
    const auto reading = nodesOf(
        "# frame: jig\n# jig_tolerance_mm: 1\n# Jig-Tolerance_M: 0.001\n# aligment: known\n# rate: 40\n"
        "# scene: hall\n# seed: 3\n# operator: B\n" +
        rows);
    FT_VERIFY_OK(reading);
    QCOMPARE(reading->notes.size(), std::size_t{4});
    FT_VERIFY_MATCH(
        holdsAll(reading->notes[0], {"t.nodes.csv, line 2", "jig_tolerance_mm", "is jig_tolerance_m meant"}));
    FT_VERIFY_MATCH(holdsAll(reading->notes[1], {"line 3", "Jig-Tolerance_M", "is jig_tolerance_m meant"}));
    FT_VERIFY_MATCH(holdsAll(reading->notes[2], {"line 4", "aligment", "is alignment meant"}));
    FT_VERIFY_MATCH(holdsAll(reading->notes[3], {"line 5", "rate", "is rate_hz meant"}));
    QVERIFY(!reading->table.metadata.jig_tolerance_m);
  }

  void aMeanOfNothingIsNoReading() {
    const std::string header = "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,n_used,role\n";
    const auto none = nodesOf(header + "1,1,2,3,4,5,6,0,fit\n");
    QVERIFY(!none);
    FT_VERIFY_MATCH(holdsAll(none.error().message, {"line 2", "n_used", "1 or more", "skipped"}));
    FT_VERIFY_OK(nodesOf(header + "1,1,2,3,4,5,6,0,skipped\n"));
  }

  void nodeTableRoundTripsToTheSameBits() {
    SyntheticOptions options;
    options.orientations = 2;
    options.smooth_distortion_m = 0.03;
    options.orientation_error_rad = 0.1;
    options.validation_fraction = 0.3;
    CalibrationTable table =
        syntheticTable(options, {.position_sd_m = 1e-4, .rotation_sd_rad = 1e-3, .placing_sd_m = 1e-4});
    table.metadata.tracker = "Fastrak, long ranger";
    table.metadata.alignment_known = true;
    table.metadata.quantum_m = 1.0 / 3.0;
    table.metadata.other["note"] = "a: b # c";
    table.nodes[1].has_orientation = false;
    table.nodes[1].tracker_from_sensor.orientation = Eigen::Quaterniond::Identity();
    table.nodes[2].index.reset();
    table.nodes[3].sd_rot_rad = 0.1 / 3.0;
    table.nodes[3].t_start_s = 1e-17;
    table.nodes[3].t_end_s = 5e300;
    table.nodes[3].n_effective = 20.0 / 7.0;
    table.nodes[3].n_used = 60;
    table.nodes[4].role = NodeRole::kSkipped;
    const std::string text = textOf(table);
    const auto back = nodesOf(text);
    FT_VERIFY_OK(back);
    QVERIFY(back->notes.empty());
    QCOMPARE(back->table.nodes.size(), table.nodes.size());
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      const Node& a = table.nodes[i];
      const Node& b = back->table.nodes[i];
      FT_VERIFY_MATCH(sameBits(b.reference_from_sensor, a.reference_from_sensor));
      FT_VERIFY_MATCH(sameBits(b.tracker_from_sensor, a.tracker_from_sensor));
      QVERIFY(a.node == b.node && a.visit == b.visit && a.sensor == b.sensor && a.index == b.index && a.role == b.role);
      QVERIFY(a.has_orientation == b.has_orientation && a.sd_rot_rad == b.sd_rot_rad && a.n_effective == b.n_effective);
      QVERIFY(a.t_start_s == b.t_start_s && a.t_end_s == b.t_end_s && a.covariance_m2 == b.covariance_m2);
    }
    QVERIFY(back->table.metadata.other == table.metadata.other &&
            back->table.metadata.quantum_m == table.metadata.quantum_m);
    QVERIFY(back->table.metadata.tracker == table.metadata.tracker && back->table.metadata.alignment_known);
    QVERIFY(textOf(back->table) == text);
  }

  void covarianceRoundTrips() {
    std::mt19937 engine(4);
    std::normal_distribution<double> normal;
    CalibrationTable table;
    for (int i = 0; i < 200; ++i) {
      Node node;
      node.node = i;
      Eigen::Matrix3d root;
      for (Eigen::Index k = 0; k < 9; ++k) root.data()[k] = 1e-3 * normal(engine);
      node.covariance_m2 = root * root.transpose();
      table.nodes.push_back(node);
    }
    const std::string text = textOf(table);
    const auto back = nodesOf(text);
    FT_VERIFY_OK(back);
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      const Eigen::Matrix3d& expected = *table.nodes[i].covariance_m2;
      FT_VERIFY_MATCH(near(*back->table.nodes[i].covariance_m2, expected, 4e-16 * expected.norm()));
    }
    // The file holds SDs: once written, nothing moves any more.
    QVERIFY(textOf(back->table) == text);
  }

  void indexIsWrittenOnlyWhereThereIsOne() {
    CalibrationTable table = syntheticTable();
    QVERIFY(textOf(table).find("node,i,j,k,sensor,") != std::string::npos);
    for (Node& node : table.nodes) node.index.reset();
    QVERIFY(textOf(table).find("node,sensor,visit,") != std::string::npos);
  }

  void readsSamples() {
    const auto reading = samplesOf(
        "# rate_hz: 120\n"
        "status,t_s,node,x_m,y_m,z_m,qw,qx,qy,qz,visit\n"
        ",0.5,-1,1,2,3,1,0,0,0,\n"
        "D,0.6,4,1,2,3,0,0,-1,0,2\n"
        ",0.7,4,-3.7e28,-3.7e28,-3.7e28,-3.7e28,-3.7e28,-3.7e28,-3.7e28,2\n"
        "lost,0.8,4,,nan,,0,0,0,nan,2\n");
    FT_VERIFY_OK(reading);
    const std::vector<SampleRow>& rows = reading->table.rows;
    QCOMPARE(rows.size(), std::size_t{4});
    QVERIFY(rows[0].node == -1 && rows[0].visit == 0 && rows[0].sample.sensor == 0 && rows[0].sample.time_s == 0.5);
    QVERIFY(rows[0].sample.status.empty() && rows[1].sample.status == "D" && rows[1].visit == 2);
    QCOMPARE(rows[2].sample.status, std::string("missing"));
    QCOMPARE(rows[2].sample.tracker_from_sensor.position_m.x(), -3.7e28);
    QCOMPARE(rows[3].sample.status, std::string("lost"));
    QVERIFY(std::isnan(rows[3].sample.tracker_from_sensor.position_m.y()));
    QCOMPARE(*reading->table.metadata.rate_hz, 120.0);
  }

  void sampleTableRoundTripsToTheSameBits() {
    std::mt19937 engine(9);
    std::normal_distribution<double> normal;
    SampleTable table;
    table.metadata.rate_hz = 40.0;
    for (int i = 0; i < 500; ++i) {
      SampleRow row;
      row.node = i / 60 - 1;
      row.visit = i % 2;
      row.sample.time_s = i / 120.0;
      row.sample.sensor = i % 3;
      row.sample.tracker_from_sensor.position_m =
          Eigen::Vector3d(normal(engine), 1e-9 * normal(engine), 1e9 * normal(engine));
      row.sample.tracker_from_sensor.orientation =
          canonical(Eigen::Quaterniond(normal(engine), normal(engine), normal(engine), normal(engine)));
      if (i == 100) row.sample.status = "a, \"b\"";
      table.rows.push_back(row);
    }
    const auto back = samplesOf(textOf(table));
    FT_VERIFY_OK(back);
    QVERIFY(back->notes.empty() && back->table.metadata.rate_hz == 40.0);
    QCOMPARE(back->table.rows.size(), table.rows.size());
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      const SampleRow& a = table.rows[i];
      const SampleRow& b = back->table.rows[i];
      FT_VERIFY_MATCH(sameBits(b.sample.tracker_from_sensor, a.sample.tracker_from_sensor));
      FT_VERIFY_MATCH(sameBits(b.sample.time_s, a.sample.time_s));
      QVERIFY(a.node == b.node && a.visit == b.visit && a.sample.sensor == b.sample.sensor);
      QCOMPARE(b.sample.status, a.sample.status);
    }
  }

  // A reading that is not one must not come back as a good sample.
  void nanSampleComesBackMarked() {
    SampleTable table;
    table.rows.resize(1);
    table.rows[0].sample.tracker_from_sensor.position_m.setConstant(std::nan(""));
    const auto back = samplesOf(textOf(table));
    FT_VERIFY_OK(back);
    QCOMPARE(back->table.rows[0].sample.status, std::string("missing"));
  }

  void readsALongTableQuickly() {
    SampleTable table;
    table.rows.resize(36000);
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      table.rows[i].sample.tracker_from_sensor.position_m.setConstant(1.0 / static_cast<double>(i + 3));
    }
    const std::string text = textOf(table);
    const auto start = std::chrono::steady_clock::now();
    const auto reading = samplesOf(text);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    FT_VERIFY_OK(reading);
    QCOMPARE(reading->table.rows.size(), std::size_t{36000});
    QVERIFY2(taken.count() < 1.0, QByteArray::number(taken.count()) + " s");
  }

  void filesAndFolders() {
    QTemporaryDir folder;
    const std::filesystem::path path = std::filesystem::path(folder.path().toStdString()) / "room.nodes.csv";
    const CalibrationTable table = syntheticTable();
    FT_VERIFY_OK(writeNodeTable(path, table));
    const auto back = readNodeTable(path);
    FT_VERIFY_OK(back);
    QCOMPARE(back->table.nodes.size(), table.nodes.size());
    const auto absent = readNodeTable(path.parent_path() / "absent.csv");
    QVERIFY(!absent && absent.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(absent.error().message, {"Cannot read", "absent.csv", "No such file or directory"}));
    const auto is_folder = readSampleTable(path.parent_path());
    QVERIFY(!is_folder && is_folder.error().code == ErrorCode::kIo);
    FT_VERIFY_MATCH(holdsAll(is_folder.error().message, {"it is a folder"}));
    const auto full = writeNodeTable("/dev/full", table);
    QVERIFY(!full);
    FT_VERIFY_MATCH(holdsAll(full.error().message, {"No space left on device"}));
  }
};

FIELDTRUE_TEST(TableIoTest)
#include "table_io_test.moc"
