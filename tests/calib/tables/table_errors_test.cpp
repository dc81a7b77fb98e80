#include <QTest>
#include <sstream>

#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

auto badNodesOf(const std::string& text) {
  std::istringstream in(text);
  return readNodeTable(in, "bad.nodes.csv");
}

auto badSamplesOf(const std::string& text) {
  std::istringstream in(text);
  return readSampleTable(in, "bad.samples.csv");
}

/// One good row in line 3; the second, in line 4, gets one column changed.
QByteArray nodeText(const QByteArray& column, const QByteArray& value) {
  const QList<QByteArray> columns{"node",      "sensor",    "visit",      "i",       "j",          "k",
                                  "x_true_m",  "y_true_m",  "z_true_m",   "qw_true", "qx_true",    "qy_true",
                                  "qz_true",   "x_m",       "y_m",        "z_m",     "qw",         "qx",
                                  "qy",        "qz",        "sd_x_m",     "sd_y_m",  "sd_z_m",     "cov_xy_m2",
                                  "cov_xz_m2", "cov_yz_m2", "sd_rot_rad", "n_used",  "n_rejected", "n_effective",
                                  "t_start_s", "t_end_s",   "role"};
  const QList<QByteArray> good{"1",    "0", "0", "0", "0",    "0",  "1", "2", "3", "1",    "0",
                               "0",    "0", "4", "5", "6",    "1",  "0", "0", "0", "1e-3", "1e-3",
                               "1e-3", "0", "0", "0", "1e-3", "60", "0", "6", "1", "2",    "fit"};
  QList<QByteArray> changed = good;
  changed[0] = "2";
  if (!column.isEmpty()) changed[columns.indexOf(column)] = value;
  return "# frame: jig\n" + columns.join(',') + "\n" + good.join(',') + "\n" + changed.join(',') + "\n";
}

const QByteArray kSampleHead = "node,sensor,visit,t_s,x_m,y_m,z_m,qw,qx,qy,qz,status\n";

}  // namespace

class TableErrorsTest : public QObject {
  Q_OBJECT

