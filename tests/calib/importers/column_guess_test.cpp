#include "calib/importers/column_guess.h"

#include <QTemporaryDir>
#include <QTest>
#include <fstream>

#include "calib/importers/registry.h"
#include "calib/importers/text_table.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

/// Headers as other programs write them, and what a person would say that the columns are.
class ColumnGuessTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() { QVERIFY(folder_.isValid()); }

  void namesOfColumns_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("expected");  // key=value, blank-separated by |
    const auto row = [](const char* name, const char* text, const char* expected) {
      QTest::newRow(name) << QByteArray(text) << QByteArray(expected);
    };
    row("units in brackets", "Point,X [cm],Y [cm],Z [cm],Xref [mm],Yref [mm],Zref [mm]\n1,1,2,3,10,20,30\n",
        "node=Point|x=X [cm]|z=Z [cm]|x_true=Xref [mm]|z_true=Zref [mm]|unit=cm|unit_true=mm|separator=comma");
    row("capitals and camels", "time;PosX;PosY;PosZ;QuatW;QuatX;QuatY;QuatZ\n0;1;2;3;1;0;0;0\n9;400;2;3;1;0;0;0\n",
        "time=time|x=PosX|y=PosY|qw=QuatW|qz=QuatZ|x_true=|unit=mm|separator=semicolon");
    row("angles", "x_m y_m z_m azimuth elevation roll\n1 2 3 40 5 6\n",
        "x=x_m|azimuth=azimuth|elevation=elevation|roll=roll|angle_unit=deg|qw=|unit=m|separator=space");
    row("radians by their names", "x_m,y_m,z_m,yaw [rad],pitch [rad],roll [rad]\n1,2,3,1,0,0\n",
        "azimuth=yaw [rad]|roll=roll [rad]|angle_unit=rad");
    row("degrees or radians", "x_m,y_m,z_m,yaw,pitch,roll\n1,2,3,1.5,0,0\n", "azimuth=|elevation=|roll=");
    row("expected and actual", "x_expected,y_expected,z_expected,x_actual,y_actual,z_actual\n1,2,3,4,5,6\n",
        "x=x_actual|x_true=x_expected");
    row("a reference sensor is no truth",
        "x_measured,y_measured,z_measured,x_reference_sensor,y_reference_sensor,z_reference_sensor\n1,2,3,4,5,6\n",
        "x=x_measured|x_true=");
    row("set and actual in German",
        "Soll X [mm],Soll Y [mm],Soll Z [mm],Ist X [mm],Ist Y [mm],Ist Z [mm]\n1,2,3,4,5,6\n",
        "x=Ist X [mm]|x_true=Soll X [mm]");
    row("two of which neither says", "X wahrscheinlich,Y wahrscheinlich,Z wahrscheinlich,X,Y,Z\n1,2,3,4,5,6\n",
        "x=|x_true=");
    row("axes in different units", "x_em_mm,y_em_mm,z_em_cm\n1,2,3\n", "x=|y=|z=");
    row("nanoseconds are no seconds", "t_ns,x_m,y_m,z_m\n1600000000000000000,1,2,3\n", "time=|x=x_m");
    row("a date is no time of a session", "time,x_m,y_m,z_m\n1600000000,1,2,3\n", "time=|x=x_m");
    row("yaw, pitch, roll", "px\tpy\tpz\tyaw\tpitch\troll\n0\t0\t0\t0\t0\t0\n1\t1\t1\t90\t0\t0\n",
        "x=px|azimuth=yaw|elevation=pitch|roll=roll|unit=m|separator=tab");
    row("q0 to q3", "x,y,z,q0,q1,q2,q3\n100,0,0,1,0,0,0\n900,0,0,1,0,0,0\n", "qw=q0|qx=q1|qz=q3|unit=mm");
    row("spread is no position", "x_mm,y_mm,z_mm,sd_x_mm,sd_y_mm,sd_z_mm\n1,2,3,4,5,6\n", "x=x_mm|x_true=|unit=mm");
    row("another thing's orientation", "tip_x,tip_y,tip_z,stylus_qw,stylus_qx,stylus_qy,stylus_qz\n1,2,3,1,0,0,0\n",
        "x=tip_x|qw=");
    row("status in every row is none", "x,y,z,status\n1,2,3,0\n1,2,3,0\n", "status=");
    row("status where it is set", "x,y,z,status\n1,2,3,\n1,2,3,low\n", "status=status");
    row("no names", "0.1 0.2 0.3\n1.1 0.2 0.3\n", "header=false|x=column1|z=column3|unit=m|separator=space");
    row("no names, a number of the station first", "1 0.1 0.2 0.3\n1 1.1 0.2 0.3\n", "header=false|x=|separator=space");
    row("decimal commas", "x;y;z\n0,5;1,5;2,5\n1,5;1,5;2,5\n", "decimal=comma|x=x|unit=m");
  }
  void namesOfColumns() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, expected);
    const auto guess = guessColumns(write(text));
    FT_VERIFY_OK(guess);
    for (const QByteArray& pair : expected.split('|')) {
      const qsizetype equals = pair.indexOf('=');
      const std::string key = pair.left(equals).toStdString();
      const std::string told = textOf(guess->settings.at(key));
      QVERIFY2(told == pair.mid(equals + 1).toStdString(),
               qPrintable(QStringLiteral("%1 is %2").arg(QString::fromStdString(key), QString::fromStdString(told))));
    }
  }

  void aUnitIsNotInvented() {
    // 60 of something: inches or centimetres, both are rooms.
    const auto guess = guessColumns(write("x,y,z\n0,0,0\n60,0,0\n"));
    FT_VERIFY_OK(guess);
    QVERIFY(!guess->has_unit);
    FT_VERIFY_MATCH(holdsAll(guess->reasons.back(), {"span", "in", "cm", "choose"}));
    QVERIFY(guessColumns(write("x,y,z\n0,0,0\n600,0,0\n"))->has_unit);
    // A bench in millimetres or a room in inches.
    QVERIFY(!guessColumns(write("x,y,z\n0,0,0\n150,0,0\n"))->has_unit);
  }

  void namesInACommentAreShown() {
    const auto guess = guessColumns(write("# true_x true_y true_z x y z\n1 2 3 4 5 6\n"));
    FT_VERIFY_OK(guess);
    QVERIFY(choiceSetting(guess->settings, "x").empty());
    QVERIFY(std::any_of(guess->reasons.begin(), guess->reasons.end(),
                        [](const std::string& reason) { return reason.find("true_x true_y") != std::string::npos; }));
  }

  void columnsWithoutANameAreNumbered() {
    const auto guess = guessColumns(write(",x_m,y_m,z_m,\n0,1,2,3,\n1,4,5,6,\n"));
    FT_VERIFY_OK(guess);
    QCOMPARE(choiceSetting(guess->settings, "x"), std::string("x_m"));
    QCOMPARE(guess->reasons.back(), std::string("not used: column1, column5"));
  }

  void whatIsNotUsedIsSaid() {
    const auto guess = guessColumns(write("x_m,y_m,z_m,quality,gain\n1,2,3,4,5\n"));
    FT_VERIFY_OK(guess);
    QCOMPARE(guess->reasons.back(), std::string("not used: quality, gain"));
  }

  void rowsThatAreLeftOutAreCounted() {
    const Importer& columns = *findImporter("columns").value();
    const auto settings =
        resolveSettings("columns", columns.settings,
                        {{"node", "n"}, {"status", "s"}, {"x_true", "a"}, {"y_true", "b"}, {"z_true", "c"}});
    FT_VERIFY_OK(settings);
    const auto import = columns.read(
        write("n,s,x,y,z,a,b,c\n0,,1,2,3,1,2,3\n1,bad,1,2,3,1,2,3\n-1,,1,2,3,1,2,3\n2,,-3.7e28,2,3,1,2,3\n"), {},
        *settings);
    FT_VERIFY_OK(import);
    QCOMPARE(import->table->nodes.size(), std::size_t{1});
    FT_VERIFY_MATCH(holdsAll(import->notes.at(0), {"3 of 4 rows are left out"}));
  }

  void anOrientationThatIsMissingIsNotMadeUp() {
    const Importer& columns = *findImporter("columns").value();
    const auto settings = resolveSettings(
        "columns", columns.settings,
        {{"qw", "qw"}, {"qx", "qx"}, {"qy", "qy"}, {"qz", "qz"}, {"x_true", "a"}, {"y_true", "b"}, {"z_true", "c"}});
    FT_VERIFY_OK(settings);
    const auto import =
        columns.read(write("x,y,z,qw,qx,qy,qz,a,b,c\n1,2,3,0,1,0,0,1,2,3\n1,2,3,,,,,1,2,3\n"), {}, *settings);
    FT_VERIFY_OK(import);
    QVERIFY(import->table->nodes.at(0).has_orientation && !import->table->nodes.at(1).has_orientation);
    FT_VERIFY_MATCH(holdsAll(import->notes.at(0), {"1 rows have no orientation"}));
  }

  void aTruthFileIsMatchedByItsNumbers() {
    const Importer& columns = *findImporter("columns").value();
    const std::filesystem::path truth = folder_.filePath("truth.csv").toStdString();
    for (const char* name : {"label", "node", "id", "name", "point", "place"}) {
      std::ofstream(truth) << name << ",x_true_m,y_true_m,z_true_m\n7,4,5,6.5\n5,1,2,3.5\n";
      const auto settings = resolveSettings("columns", columns.settings, {{"node", "node"}, {"unit", "m"}});
      const auto import = columns.read(write("node,x,y,z\n5,1,2,3\n7,4,5,6\n"), truth, *settings);
      FT_VERIFY_OK(import);
      QCOMPARE(import->table->nodes.at(0).node, 5);
      QCOMPARE(import->table->nodes.at(0).reference_from_sensor.position_m.z(), 3.5);
    }
  }

  void twoPositionsWithoutAWordForTheTruth() {
    const auto guess = guessColumns(write("x1,y1,z1,x2,y2,z2\n1,2,3,4,5,6\n"));
    FT_VERIFY_OK(guess);
    QVERIFY(choiceSetting(guess->settings, "x_true").empty());
  }

  void samplesOfAPlaceAreAveraged() {
    std::string text = "node,x_m,y_m,z_m,x_true_m,y_true_m,z_true_m\n";
    for (int node = 0; node < 3; ++node)
      for (int sample = 0; sample < 10; ++sample)
        text += std::to_string(node) + "," + std::to_string(node) + "." + std::to_string(sample) + ",0,0,1,1,1\n";
    const auto guess = guessColumns(write(QByteArray::fromStdString(text)));
    FT_VERIFY_OK(guess);
    QVERIFY(boolSetting(guess->settings, "average"));
    const Importer& columns = *findImporter("columns").value();
    const auto import = columns.read(folder_.filePath("t.txt").toStdString(), {}, guess->settings);
    FT_VERIFY_OK(import);
    QCOMPARE(import->table->nodes.size(), std::size_t{3});
    FT_VERIFY_MATCH(near(import->table->nodes[2].tracker_from_sensor.position_m.x(), 2.45, 1e-12));
  }

  void whatIsNoTableIsRefused() {
    QVERIFY(!guessColumns(write("Dear all,\nthe tracker is in room 2.\n")));
    QVERIFY(!guessColumns(write("")));
    QVERIFY(!guessColumns(folder_.filePath("absent.txt").toStdString()));
  }

  /// The command that is proposed reads what the guess reads.
  void formatTextHoldsTheSettings() {
    const auto guess = guessColumns(write("a;X [mm];Y [mm];Z [mm]\n1;1,5;2,5;3,5\n"));
    FT_VERIFY_OK(guess);
    const auto parsed = parseMethodText(formatText(guess->settings));
    FT_VERIFY_OK(parsed);
    const Importer& columns = *findImporter(parsed->id).value();
    const auto settings = resolveSettings(columns.id, columns.settings, parsed->given);
    FT_VERIFY_OK(settings);
    QVERIFY(*settings == guess->settings);
  }

  void anglesAndUnitsAreRead() {
    // 90 degrees of azimuth turn x to y: R = Rz(az) Ry(el) Rx(roll).
    const Importer& columns = *findImporter("columns").value();
    const auto path = write("x,y,z,az,el,ro,tx,ty,tz\n1,0,0,90,0,0,1,2,3\n");
    const auto settings = resolveSettings("columns", columns.settings,
                                          {{"azimuth", "az"},
                                           {"elevation", "el"},
                                           {"roll", "ro"},
                                           {"x_true", "tx"},
                                           {"y_true", "ty"},
                                           {"z_true", "tz"},
                                           {"unit", "ft"},
                                           {"unit_true", "in"}});
    FT_VERIFY_OK(settings);
    const auto import = columns.read(path, {}, *settings);
    FT_VERIFY_OK(import);
    const Node& node = import->table->nodes.at(0);
    QVERIFY(node.has_orientation);
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m.x(), 0.3048, 1e-15));
    FT_VERIFY_MATCH(near(node.reference_from_sensor.position_m.z(), 3 * 0.0254, 1e-15));
    const double half = std::sqrt(0.5);
    FT_VERIFY_MATCH(near(node.tracker_from_sensor.orientation, Eigen::Quaterniond(half, 0, 0, half), 1e-12));
  }

 private:
  std::filesystem::path write(const QByteArray& text) {
    const std::filesystem::path path = folder_.filePath("t.txt").toStdString();
    std::ofstream(path, std::ios::binary) << text.toStdString();
    return path;
  }
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(ColumnGuessTest)
#include "column_guess_test.moc"
