#include <QTest>
#include <algorithm>

#include "calib/effects/rows.h"
#include "tests/calib/effects/effect_geometry.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::made;

namespace {

/// Forty places in a plane, one every ten seconds.
std::vector<field::SensorSetting> places() {
  std::vector<field::SensorSetting> settings;
  for (int i = 0; i < 40; ++i) {
    field::SensorSetting setting;
    setting.tracker_from_sensor.position_m = {0.8 + 0.15 * (i % 8), 0.15 * (i / 8), 0.0};
    setting.time_s = 10.0 * i;
    settings.push_back(setting);
  }
  return settings;
}

FitDesign designOf(const std::vector<field::SensorSetting>& settings, bool has_times) {
  FitDesign design;
  design.settings = settings;
  design.pitch_m = 0.15;
  design.has_times = has_times;
  design.end_s = 390.0;
  for (const field::SensorSetting& setting : settings) design.places_m.extend(setting.tracker_from_sensor.position_m);
  return design;
}

}  // namespace

class MetalMovedTest : public QObject {
  Q_OBJECT
 private slots:
  void isThereOnlyThen_data();
  void isThereOnlyThen();
  void isLookedForOnlyWithTimes();
  void looksForChangesThatBothSidesSpeakFor();
};

void MetalMovedTest::isThereOnlyThen_data() {
  QTest::addColumn<QString>("present");
  QTest::addColumn<bool>("is_there_before");
  QTest::newRow("came") << "after" << false;
  QTest::newRow("went") << "before" << true;
}

void MetalMovedTest::isThereOnlyThen() {
  QFETCH(QString, present);
  QFETCH(bool, is_there_before);
  const Eigen::Vector3d p_m(1.2, 0.3, 0.1);
  const auto still = made("compact_metal", nlohmann::json::object());
  const auto moved = made("metal_moved", {{"change_s", 100.0}, {"present", present.toStdString()}});
  const Eigen::Matrix3d whole = still->fieldChange(p_m, 1.0, 0.0);
  const Eigen::Matrix3d before = moved->fieldChange(p_m, 1.0, 99.9);
  const Eigen::Matrix3d after = moved->fieldChange(p_m, 1.0, 100.0);
  const Eigen::Matrix3d& there = is_there_before ? before : after;
  const Eigen::Matrix3d& gone = is_there_before ? after : before;
  QVERIFY((there - whole).norm() < 1e-15 * whole.norm());
  QVERIFY(gone.isZero(0.0));
}

void MetalMovedTest::isLookedForOnlyWithTimes() {
  const std::vector<field::SensorSetting> settings = places();
  const Effect& effect = *findEffect("metal_moved").value();
  QVERIFY(effect.fits(designOf(settings, false)).empty());
  QVERIFY(!effect.fits(designOf(settings, true)).empty());
}

void MetalMovedTest::looksForChangesThatBothSidesSpeakFor() {
  const std::vector<field::SensorSetting> settings = places();
  const auto ways = (*findEffect("metal_moved").value()).fits(designOf(settings, true));
  for (const auto& way : ways) {
    const std::vector<Eigen::VectorXd> starts = way->starts();
    QVERIFY(!starts.empty() && starts.size() <= 300);
    for (Eigen::VectorXd start : starts) {
      QVERIFY(way->allows(start));
      const auto before = std::count_if(settings.begin(), settings.end(),
                                        [&](const field::SensorSetting& setting) { return setting.time_s < start[3]; });
      QVERIFY(before >= 2 && before <= 38);
      start[3] = 5.0;
      QVERIFY(!way->allows(start));
      start[3] = 385.0;
      QVERIFY(!way->allows(start));
    }
  }
}

FIELDTRUE_TEST(MetalMovedTest)
#include "metal_moved_test.moc"
