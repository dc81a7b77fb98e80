#include "calib/effects/room_search.h"

#include <Eigen/Cholesky>
#include <QTest>
#include <algorithm>

#include "calib/effects/parameters.h"
#include "calib/effects/registry.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

namespace {

/// A grid of 5 by 5 by 4 places beside the transmitter, the rig turned a little against it.
std::vector<field::SensorSetting> gridPlaces() {
  std::vector<field::SensorSetting> settings;
  Pose tracker_from_rig{Eigen::Vector3d::Zero(), rotationFromVector(Eigen::Vector3d(0.1, -0.05, 0.2))};
  for (int i = 0; i < 100; ++i) {
    field::SensorSetting setting;
    const int row = i / 5 % 5, layer = i / 25;
    const Eigen::Vector3d in_rig_m(0.6 + 0.25 * (i % 5), -0.5 + 0.25 * row, -0.3 + 0.25 * layer);
    setting.tracker_from_reference = tracker_from_rig;
    setting.tracker_from_sensor = tracker_from_rig * Pose{in_rig_m, Eigen::Quaterniond::Identity()};
    setting.time_s = 10.0 * i;
    settings.push_back(setting);
  }
  return settings;
}

FitDesign designOf(const std::vector<field::SensorSetting>& settings) {
  FitDesign design;
  design.settings = settings;
  design.pitch_m = 0.25;
  design.has_times = true;
  design.end_s = 990.0;
  for (const field::SensorSetting& setting : settings) design.places_m.extend(setting.tracker_from_sensor.position_m);
  return design;
}

/// Field changes of one or more linear parameters as columns, weighted as a tracker's errors are: by r^4.
Eigen::MatrixXd columnsOf(const std::vector<field::SensorSetting>& settings,
                          std::span<const field::EffectResponse> responses, Eigen::Index count) {
  Eigen::MatrixXd columns(9 * static_cast<Eigen::Index>(settings.size()), count);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const double r4 = std::pow(settings[i].tracker_from_sensor.position_m.norm(), 4);
    for (Eigen::Index k = 0; k < count; ++k) {
      const field::EffectResponse& response =
          responses[i * static_cast<std::size_t>(count) + static_cast<std::size_t>(k)];
      columns.block<9, 1>(9 * static_cast<Eigen::Index>(i), k) = r4 * response.field_per_m3.reshaped();
    }
  }
  return columns;
}

/// Largest share of an effect's energy that any start of a way explains.
double bestShare(const EffectFit& way, const std::vector<field::SensorSetting>& settings,
                 const Eigen::VectorXd& truth) {
  const auto count = static_cast<Eigen::Index>(way.linear().size());
  std::vector<field::EffectResponse> responses(settings.size() * static_cast<std::size_t>(count));
  double best = 0.0;
  for (const Eigen::VectorXd& start : way.starts()) {
    way.respond(settings, start, responses);
    const Eigen::MatrixXd columns = columnsOf(settings, responses, count);
    const Eigen::VectorXd projected = columns.transpose() * truth;
    const Eigen::VectorXd solved = (columns.transpose() * columns).ldlt().solve(projected);
    best = std::max(best, projected.dot(solved) / truth.squaredNorm());
  }
  return best;
}

Eigen::VectorXd truthOf(const std::string& id, const nlohmann::json& parameters,
                        const std::vector<field::SensorSetting>& settings) {
  const auto effect = makeEffect(id, parameters);
  std::vector<field::EffectResponse> responses;
  for (const field::SensorSetting& setting : settings) responses.push_back(effect.value()->at(setting));
  return columnsOf(settings, responses, 1).col(0);
}

}  // namespace

class RoomSearchTest : public QObject {
  Q_OBJECT
 private slots:
  void startsStandClear_data();
  void startsStandClear();
  void someStartIsNearEveryBody();
  void someStartIsNearEveryFloorAndWall();
  void chartReachesEveryDirection();
  void chartIsSmoothAtTheAxes();
};

void RoomSearchTest::startsStandClear_data() {
  QTest::addColumn<QString>("id");
  for (const char* id : {"compact_metal", "metal_moved", "closed_loop", "finite_plate"}) QTest::newRow(id) << id;
}