 private slots:
  void badField_data() {
    QTest::addColumn<QByteArray>("column");
    QTest::addColumn<QByteArray>("value");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("NaN") << QByteArray("x_m") << QByteArray("nan") << QByteArray("'nan' is not a finite number");
    QTest::newRow("infinite") << QByteArray("y_true_m") << QByteArray("-inf")
                              << QByteArray("'-inf' is not a finite number");
    QTest::newRow("overflow") << QByteArray("z_m") << QByteArray("1e999")
                              << QByteArray("'1e999' is not a finite number");
    QTest::newRow("text") << QByteArray("z_m") << QByteArray("abc") << QByteArray("'abc' is not a finite number");
    QTest::newRow("sensor below 0") << QByteArray("sensor") << QByteArray("-1")
                                    << QByteArray("-1 is no sensor, it must be 0 or more");
    QTest::newRow("unit") << QByteArray("z_m") << QByteArray("6 m") << QByteArray("'6 m' is not a finite number");
    QTest::newRow("signs") << QByteArray("z_m") << QByteArray("+-6") << QByteArray("'+-6' is not a finite number");
    QTest::newRow("blank") << QByteArray("x_true_m") << QByteArray("")
                           << QByteArray("the field is blank, a number is needed");
    QTest::newRow("missing mark") << QByteArray("x_m") << QByteArray("-3.7e28")
                                  << QByteArray("-3.7e+28 is the mark of a missing reading");
    QTest::newRow("node fraction") << QByteArray("node") << QByteArray("2.5")
                                   << QByteArray("'2.5' is not a whole number");
    QTest::newRow("node text") << QByteArray("node") << QByteArray("A1") << QByteArray("'A1' is not a whole number");
    QTest::newRow("node blank") << QByteArray("node") << QByteArray("") << QByteArray("a whole number is needed");
    QTest::newRow("node huge") << QByteArray("node") << QByteArray("99999999999")
                               << QByteArray("is not a whole number");
    QTest::newRow("node negative") << QByteArray("node") << QByteArray("-1")
                                   << QByteArray("-1 is no place, it must be 0 or more");
    QTest::newRow("repeated key") << QByteArray("node") << QByteArray("1")
                                  << QByteArray("node 1, sensor 0, visit 0 stands already in line 3");
    QTest::newRow("sensor") << QByteArray("sensor") << QByteArray("left") << QByteArray("'left' is not a whole number");
    QTest::newRow("visit") << QByteArray("visit") << QByteArray("0.1") << QByteArray("'0.1' is not a whole number");
    QTest::newRow("index half given") << QByteArray("j") << QByteArray("")
                                      << QByteArray("the field is blank, its neighbours are not");
    QTest::newRow("zero quaternion") << QByteArray("qw") << QByteArray("0")
                                     << QByteArray("the quaternion is zero, a rotation has length 1");
    QTest::newRow("long quaternion") << QByteArray("qw") << QByteArray("2")
                                     << QByteArray("the quaternion has length 2");
    QTest::newRow("quaternion half given")
        << QByteArray("qy_true") << QByteArray("") << QByteArray("the field is blank, a number is needed");
    QTest::newRow("negative SD") << QByteArray("sd_y_m") << QByteArray("-1e-3")
                                 << QByteArray("-0.001 is too small, it must be 0 or more");
    QTest::newRow("SD half given") << QByteArray("sd_z_m") << QByteArray("")
                                   << QByteArray("the field is blank, its neighbours are not");
    QTest::newRow("covariance too large")
        << QByteArray("cov_xz_m2") << QByteArray("2e-6") << QByteArray("2e-06 exceeds the product of the two SDs");
    QTest::newRow("negative rotation SD")
        << QByteArray("sd_rot_rad") << QByteArray("-1") << QByteArray("-1 is too small");
    QTest::newRow("negative count") << QByteArray("n_used") << QByteArray("-5")
                                    << QByteArray("-5 is too small, it must be 0 or more");
    QTest::newRow("count fraction") << QByteArray("n_rejected") << QByteArray("0.5")
                                    << QByteArray("is not a whole number");
    QTest::newRow("worth nothing") << QByteArray("n_effective") << QByteArray("0")
                                   << QByteArray("0 is too small, it must be more than 0");
    QTest::newRow("time backwards") << QByteArray("t_end_s") << QByteArray("0.5")
                                    << QByteArray("0.5 is before t_start_s, 1");
    QTest::newRow("unknown role") << QByteArray("role") << QByteArray("test")
                                  << QByteArray("'test' is not one of fit, validation, skipped");
  }
  void badField() {
    QFETCH(QByteArray, column);
    QFETCH(QByteArray, value);
    QFETCH(QByteArray, says);
    FT_VERIFY_OK(badNodesOf(nodeText("", "").toStdString()));
    const auto reading = badNodesOf(nodeText(column, value).toStdString());
    QVERIFY(!reading);
    QVERIFY(reading.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(reading.error().message, {"bad.nodes.csv, line 4, column " + column + ": ", says}));
  }

