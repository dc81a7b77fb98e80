#include <QTest>
#include <cmath>

#include "calib/effects/rows.h"
#include "tests/calib/effects/fit_designs.h"
#include "tests/calib/effects/reading_of.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::effects;
using fieldtrue::testing::effectOf;
using fieldtrue::testing::gridDesign;
using fieldtrue::testing::holdsAll;
using fieldtrue::testing::near;
using fieldtrue::testing::OwnedDesign;
using fieldtrue::testing::readingOf;
using fieldtrue::testing::settingAt;
using fieldtrue::testing::wayOf;

namespace {

const Pose kPlace{{1.2, -0.5, 0.3}, Eigen::Quaterniond::Identity()};

/// Relative change of the couplings at a time.
double gainAt(const field::PhysicalEffect& effect, double time_s) {
  const Eigen::Matrix3d G = field::dipoleField(kPlace.position_m, 1.0);
  return effect.at(settingAt(kPlace, {}, time_s)).field_per_m3.cwiseProduct(G).sum() / G.squaredNorm();
}

}  // namespace

class GainDriftTest : public QObject {
  Q_OBJECT
 private slots:
  void followsItsFormula_data();
  void followsItsFormula();
  void movesReadingsAsTheGainDoes();
  void tellsTheDriftOverTheSession();
  void isTriedFromShortToLongWarmUps();
};

void GainDriftTest::followsItsFormula_data() {
  QTest::addColumn<QByteArray>("parameters");
  QTest::addColumn<double>("time_s");
  QTest::addColumn<double>("gain");
  QTest::newRow("constant") << QByteArray(R"({"gain": 0.01})") << 500.0 << 0.01;
  QTest::newRow("at the start") << QByteArray(R"({"amplitude": 0.02, "start_s": 30})") << 30.0 << 0.02;
  QTest::newRow("one time constant") << QByteArray(R"({"amplitude": 0.02, "time_constant_s": 600})") << 600.0
                                     << 0.02 / std::exp(1.0);
  QTest::newRow("half gone") << QByteArray(R"({"amplitude": -0.02, "time_constant_s": 600})") << 600.0 * std::log(2.0)
                             << -0.01;
  QTest::newRow("slope") << QByteArray(R"({"slope_per_s": 1e-5, "start_s": 100})") << 1100.0 << 0.01;
  QTest::newRow("curvature") << QByteArray(R"({"curvature_per_s2": 1e-8})") << 1000.0 << 0.01;
  QTest::newRow("clock of another day") << QByteArray(
                                               R"({"amplitude": 0.02, "time_constant_s": 600, "start_s": 1.7e9})")
                                        << 1.7e9 + 600.0 << 0.02 / std::exp(1.0);
}

void GainDriftTest::followsItsFormula() {
  QFETCH(QByteArray, parameters);
  QFETCH(double, time_s);
  QFETCH(double, gain);
  const auto effect = effectOf("gain_drift", nlohmann::json::parse(parameters.toStdString()));
  FT_VERIFY_MATCH(near(gainAt(*effect, time_s), gain, 1e-12));
}

// p (1 + g(t))^(-1/3): 3 % more signal brings the reading about 1 % nearer.
void GainDriftTest::movesReadingsAsTheGainDoes() {
  const auto effect = effectOf("gain_drift", {{"slope_per_s", 1e-5}});
  const Pose seen = readingOf(*effect, settingAt(kPlace, {}, 3000.0));
  FT_VERIFY_MATCH(near(seen.position_m, Eigen::Vector3d(kPlace.position_m / std::cbrt(1.03)), 1e-10));
}

// A session of 594 s from 20 s on: 3 % over it are 3 %/594 s a second, from nothing at its start.
void GainDriftTest::tellsTheDriftOverTheSession() {
  const OwnedDesign owned = gridDesign({Eigen::Quaterniond::Identity()}, true, false);
  FT_VERIFY_MATCH(near(owned.design.end_s - owned.design.start_s, 594.0, 1e-9));
  const FittedEffect fitted =
      wayOf("gain_drift", owned.design, "linear")->describe({}, Eigen::VectorXd::Constant(1, 0.03));
  const auto effect = effectOf("gain_drift", fitted.parameters);
  FT_VERIFY_MATCH(near(gainAt(*effect, 20.0), 0.0, 1e-12));
  FT_VERIFY_MATCH(near(gainAt(*effect, 614.0), 0.03, 1e-12));
  FT_VERIFY_MATCH(near(fitted.parameters.at("slope_per_s").get<double>(), 0.03 / 594.0, 1e-12));
  QVERIFY(fitted.is_plausible);
  const FittedEffect wild =
      wayOf("gain_drift", owned.design, "linear")->describe({}, Eigen::VectorXd::Constant(1, 0.3));
  FT_VERIFY_MATCH(holdsAll(wild.doubt, {"drift over session of 30 %"}));
}

void GainDriftTest::isTriedFromShortToLongWarmUps() {
  const OwnedDesign owned = gridDesign({Eigen::Quaterniond::Identity()}, true, false);
  const auto starts = wayOf("gain_drift", owned.design, "exponential")->starts();
  QVERIFY(starts.front()[0] < 594.0 / 30.0 && starts.back()[0] > 594.0);
  for (std::size_t i = 1; i < starts.size(); ++i) {
    const double ratio = starts[i][0] / starts[i - 1][0];
    QVERIFY2(ratio > 1.0 && ratio < 2.0, qPrintable(QString::number(ratio)));
  }
}

FIELDTRUE_TEST(GainDriftTest)
#include "gain_drift_test.moc"
