#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "tests/blind/controls.h"
#include "tests/blind/sealed_folder.h"
#include "tests/blind/session_table.h"
#include "tests/support/test_main.h"

using namespace blind;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

constexpr const char* kNodes =
    "# frame: jig\n# jig_tolerance_m: 0.001\n# jig_tolerance_rad: 0.002\n"
    "node,visit,t_start_s,t_end_s,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m,qw,qx,qy,qz,sd_x_m,sd_y_m,sd_z_m,"
    "cov_xy_m2,cov_xz_m2,cov_yz_m2\n"
    "0,0,0,1,0.1,0.2,0.3,0.11,0.21,0.31,0.9,0.1,0.2,0.3,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "1,0,2,3,0.4,0.2,0.3,0.41,0.21,0.31,0.9,0.1,-0.2,0.3,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "2,0,4,5,0.7,0.2,0.3,0.71,0.21,0.31,1,0,0,0,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "2,1,6,7,0.7,0.2,0.3,0.72,0.21,0.31,1,0,0,0,0.1,0.2,0.3,0.01,0.005,0.02\n"
    "3,0,8,9,0.9,0.2,0.3,0.91,0.21,0.31,1,0,0,0,0.1,0.2,0.3,0.01,0.005,0.02\n";

json truthOfTwo() {
  const json gain = {{"id", "coil_gain"}, {"rho", 1.4}};
  const json sessions = {{{"file", "s01"}, {"shelf", "none"}, {"effects", json::array()}},
                         {{"file", "s02"}, {"shelf", "single"}, {"effects", json::array({gain})}}};
  return {{"schema", "fieldtrue.blind/1"}, {"seed", 1}, {"role", "dev"}, {"sessions", sessions}};
}

}  // namespace

class BlindControlsTest : public QObject {
  Q_OBJECT
 private slots:
  void controlsChangeWhatTheySay();
  void placesAreShuffledWhole();
};

void BlindControlsTest::controlsChangeWhatTheySay() {
  const QTemporaryDir holder;
  const fs::path in = holder.path().toStdString();
  const fs::path out = in / "controls";
  sealTruth(in, truthOfTwo());
  for (const char* file : {"s01.nodes.csv", "s02.nodes.csv"}) replaceFile(in / file, kNodes);
  const std::vector<std::string> words = {"--in", in.string(), "--out", out.string(), "--count", "3"};
  QCOMPARE(runControls(words), 0);
  QCOMPARE(runControls(words), 1);
  std::map<std::string, SessionTable> made;
  const json truth = openSealed(out);
  for (const json& session : truth["sessions"])
    made[session["control"]] = readTable(out / (session["file"].get<std::string>() + ".nodes.csv"));
  QCOMPARE(made.size(), std::size_t(5));
  QCOMPARE(made["floor_+20%"].metadata[1], std::string("# jig_tolerance_m: " + exactText(1.2 * 0.001)));
  QCOMPARE(made["floor_-20%"].metadata[2], std::string("# jig_tolerance_rad: " + exactText(0.8 * 0.002)));
  const std::vector<double> scatter = {0.12, 0.24, 0.36, 0.0144, 0.0072, 0.0288};
  for (std::size_t at = 0; at < scatter.size(); ++at)
    QVERIFY(std::abs(numberIn(made["floor_+20%"].rows[0][at + 14]) - scatter[at]) < 1e-12);
  const SessionTable& mirrored = made["mirrored"];
  const std::vector<double> expected = {0.1, 0.2, 0.3, -0.11, 0.21, 0.31, 0.9, 0.1, -0.2, -0.3};
  for (std::size_t at = 0; at < expected.size(); ++at) QCOMPARE(numberIn(mirrored.rows[0][at + 4]), expected[at]);
  const SessionTable& reversed = made["time_reversed"];
  QCOMPARE(reversed.rows[0][0], std::string("3"));
  QCOMPARE(numberIn(reversed.rows[0][2]), 0.0);
  QCOMPARE(numberIn(reversed.rows[4][3]), 9.0);
  QCOMPARE(numberIn(reversed.rows[4][2]), 8.0);
}

void BlindControlsTest::placesAreShuffledWhole() {
  const QTemporaryDir holder;
  const fs::path path = fs::path(holder.path().toStdString()) / "n.csv";
  replaceFile(path, kNodes);
  const SessionTable before = readTable(path);
  SessionTable after = before;
  shufflePlaces(after, 7);
  QVERIFY(after.rows != before.rows);
  QCOMPARE(after.rows[2][4], after.rows[3][4]);
  std::multiset<std::string> places_before;
  std::multiset<std::string> places_after;
  for (const std::size_t row : {0U, 1U, 2U, 4U}) {
    places_before.insert(before.rows[row][4]);
    places_after.insert(after.rows[row][4]);
    for (const std::size_t column : {0U, 7U, 8U, 9U, 10U, 13U})
      QCOMPARE(after.rows[row][column], before.rows[row][column]);
  }
  QCOMPARE(places_after, places_before);
}

FIELDTRUE_TEST(BlindControlsTest)
#include "blind_controls_test.moc"
