#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <fstream>

#include "calib/importers/rows.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

class ColumnsTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() { QVERIFY(folder_.isValid()); }

  void unitsAndSeparators_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("unit");
    QTest::addColumn<QByteArray>("separator");
    QTest::addColumn<double>("x_m");
    QTest::newRow("mm, comma") << QByteArray("x,y,z,tx,ty,tz\n2,0,0,4,0,0\n") << QByteArray("mm") << QByteArray("comma")
                               << 0.002;
    QTest::newRow("cm, semicolon") << QByteArray("x;y;z;tx;ty;tz\n2;0;0;4;0;0\n") << QByteArray("cm")
                                   << QByteArray("semicolon") << 0.02;
    QTest::newRow("in, tab") << QByteArray("x\ty\tz\ttx\tty\ttz\n2\t0\t0\t4\t0\t0\n") << QByteArray("in")
                             << QByteArray("tab") << 0.0508;
    QTest::newRow("m, blanks") << QByteArray("  x  y z   tx ty tz\n 2   0 0 4  0 0 \n") << QByteArray("m")
                               << QByteArray("space") << 2.0;
  }
  void unitsAndSeparators() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, unit);
    QFETCH(QByteArray, separator);
    QFETCH(double, x_m);
    const auto import = read(text.toStdString(), {{"x_true", "tx"},
                                                  {"y_true", "ty"},
                                                  {"z_true", "tz"},
                                                  {"unit", unit.toStdString()},
                                                  {"separator", separator.toStdString()}});
    FT_VERIFY_OK(import);
    QVERIFY(import->table && !import->samples);
    QCOMPARE(import->table->nodes.size(), std::size_t{1});
    const Node& node = import->table->nodes[0];
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m.x(), x_m, 1e-15));
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m.x(), 2.0 * x_m, 1e-15));
    QVERIFY(!node.has_orientation && node.node == 0);
  }

  void everyColumn() {
    const auto import = read(
        "n,s,v,t,e,px,py,pz,a,b,c,d,tx,ty,tz,ta,tb,tc,td\n"
        "5,1,2,0.5,,1,2,3,0,1,0,0,4,5,6,0,0,1,0\n"
        "5,1,3,0.6,D,1,2,3,0,1,0,0,4,5,6,0,0,1,0\n"
        "6,1,2,0.7,,1,2,3,0,1,0,0,4,5,6,0,0,1,0\n",
        {{"node", "n"},     {"sensor", "s"},   {"visit", "v"},    {"time", "t"},     {"status", "e"},
         {"x", "px"},       {"y", "py"},       {"z", "pz"},       {"qw", "a"},       {"qx", "b"},
         {"qy", "c"},       {"qz", "d"},       {"x_true", "tx"},  {"y_true", "ty"},  {"z_true", "tz"},
         {"qw_true", "ta"}, {"qx_true", "tb"}, {"qy_true", "tc"}, {"qz_true", "td"}, {"frame", "tracker"}});
    FT_VERIFY_OK(import);
    QCOMPARE(import->table->nodes.size(), std::size_t{2});
    const Node& node = import->table->nodes[0];
    QVERIFY(node.node == 5 && node.sensor == 1 && node.visit == 2 && *node.t_start_s == 0.5 && node.has_orientation);
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.orientation, Eigen::Quaterniond(0, 1, 0, 0), 1e-15));
    FT_VERIFY_MATCH(near(node.reference_from_sensor.orientation, Eigen::Quaterniond(0, 0, 1, 0), 1e-15));
    QCOMPARE(import->table->nodes[1].node, 6);
    QCOMPARE(import->table->metadata.frame, std::string("tracker"));
  }

  void visitsCountUpWithoutAColumn() {
    const auto import = read("n,x,y,z,tx,ty,tz\n1,0,0,0,1,0,0\n1,0,0,0,2,0,0\n2,0,0,0,3,0,0\n",
                             {{"node", "n"}, {"x_true", "tx"}, {"y_true", "ty"}, {"z_true", "tz"}});
    FT_VERIFY_OK(import);
    QCOMPARE(import->table->nodes[1].visit, 1);
    FT_VERIFY_MATCH(near(import->table->nodes[1].reference_from_sensor.position_m.x(), 0.002, 1e-15));
    QCOMPARE(import->table->nodes[2].visit, 0);
  }

  void averagesSamples() {
    const auto import =
        read("n,x,y,z,tx,ty,tz\n1,1,0,0,5,0,0\n-1,99,0,0,,,\n2,7,0,0,6,0,0\n1,3,0,0,5,0,0\n",
             {{"node", "n"}, {"average", "true"}, {"x_true", "tx"}, {"y_true", "ty"}, {"z_true", "tz"}});
    FT_VERIFY_OK(import);
    QVERIFY(import->samples && import->samples->rows.size() == 4);
    QCOMPARE(import->table->nodes.size(), std::size_t{2});
    const Node& node = import->table->nodes[0];
    QVERIFY(node.node == 1 && node.n_used == 2);
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m.x(), 0.002, 1e-15));
    FT_VERIFY_MATCH(near(std::sqrt((*node.covariance_m2)(0, 0)), std::sqrt(2.0) * 1e-3, 1e-12));
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m.x(), 0.005, 1e-15));
  }

  void truthFromAnotherFile() {
    const std::filesystem::path truth = write("truth.csv", "label,x_mm,y_mm,z_mm\n2,20,0,0\n1,10,0,0\n");
    const auto by_label = read("n,x,y,z\n1,0,0,0\n2,0,0,0\n", {{"node", "n"}}, truth);
    FT_VERIFY_OK(by_label);
    FT_VERIFY_MATCH(near(by_label->table->nodes[0].reference_from_sensor.position_m.x(), 0.010, 1e-15));
    const auto by_order = read("x,y,z\n1,0,0\n2,0,0\n", {}, truth);
    FT_VERIFY_OK(by_order);
    FT_VERIFY_MATCH(near(by_order->table->nodes[0].reference_from_sensor.position_m.x(), 0.020, 1e-15));
  }

  void withoutTruthThereAreSamples() {
    const auto import = read("x,y,z,t\n1,2,3,0.1\n-3.7e28,-3.7e28,-3.7e28,0.2\n", {{"time", "t"}});
    FT_VERIFY_OK(import);
    QVERIFY(!import->table && import->samples->rows.size() == 2);
    QCOMPARE(import->samples->rows[0].sample.time_s, 0.1);
    QCOMPARE(import->samples->rows[1].sample.status, std::string("missing"));
  }

  void refuses_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("key");
    QTest::addColumn<QByteArray>("value");
    QTest::addColumn<QByteArray>("says");
    const QByteArray good = "n,x,y,z\n1,1,2,3\n";
    QTest::newRow("no such column") << good << QByteArray("x") << QByteArray("X")
                                    << QByteArray("table.csv, line 1: the header lacks the required column X");
    QTest::newRow("half a group") << good << QByteArray("qw") << QByteArray("n")
                                  << QByteArray("qw to qz belong together, qz is missing");
    QTest::newRow("no position") << good << QByteArray("z") << QByteArray("")
                                 << QByteArray("x to z belong together, z is missing");
    QTest::newRow("not a number") << QByteArray("n,x,y,z\n1,1,?,3\n") << QByteArray("node") << QByteArray("n")
                                  << QByteArray("table.csv, line 2, column y: '?'");
    QTest::newRow("unit") << good << QByteArray("unit") << QByteArray("yd")
                          << QByteArray("unit must be one of mm, cm, in, ft, m, got 'yd'");
    QTest::newRow("separator") << good << QByteArray("separator") << QByteArray("tab")
                               << QByteArray("must be separated by commas");
    QTest::newRow("no rows") << QByteArray("n,x,y,z\n") << QByteArray("node") << QByteArray("n")
                             << QByteArray("has a header but no rows");
  }
  void refuses() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, key);
    QFETCH(QByteArray, value);
    QFETCH(QByteArray, says);
    const auto import = read(text.toStdString(), {{key.toStdString(), value.toStdString()}});
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {says}));
  }

  void refusesContradictions() {
    const std::map<std::string, std::string> truth{{"x_true", "x"}, {"y_true", "y"}, {"z_true", "z"}};
    const std::filesystem::path other = write("truth.csv", "x_mm,y_mm,z_mm\n1,2,3\n");
    const auto twice = read("x,y,z\n1,2,3\n", truth, other);
    QVERIFY(!twice);
    FT_VERIFY_MATCH(holdsAll(twice.error().message, {"the truth is given twice"}));
    std::map<std::string, std::string> keys = truth;
    keys["node"] = "n";
    keys["visit"] = "v";
    const auto repeated = read("n,v,x,y,z\n1,0,1,2,3\n1,0,1,2,3\n", keys);
    QVERIFY(!repeated);
    FT_VERIFY_MATCH(holdsAll(repeated.error().message, {"node 1, sensor 0, visit 0 comes twice", "average=true"}));
    std::map<std::string, std::string> average = truth;
    average["average"] = "true";
    const auto no_node = read("x,y,z\n1,2,3\n", average);
    QVERIFY(!no_node);
    FT_VERIFY_MATCH(holdsAll(no_node.error().message, {"average=true needs node="}));
    keys["average"] = "true";
    const auto two_truths = read("n,v,x,y,z\n1,0,1,2,3\n1,0,1,2,4\n", keys);
    QVERIFY(!two_truths);
    FT_VERIFY_MATCH(holdsAll(two_truths.error().message, {"node 1 has more than one true position"}));
  }

 private:
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = std::filesystem::path(folder_.path().toStdString()) / name;
    std::ofstream(path) << text;
    return path;
  }
  Result<Import> read(const std::string& text, const std::map<std::string, std::string>& given,
                      const std::optional<std::filesystem::path>& truth = {}) const {
    const Importer importer = columnsImporter();
    const auto settings = resolveSettings(importer.id, importer.settings, given);
    if (!settings) return tl::unexpected(settings.error());
    return importer.read(write("table.csv", text), truth, *settings);
  }
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(ColumnsTest)
#include "columns_test.moc"