void RoomSearchTest::startsStandClear() {
  QFETCH(QString, id);
  const std::vector<field::SensorSetting> settings = gridPlaces();
  for (const auto& way : (*findEffect(id.toStdString()).value()).fits(designOf(settings))) {
    const std::vector<Eigen::VectorXd> starts = way->starts();
    QVERIFY(starts.size() >= 60 && starts.size() <= 350);
    for (Eigen::VectorXd start : starts) {
      QVERIFY(way->allows(start));
      const Eigen::Vector3d center_m = start.head<3>();
      QVERIFY(center_m.norm() >= 0.15);
      for (const field::SensorSetting& setting : settings) {
        QVERIFY((setting.tracker_from_sensor.position_m - center_m).norm() >= 0.125);
      }
      start.head<3>() = settings[37].tracker_from_sensor.position_m;
      QVERIFY(!way->allows(start));
      start.head<3>().setConstant(0.01);
      QVERIFY(!way->allows(start));
    }
  }
}

// Bodies 0.35 m to 0.9 m from the nearest place, anywhere about the grid: from the best start on the larger part of
// what they do is explained, so that a descent from there ends at them.
void RoomSearchTest::someStartIsNearEveryBody() {
  const std::vector<field::SensorSetting> settings = gridPlaces();
  const FitDesign design = designOf(settings);
  const RoomSearch search(design);
  const auto ways = (*findEffect("compact_metal").value()).fits(design);
  RandomGeometry random(1);
  std::vector<double> shares;
  while (shares.size() < 40) {
    const Eigen::Vector3d center_m = search.box_m().center() + random.pointInCube_m(1.5);
    const double nearest_m = search.nearestPlace_m(center_m);
    if (nearest_m < 0.35 || nearest_m > 0.9 || center_m.norm() < 0.35) continue;
    const Eigen::VectorXd truth = truthOf("compact_metal", {{"center_m", effects::listOf(center_m)}}, settings);
    shares.push_back(bestShare(*ways[0], settings, truth));
  }
  std::sort(shares.begin(), shares.end());
  QVERIFY2(shares[0] > 0.5, qPrintable(QString::number(shares[0])));
  QVERIFY2(shares[20] > 0.8, qPrintable(QString::number(shares[20])));
}

void RoomSearchTest::someStartIsNearEveryFloorAndWall() {
  const std::vector<field::SensorSetting> settings = gridPlaces();
  const FitDesign design = designOf(settings);
  const RoomSearch search(design);
  const auto ways = (*findEffect("metal_plane").value()).fits(design);
  RandomGeometry random(2);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d toward = random.direction();
    const double distance_m = search.farthestAlong_m(toward) + random.between(0.15, 2.0);
    const Eigen::VectorXd truth =
        truthOf("metal_plane", {{"toward", effects::listOf(toward)}, {"distance_m", distance_m}}, settings);
    const double share = bestShare(*ways[0], settings, truth);
    QVERIFY2(share > 0.7, qPrintable(QString::number(share)));
  }
}

void RoomSearchTest::chartReachesEveryDirection() {
  RandomGeometry random(3);
  const DirectionChart chart;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d direction = random.direction();
    const Eigen::Vector2d angles_rad = chart.angles_rad(direction);
    FT_VERIFY_MATCH(near(chart.direction(angles_rad[0], angles_rad[1]), direction, 1e-12));
  }
}

// A step of an angle turns the direction by at least half of it at the axes and diagonals of the tracker.
void RoomSearchTest::chartIsSmoothAtTheAxes() {
  const DirectionChart chart;
  for (const Eigen::Vector3d& along : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1),
                                       Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, 1)}) {
    const Eigen::Vector3d direction = along.normalized();
    const Eigen::Vector2d angles_rad = chart.angles_rad(direction);
    const double moved = (chart.direction(angles_rad[0], angles_rad[1] + 1e-3) - direction).norm();
    QVERIFY2(moved > 0.5e-3, qPrintable(QString::number(moved)));
  }
}

FIELDTRUE_TEST(RoomSearchTest)
#include "room_search_test.moc"
