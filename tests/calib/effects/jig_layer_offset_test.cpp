#include <QTest>

#include "calib/effects/rows.h"
#include "tests/calib/effects/fit_designs.h"
#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::fourTurns;
using fieldtrue::testing::gridDesign;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;
using fieldtrue::testing::OwnedDesign;
using fieldtrue::testing::settingAt;
using fieldtrue::testing::wayOf;

class JigLayerOffsetTest : public QObject {
  Q_OBJECT
 private slots:
  void movesOnlyItsLayers_data();
  void movesOnlyItsLayers();
  void findsTheLayersOfAGrid();
  void takesVisitsOfOnePlaceAsOne();
  void refusesWhatMakesNoSense_data();
  void refusesWhatMakesNoSense();
};

// Layers at -0.3, 0 and 0.2 m: the smallest spacing is 0.2 m, so a place belongs to the nearest within 0.1 m.
void JigLayerOffsetTest::movesOnlyItsLayers_data() {
  QTest::addColumn<double>("height_m");
  QTest::addColumn<double>("offset_m");
  QTest::newRow("in the first") << -0.3 << 0.002;
  QTest::newRow("near the second") << 0.09 << -0.001;
  QTest::newRow("near the third") << 0.11 << 0.004;
  QTest::newRow("between the first and the second") << -0.15 << 0.0;
  QTest::newRow("above all") << 0.31 << 0.0;
}

void JigLayerOffsetTest::movesOnlyItsLayers() {
  QFETCH(double, height_m);
  QFETCH(double, offset_m);
  // The rig's x axis points along the tracker's z.
  const Pose rig{{1.0, 0.5, 0.0}, rotationFromVector({0.0, -1.5707963267948966, 0.0})};
  const Pose place = rig * Pose{{height_m, 0.4, 0.7}, Eigen::Quaterniond::Identity()};
  const auto effect = effectOf("jig_layer_offset",
                               {{"axis", "x"}, {"heights_m", {-0.3, 0.2, 0.0}}, {"offsets_m", {0.002, 0.004, -0.001}}});
  FT_VERIFY_MATCH(near(effect->at(settingAt(place, rig)).shift_m, Eigen::Vector3d(0.0, 0.0, offset_m), 1e-15));
}

// 5 x 5 x 4 places 0.3 m apart about the rig's origin.
void JigLayerOffsetTest::findsTheLayersOfAGrid() {
  const OwnedDesign owned = gridDesign({Eigen::Quaterniond::Identity()}, false, false);
  QCOMPARE(findEffect("jig_layer_offset").value()->fits(owned.design).size(), std::size_t{3});
  QCOMPARE(wayOf("jig_layer_offset", owned.design, "x")->linear().size(), std::size_t{5});
  const auto way = wayOf("jig_layer_offset", owned.design, "z");
  QCOMPARE(way->linear().size(), std::size_t{4});
  const FittedEffect fitted = way->describe({}, Eigen::Vector4d(0.0, 0.002, 0.0, -0.05));
  const auto heights_m = fitted.parameters.at("heights_m").get<std::vector<double>>();
  const std::vector<double> expected_m{-0.45, -0.15, 0.15, 0.45};
  for (std::size_t i = 0; i < 4; ++i) FT_VERIFY_MATCH(near(heights_m.at(i), expected_m[i], 1e-9));
  QVERIFY(!fitted.is_plausible);
  FT_VERIFY_MATCH(holdsAll(fitted.doubt, {"layer 4 of -50 mm"}));
}

void JigLayerOffsetTest::takesVisitsOfOnePlaceAsOne() {
  OwnedDesign owned = gridDesign(fourTurns(), true, false);
  std::vector<field::SensorSetting> columns;
  for (const field::SensorSetting& setting : owned.settings) {
    const bool is_on_a_pole = (*setting.index)[0] == 2 && (*setting.index)[1] < 2;
    if (is_on_a_pole) columns.push_back(setting);
  }
  owned.design.settings = columns;
  // Four visits each, but two places in every layer: too few to tell a layer by.
  QCOMPARE(columns.size(), std::size_t{4 * 8});
  QVERIFY(findEffect("jig_layer_offset").value()->fits(owned.design).empty());
}

void JigLayerOffsetTest::refusesWhatMakesNoSense_data() {
  QTest::addColumn<QByteArray>("heights");
  QTest::addColumn<QByteArray>("offsets");
  QTest::addColumn<QByteArray>("fragment");
  QTest::newRow("another count") << QByteArray("[0, 1]") << QByteArray("[0.01]") << QByteArray("2 numbers");
  QTest::newRow("one layer") << QByteArray("[0]") << QByteArray("[0.01]") << QByteArray("at least two");
  QTest::newRow("twice") << QByteArray("[0, 1, 0]") << QByteArray("[0, 0, 0.1]") << QByteArray("same height twice");
}

void JigLayerOffsetTest::refusesWhatMakesNoSense() {
  QFETCH(QByteArray, heights);
  QFETCH(QByteArray, offsets);
  QFETCH(QByteArray, fragment);
  const auto made = makeEffect("jig_layer_offset", {{"heights_m", nlohmann::json::parse(heights.toStdString())},
                                                    {"offsets_m", nlohmann::json::parse(offsets.toStdString())}});
  QVERIFY(!made && made.error().code == ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(made.error().message, {"jig_layer_offset", fragment}));
}

FIELDTRUE_TEST(JigLayerOffsetTest)
#include "jig_layer_offset_test.moc"