  void badFile_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("says");
    const QByteArray head = "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m";
    const QByteArray row = "\n1,1,2,3,4,5,6\n";
    QTest::newRow("empty") << QByteArray() << QByteArray("bad.nodes.csv is empty; it needs a row of column names");
    QTest::newRow("only metadata") << QByteArray("# frame: jig\n") << QByteArray("bad.nodes.csv has no header row");
    QTest::newRow("no rows") << head + "\n" << QByteArray("bad.nodes.csv has a header but no rows");
    QTest::newRow("missing column") << QByteArray("node,x_true_m,y_true_m,z_true_m,x_m,z_m") + row
                                    << QByteArray("bad.nodes.csv, line 1: the header lacks the required column y_m");
    QTest::newRow("missing columns") << QByteArray("node,x_m,y_m,z_m") + row
                                     << QByteArray(
                                            "the header lacks the required columns x_true_m, y_true_m, z_true_m");
    QTest::newRow("semicolons") << QByteArray(head).replace(',', ';') + row
                                << QByteArray("its fields must be separated by commas");
    QTest::newRow("blanks") << QByteArray(head).replace(',', ' ') + row
                            << QByteArray("its fields must be separated by commas");
    QTest::newRow("units in the head") << QByteArray("node,x_true_m,y_true_m,z_true_m,x_mm,y [m],Z_M") + row
                                       << QByteArray("columns x_m, y_m, z_m; it has x_mm, y [m], Z_M, but a name must");
    QTest::newRow("no names") << QByteArray("1,2,3,4,5,6,7") + row
                              << QByteArray("z_m; it holds numbers where the names of the columns must stand");
    QTest::newRow("no names, a number twice")
        << QByteArray("1,1,3,4,5,6,7") + row
        << QByteArray("column 1 comes twice; it holds numbers where the names of the columns must stand");
    QTest::newRow("half a group") << head + ",qw,qx,qz\n1,1,2,3,4,5,6,1,0,0\n"
                                  << QByteArray("column qy (qw, qx, qy, qz belong together: all or none)");
    QTest::newRow("covariance alone") << head + ",cov_xy_m2,cov_xz_m2,cov_yz_m2\n1,1,2,3,4,5,6,0,0,0\n"
                                      << QByteArray("need sd_x_m, sd_y_m, sd_z_m");
    QTest::newRow("column twice") << head + ",x_m\n1,1,2,3,4,5,6,7\n" << QByteArray("line 1: column x_m comes twice");
    QTest::newRow("column without name") << head + ",\n1,1,2,3,4,5,6,7\n" << QByteArray("line 1: column 8 has no name");
    QTest::newRow("too few fields") << head + "\n1,1,2,3,4,5\n2,1,2,3,4,5,6\n"
                                    << QByteArray(
                                           "bad.nodes.csv, line 2: the row has 6 fields, the header has 7 columns");
    QTest::newRow("too many fields") << head + "\n1,1,2,3,4,5,6,7\n" << QByteArray("line 2: the row has 8 fields");
    QTest::newRow("decimal comma") << head + "\n1,1,2,3,4,5,6,5\n" << QByteArray("the header has 7 columns");
    QTest::newRow("cut off")
        << head + row + "2,1,2,3,4"
        << QByteArray(
               "line 3: the row has 5 fields, the header has 7 columns; the file ends in the middle of this row");
    QTest::newRow("cut before the role") << head + ",role\n1,1,2,3,4,5,6,"
                                         << QByteArray("line 2, column role: the file ends before the role");
    QTest::newRow("open quote") << head + "\n\"1,1,2,3,4,5,6\n" << QByteArray("line 2: a quoted field is not closed");
    QTest::newRow("UTF-16") << QByteArray("\xFF\xFEn\0o\0d\0e\0", 10) << QByteArray("line 1: this is not UTF-8 text");
    QTest::newRow("Latin-1") << "# frame: jig\n# setup.room: caf\xE9\n" + head + row
                             << QByteArray("line 2: this is not UTF-8 text");
    QTest::newRow("Latin-1 key") << "# caf\xE9: 1\n" + head + row << QByteArray("line 1: this is not UTF-8 text");
    QTest::newRow("half a UTF-16 pair") << "# note: \xED\xA0\x80\n" + head + row
                                        << QByteArray("line 1: this is not UTF-8 text");
    QTest::newRow("longer than need be") << "# note: \xC0\xAF\n" + head + row
                                         << QByteArray("line 1: this is not UTF-8 text");
    QTest::newRow("repeated key, default visit given")
        << head + ",visit\n1,1,2,3,4,5,6,1\n1,1,2,3,4,5,6,1\n"
        << QByteArray("line 3, column node: node 1, sensor 0, visit 1 stands already in line 2");
    QTest::newRow("frame") << "# frame: lab\n" + head + row
                           << QByteArray("line 1, metadata frame: 'lab' is not one of tracker, jig, room");
    QTest::newRow("excitation") << "# excitation: dc\n" + head + row << QByteArray("'dc' is not one of ac, pulsed_dc");
    QTest::newRow("alignment") << "# alignment: yes\n" + head + row << QByteArray("'yes' is not one of known, unknown");
    QTest::newRow("rate") << "# x: 1\n# rate_hz: fast\n" + head + row
                          << QByteArray("line 2, metadata rate_hz: 'fast' is not a number of 0 or more");
    QTest::newRow("tolerance") << "# jig_tolerance_m: -1\n" + head + row
                               << QByteArray("'-1' is not a number of 0 or more");
    QTest::newRow("huge tolerance") << "# jig_tolerance_m: 1e300\n" + head + row
                                    << QByteArray("'1e300' is too large to be measured");
    QTest::newRow("metadata twice") << "# frame: jig\n# frame: room\n" + head + row
                                    << QByteArray("line 2, metadata frame: it is given twice");
  }
  void badFile() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, says);
    const auto reading = badNodesOf(text.toStdString());
    QVERIFY(!reading);
    QVERIFY(reading.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(reading.error().message, {"bad.nodes.csv", says}));
  }

  void metadataOfAllLengthsIsRead() {
    const std::string text = "caf\xC3\xA9 \xE2\x82\xAC \xED\x9F\xBF \xF0\x9F\xA7\xB2 \xF4\x8F\xBF\xBF";
    const auto reading =
        badNodesOf("# setup.room: " + text + "\nnode,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n1,1,2,3,4,5,6\n");
    FT_VERIFY_OK(reading);
    QVERIFY(factOf(reading->table.metadata.setup, "room") == text);
  }

  void badSamples_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("empty") << QByteArray() << QByteArray("bad.samples.csv is empty");
    QTest::newRow("no rows") << kSampleHead << QByteArray("has a header but no rows");
    QTest::newRow("no time") << QByteArray("node,x_m,y_m,z_m\n")
                             << QByteArray("line 1: the header lacks the required column t_s");
    QTest::newRow("half a quaternion") << QByteArray("node,t_s,x_m,y_m,z_m,qw\n") << QByteArray("belong together");
    QTest::newRow("NaN in a good sample") << kSampleHead + "1,0,0,0,1,nan,3,1,0,0,0,\n"
                                          << QByteArray("line 2, column y_m: 'nan' is not a finite number");
    QTest::newRow("blank in a good sample") << kSampleHead + "1,0,0,0,1,,3,1,0,0,0,\n"
                                            << QByteArray("line 2, column y_m: the field is blank");
    QTest::newRow("text in a marked sample") << kSampleHead + "1,0,0,0,1,x,3,1,0,0,0,D\n"
                                             << QByteArray("line 2, column y_m: 'x'");
    QTest::newRow("zero quaternion") << kSampleHead + "1,0,0,0,1,2,3,0,0,0,0,\n"
                                     << QByteArray("line 2, column qw: the quaternion is zero");
    QTest::newRow("time") << kSampleHead + "1,0,0,nan,1,2,3,1,0,0,0,\n" << QByteArray("line 2, column t_s: 'nan'");
    QTest::newRow("node") << kSampleHead + "-2,0,0,0,1,2,3,1,0,0,0,\n"
                          << QByteArray(
                                 "line 2, column node: -2 is no place, it must be 0 or more, or -1 between places");
    QTest::newRow("short row") << kSampleHead + "1,0,0,0,1,2,3,1,0,0,0,\n1,0,0,0,1\n"
                               << QByteArray("line 3: the row has 5 fields, the header has 12 columns");
  }
  void badSamples() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, says);
    const auto reading = badSamplesOf(text.toStdString());
    QVERIFY(!reading);
    FT_VERIFY_MATCH(holdsAll(reading.error().message, {"bad.samples.csv", says}));
  }

  // Wherever a node table is cut, what is read is an error or whole rows as they were.
  void nodeTableCutAtEveryByte() {
    SyntheticOptions options;
    options.counts = {2, 2, 1};
    options.validation_fraction = 0.5;
    options.smooth_distortion_m = 0.01;
    std::ostringstream out;
    const CalibrationTable table = syntheticTable(options, {.seed = 5, .position_sd_m = 1e-3});
    writeNodeTable(out, table);
    const std::string text = out.str();
    std::size_t errors = 0;
    for (std::size_t length = 0; length < text.size(); ++length) {
      const auto reading = badNodesOf(text.substr(0, length));
      errors += reading ? 0 : 1;
      if (!reading) {
        QVERIFY(!reading.error().message.empty());
        continue;
      }
      for (std::size_t i = 0; i < reading->table.nodes.size(); ++i) {
        FT_VERIFY_MATCH(sameBits(reading->table.nodes[i].tracker_from_sensor, table.nodes[i].tracker_from_sensor));
        QVERIFY(reading->table.nodes[i].role == table.nodes[i].role);
      }
    }
    // All but the cuts right before and after the end of each of the four lines.
    QCOMPARE(errors, text.size() - 7);
  }

  void sampleTableCutAtEveryByte() {
    const std::string row = "3,0,0,0.25,1.5,2.5,3.5,1,0,0,0,";
    const std::string text = kSampleHead.toStdString() + row + "\n" + row + "D\n" + row + "\n";
    std::size_t errors = 0;
    for (std::size_t length = 0; length < text.size(); ++length) {
      const auto reading = badSamplesOf(text.substr(0, length));
      errors += reading ? 0 : 1;
      if (!reading) continue;
      for (const SampleRow& seen : reading->table.rows) {
        FT_VERIFY_MATCH(near(seen.sample.tracker_from_sensor.position_m, Eigen::Vector3d(1.5, 2.5, 3.5), 0.0));
        QCOMPARE(seen.sample.time_s, 0.25);
      }
    }
    QCOMPARE(errors, text.size() - 6);
  }
};

FIELDTRUE_TEST(TableErrorsTest)
#include "table_errors_test.moc"
