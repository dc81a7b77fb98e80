#include "calib/importers/fcsv.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>

#include "calib/importers/rows.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

namespace {

constexpr const char* kColumns = "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";

std::string fcsv(const std::string& head, const std::string& label_a, const std::string& label_b) {
  return "# Markups fiducial file version = 4.10\n" + head + kColumns + "n1,10,20,30,0,0,0,1,1,1,0," + label_a +
         ",\"a, b\",\nn2,-40,50.5,60,0,0,0,1,1,1,0," + label_b + ",,\n";
}

}  // namespace

class FcsvTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    in_ = std::filesystem::path(folder_.path().toStdString()) / "points.fcsv";
    truth_ = in_.parent_path() / "truth.csv";
  }

  void coordinateSystems_data() {
    QTest::addColumn<QByteArray>("head");
    QTest::addColumn<double>("sign");
    QTest::addColumn<QByteArray>("note");
    QTest::newRow("0") << QByteArray("# CoordinateSystem = 0\n") << 1.0 << QByteArray();
    QTest::newRow("RAS") << QByteArray("# CoordinateSystem = RAS\n") << 1.0 << QByteArray();
    QTest::newRow("1") << QByteArray("# CoordinateSystem = 1\n") << -1.0 << QByteArray("x and y were negated");
    QTest::newRow("LPS") << QByteArray("# CoordinateSystem = LPS\n") << -1.0 << QByteArray("x and y were negated");
    QTest::newRow("none") << QByteArray() << 1.0 << QByteArray("RAS was assumed");
  }
  void coordinateSystems() {
    QFETCH(QByteArray, head);
    QFETCH(double, sign);
    QFETCH(QByteArray, note);
    write(in_, fcsv(head.toStdString(), "P1", "P2"));
    const auto points = readFcsv(in_);
    FT_VERIFY_OK(points);
    QCOMPARE(points->points.size(), std::size_t{2});
    FT_VERIFY_MATCH(near(points->points[0].position_m, Eigen::Vector3d(sign * 0.010, sign * 0.020, 0.030), 1e-15));
    FT_VERIFY_MATCH(near(points->points[1].position_m, Eigen::Vector3d(sign * -0.040, sign * 0.0505, 0.060), 1e-15));
    QCOMPARE(points->points[1].label, std::string("P2"));
    QCOMPARE(points->notes.size(), std::size_t(note.isEmpty() ? 0 : 1));
    if (!note.isEmpty()) FT_VERIFY_MATCH(holdsAll(points->notes[0], {note}));
  }

  void truthByLabelOrOrder_data() {
    QTest::addColumn<QByteArray>("name");
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<double>("first_x_m");
    QTest::addColumn<QByteArray>("note");
    QTest::newRow("labels, other order, one more")
        << QByteArray("t.csv") << QByteArray("label,x_mm,y_mm,z_mm\nP2,2,0,0\nP3,3,0,0\nP1,1,0,0\n") << 0.001
        << QByteArray("by label");
    QTest::newRow("no labels") << QByteArray("t.csv") << QByteArray("true_x_mm,true_y_mm,true_z_mm\n5,0,0\n6,0,0\n")
                               << 0.005 << QByteArray("by order");
    QTest::newRow("other labels") << QByteArray("t.csv") << QByteArray("label,x_mm,y_mm,z_mm\nP1,5,0,0\nA,6,0,0\n")
                                  << 0.005 << QByteArray("by order");
    QTest::newRow("metres") << QByteArray("t.csv") << QByteArray("x_true_m,y_true_m,z_true_m\n0.5,0,0\n0.6,0,0\n")
                            << 0.5 << QByteArray("by order");
    QTest::newRow("node table") << QByteArray("t.nodes.csv")
                                << QByteArray(
                                       "# frame: "
                                       "room\nnode,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,role\n4,0.4,0,0,9,9,9,"
                                       "validation\n5,0.5,0,0,9,9,9,fit\n")
                                << 0.4 << QByteArray("by order");
    QTest::newRow("fcsv") << QByteArray("t.fcsv")
                          << QByteArray::fromStdString(fcsv("# CoordinateSystem = 0\n", "P2", "P1")) << -0.040
                          << QByteArray("by label");
  }
  void truthByLabelOrOrder() {
    QFETCH(QByteArray, name);
    QFETCH(QByteArray, text);
    QFETCH(double, first_x_m);
    QFETCH(QByteArray, note);
    const std::filesystem::path truth = in_.parent_path() / name.toStdString();
    write(in_, fcsv("# CoordinateSystem = 0\n", "P1", "P2"));
    write(truth, text.toStdString());
    const auto import = fcsvImporter().read(in_, truth, {});
    FT_VERIFY_OK(import);
    QVERIFY(import->table && !import->samples);
    QCOMPARE(import->table->nodes.size(), std::size_t{2});
    const Node& node = import->table->nodes[0];
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m.x(), first_x_m, 1e-15));
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, Eigen::Vector3d(0.01, 0.02, 0.03), 1e-15));
    QVERIFY(!node.has_orientation);
    FT_VERIFY_MATCH(holdsAll(import->notes.back(), {note}));
    if (name == "t.nodes.csv") {
      QVERIFY(node.node == 4 && node.role == NodeRole::kValidation && import->table->metadata.frame == "room");
    }
  }

  void resultIsATableThatReadsBack() {
    write(in_, fcsv("", "P1", "P2"));
    write(truth_, "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n");
    const auto import = fcsvImporter().read(in_, truth_, {});
    FT_VERIFY_OK(import);
    const std::filesystem::path out = in_.parent_path() / "out.nodes.csv";
    FT_VERIFY_OK(writeNodeTable(out, *import->table));
    const auto back = readNodeTable(out);
    FT_VERIFY_OK(back);
    QCOMPARE(back->table.nodes.size(), std::size_t{2});
    QVERIFY(!back->table.nodes[0].has_orientation);
  }

  void refuses_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("truth");
    QTest::addColumn<QByteArray>("says");
    const QByteArray good = QByteArray::fromStdString(fcsv("", "P1", "P2"));
    const QByteArray truth = "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n";
    QTest::newRow("IJK") << QByteArray::fromStdString(fcsv("# CoordinateSystem = 2\n", "a", "b")) << truth
                         << QByteArray(
                                "points.fcsv, line 2: CoordinateSystem is '2', it must be 0 or RAS, or 1 or LPS");
    QTest::newRow("NaN") << QByteArray(good).replace("50.5", "nan") << truth
                         << QByteArray("points.fcsv, line 4, column y: 'nan'");
    QTest::newRow("short row") << good + "n3,1,2\n"
                               << truth << QByteArray("points.fcsv, line 5: the row has 3 fields, the header has 14");
    QTest::newRow("no points") << QByteArray(kColumns) << truth << QByteArray("points.fcsv has a header but no points");
    QTest::newRow("counts differ") << good << QByteArray("x_mm,y_mm,z_mm\n1,2,3\n")
                                   << QByteArray("The recording has 2 points and the truth file 1");
    QTest::newRow("truth without positions")
        << good << QByteArray("label,a\nP1,1\n") << QByteArray("truth.csv has no true positions");
    QTest::newRow("truth broken") << good << QByteArray("x_mm,y_mm,z_mm\n1,2,3\n4,x,6\n")
                                  << QByteArray("truth.csv, line 3, column y_mm: 'x'");
    QTest::newRow("truth empty") << good << QByteArray("x_mm,y_mm,z_mm\n")
                                 << QByteArray("truth.csv has a header but no points");
  }
  void refuses() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, truth);
    QFETCH(QByteArray, says);
    write(in_, text.toStdString());
    write(truth_, truth.toStdString());
    const auto import = fcsvImporter().read(in_, truth_, {});
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {says}));
  }

  void needsTruth() {
    write(in_, fcsv("", "P1", "P2"));
    QVERIFY(fcsvImporter().needs_truth);
    const auto import = fcsvImporter().read(in_, std::nullopt, {});
    QVERIFY(!import);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"points.fcsv holds tracked points only", "true positions"}));
  }

 private:
  static void write(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }
  QTemporaryDir folder_;
  std::filesystem::path in_;
  std::filesystem::path truth_;
};

FIELDTRUE_TEST(FcsvTest)
#include "fcsv_test.moc"
