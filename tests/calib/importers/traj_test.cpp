#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <fstream>

#include "calib/importers/rows.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::importers;
using namespace fieldtrue::testing;

namespace {

Result<Import> importTraj(const std::filesystem::path& path, const std::map<std::string, std::string>& given = {}) {
  const Importer importer = trajImporter();
  const auto settings = resolveSettings(importer.id, importer.settings, given);
  if (!settings) return tl::unexpected(settings.error());
  return importer.read(path, std::nullopt, *settings);
}

/// A quarter turn about z at (1, 2, 3), then the identity at (-0.5, 0, 0.25).
const QByteArray kTwo = " 0 -1 0 1\n 1  0 0 2\n0 0 1 3\n0 0 0 1\n\n1 0 0 -0.5\n0 1 0 0\n0 0 1 2.5e-1\n0 0 0 1\n";

}  // namespace

class TrajTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    path_ = std::filesystem::path(folder_.path().toStdString()) / "hand.traj";
  }

  void readsMatrices() {
    write(kTwo);
    const auto import = importTraj(path_, {{"rate_hz", "40"}});
    FT_VERIFY_OK(import);
    QVERIFY(!import->table && import->samples);
    const std::vector<SampleRow>& rows = import->samples->rows;
    QCOMPARE(rows.size(), std::size_t{2});
    const Pose quarter{{1, 2, 3}, Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5))};
    FT_VERIFY_MATCH(near(rows[0].sample.tracker_from_sensor, quarter, 1e-15, 1e-15));
    FT_VERIFY_MATCH(near(rows[1].sample.tracker_from_sensor, Pose{{-0.5, 0, 0.25}, {1, 0, 0, 0}}, 1e-15, 1e-15));
    QVERIFY(rows[0].node == -1 && rows[0].sample.time_s == 0.0 && rows[1].sample.time_s == 0.025);
    QCOMPARE(*import->samples->metadata.rate_hz, 40.0);
    FT_VERIFY_MATCH(holdsAll(import->notes[0], {"no times", "rate_hz"}));
  }

  void refuses_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("cut off") << kTwo.left(kTwo.size() - 9)
                             << QByteArray("the file ends after 3 of the 4 rows of a matrix");
    QTest::newRow("cut in a number") << kTwo.left(kTwo.size() - 5)
                                     << QByteArray("line 9: a row of a matrix needs 4 finite numbers");
    QTest::newRow("three rows") << QByteArray("1 0 0 0\n0 1 0 0\n0 0 1 0\n\n") + kTwo
                                << QByteArray("line 4: a matrix has 3 rows, it needs 4");
    QTest::newRow("five numbers") << QByteArray("1 0 0 0 0\n")
                                  << QByteArray("line 1: a row of a matrix needs 4 finite numbers, got '1 0 0 0 0'");
    QTest::newRow("NaN") << QByteArray("1 0 0 nan\n") << QByteArray("line 1");
    QTest::newRow("scaled") << QByteArray("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n")
                            << QByteArray("line 4: the matrix is no pose: its upper left part is not a rotation");
    QTest::newRow("mirrored") << QByteArray("-1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n") << QByteArray("not a rotation");
    QTest::newRow("last row") << QByteArray("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n")
                              << QByteArray("the last row is not 0 0 0 1");
    QTest::newRow("blank lines only") << QByteArray("\n\n\n") << QByteArray("holds no matrix");
  }
  void refuses() {
    QFETCH(QByteArray, text);
    QFETCH(QByteArray, says);
    write(text);
    const auto import = importTraj(path_);
    QVERIFY(!import && import.error().code == ErrorCode::kBadInput);
    FT_VERIFY_MATCH(holdsAll(import.error().message, {"hand.traj", says}));
  }

  void realTrajectory() {
    FT_REQUIRE_REAL_DATA();
    const std::filesystem::path path = *realData("polhemus_hand/user1_cup0.traj");
    const auto import = importTraj(path);
    FT_VERIFY_OK(import);
    std::ifstream in(path);
    std::size_t last_rows = 0;
    for (std::string line; std::getline(in, line);) {
      last_rows += QByteArray::fromStdString(line).simplified() == "0 0 0 1";
    }
    QVERIFY(last_rows > 100);
    QCOMPARE(import->samples->rows.size(), last_rows);
    const Pose& first = import->samples->rows.front().sample.tracker_from_sensor;
    FT_VERIFY_MATCH(near(first.position_m, Eigen::Vector3d(1.20716, 0.836179, 2.214), 1e-12));
    FT_VERIFY_MATCH(near(Eigen::Vector3d(first.orientation * Eigen::Vector3d::UnitX()),
                         Eigen::Vector3d(-0.445518, -0.573454, 0.687506), 1e-5));
    FT_VERIFY_MATCH(near(import->samples->rows.back().sample.time_s, static_cast<double>(last_rows - 1) / 100.0, 1e-9));
  }

 private:
  void write(const QByteArray& text) const { std::ofstream(path_) << text.toStdString(); }
  QTemporaryDir folder_;
  std::filesystem::path path_;
};

FIELDTRUE_TEST(TrajTest)
#include "traj_test.moc"
