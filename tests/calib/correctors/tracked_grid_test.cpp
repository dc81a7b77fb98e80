#include "calib/correctors/cells/tracked_grid.h"

#include <QTest>

#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

class TrackedGridTest : public QObject {
  Q_OBJECT
 private slots:
  void trueSpaceGridsAreRefusedWithTheResamplingThatHelps_data() {
    QTest::addColumn<QString>("id");
    QTest::newRow("trilinear") << "trilinear";
    QTest::newRow("local_briggs") << "local_briggs";
  }
  void trueSpaceGridsAreRefusedWithTheResamplingThatHelps() {
    QFETCH(QString, id);
    // Places within 2 % of the pitch of their level pass: 3 mm of 0.2 m, where 6 mm do not.
    FT_VERIFY_OK(fitPosition(id.toStdString(), fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.003), linear_m)));
    const auto shaken = fitPosition(id.toStdString(), fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.006), linear_m));
    QVERIFY(!shaken && shaken.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(shaken.error().message, {"tracked space", "2 %", "resample=briggs", "hexahedral_shape"}));
    const auto scattered = fitPosition(id.toStdString(), fitDataOf(randomPoints(200), linear_m));
    QVERIFY(!scattered && scattered.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(scattered.error().message, {"tracked space", "resample=briggs"}));
  }

  void aTrackedGridNeedsNoIndexInTheTable() {
    // The truth of a grid in tracked space is crooked and shows no index: the tracked positions do.
    FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.0), linear_m);
    data.index.clear();
    FT_VERIFY_MATCH(
        near(fitted("trilinear", data)->displacement_m({0.66, 0.07, 0.11}), linear_m({0.66, 0.07, 0.11}), 1e-12));
  }

  void resamplingMakesTrueSpaceAndScatteredDataUsable_data() {
    QTest::addColumn<QString>("id");
    QTest::addColumn<QString>("resample");
    for (const char* id : {"trilinear", "local_briggs"})
      for (const char* resample : {"briggs", "livingston", "czernuszenko"})
        QTest::addRow("%s, %s", id, resample) << id << resample;
  }
  void resamplingMakesTrueSpaceAndScatteredDataUsable() {
    QFETCH(QString, id);
    QFETCH(QString, resample);
    const Eigen::Vector3d shift_m(0.02, -0.01, 0.03);
    const auto constant_m = [&](const Eigen::Vector3d&) { return shift_m; };
    FitData turned = turnedGrid(M_PI / 2.0, {5, 4, 4});
    for (std::size_t i = 0; i < turned.size(); ++i) turned.p_true_m[i] = turned.p_tracked_m[i] + shift_m;
    FitData scattered = fitDataOf(randomPoints(300), constant_m);
    scattered.index.clear();
    for (const FitData& data : {fitDataOf(shakenGrid({5, 4, 4}, 0.2, 0.03), constant_m), turned, scattered}) {
      const auto model = fitted(id.toStdString(), data, {{"resample", resample.toStdString()}});
      FT_VERIFY_MATCH(holdsAll(model->note(), {"resampled to a grid", resample.toUtf8()}));
      Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
      for (const Eigen::Vector3d& p_m : data.p_tracked_m) middle_m += p_m / static_cast<double>(data.size());
      QVERIFY(model->covers(middle_m));
      // Every way of resampling leaves a constant as it is.
      FT_VERIFY_MATCH(near(model->displacement_m(middle_m), shift_m, 1e-12));
    }
    FT_VERIFY_MATCH(
        holdsAll(fitted(id.toStdString(), turned, {{"resample", resample.toStdString()}})->note(), {"4 x 5 x 4"}));
  }

  void aBentGridIsCoveredInTheMiddle() {
    // The lowest level is bowed by half a pitch: nodes under the bow have no support, those over its middle do.
    std::vector<Eigen::Vector3d> points_m = shakenGrid({7, 7, 5}, 0.2, 0.0);
    const FitData straight = fitDataOf(points_m, linear_m);
    for (Eigen::Vector3d& p_m : points_m)
      p_m.z() += 0.1 * (std::pow((p_m.x() - 1.0) / 0.6, 2) + std::pow((p_m.y() - 0.3) / 0.6, 2)) *
                 std::max(0.0, 0.2 - p_m.z()) / 0.4;
    FitData data = fitDataOf(points_m, linear_m);
    data.index = straight.index;
    const auto model = fitted("trilinear", data, {{"resample", "briggs"}});
    FT_VERIFY_MATCH(holdsAll(model->note(), {"7 x 7 x 5"}));
    int n_covered = 0;
    for (std::size_t i = 0; i < data.size(); ++i) {
      if (!model->covers(data.p_tracked_m[i])) continue;
      ++n_covered;
      // Briggs's inverse squares reproduce no slope: between places 0.2 m apart in this field they are off by 6 mm.
      FT_VERIFY_MATCH(near(model->displacement_m(data.p_tracked_m[i]), linear_m(data.p_tracked_m[i]), 0.006));
    }
    QVERIFY2(n_covered > static_cast<int>(data.size()) * 6 / 10, QByteArray::number(n_covered));
  }

  void aGridOfTrackedSpaceKeepsItsValues() {
    // Nodes that coincide with places take their vectors: resampling a tracked grid by briggs changes nothing.
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.0), bending_m);
    const auto own = fitted("trilinear", data);
    const auto resampled = fitted("trilinear", data, {{"resample", "briggs"}});
    for (const Eigen::Vector3d& p_m : randomPoints(300))
      FT_VERIFY_MATCH(near(resampled->displacement_m(p_m), own->displacement_m(p_m), 1e-6));
  }

  void livingstonsKernelHasTheWidthAsked() {
    // A wider kernel smooths a bending field more.
    const FitData data = fitDataOf(shakenGrid({5, 5, 5}, 0.2, 0.02), bending_m);
    const Eigen::Vector3d middle_m(0.8, 0.1, 0.2);
    const auto off_m = [&](const char* width) {
      const auto model = fitted("trilinear", data, {{"resample", "livingston"}, {"width_pitches", width}});
      return (model->displacement_m(middle_m) - bending_m(middle_m)).norm();
    };
    QVERIFY(off_m("0.3") < off_m("1"));
    QVERIFY(off_m("1") < off_m("3"));
  }
};

FIELDTRUE_TEST(TrackedGridTest)
#include "tracked_grid_test.moc"
