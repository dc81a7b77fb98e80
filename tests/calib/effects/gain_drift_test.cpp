#include <QTest>
#include <cmath>

#include "calib/effects/registry.h"
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
  void isTriedInStretchesThatHaveRowsEnough();
  void refusesACourseThatIsNone_data();
  void refusesACourseThatIsNone();
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
  const QByteArray course(R"({"course_times_s": [100, 200, 600], "course_gains": [0.01, -0.02, 0.06]})");
  QTest::newRow("course, before it") << course << 50.0 << 0.01;
  QTest::newRow("course, half of a stretch") << course << 150.0 << -0.005;
  QTest::newRow("course, a quarter of a longer one") << course << 300.0 << 0.0;
  QTest::newRow("course, at a moment") << course << 200.0 << -0.02;
  QTest::newRow("course, after it") << course << 900.0 << 0.06;
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

// 100 rows from 20 s to 614 s: twelve for each of 4 or 8 stretches, not of 16; the second of four ends at 317 s.
void GainDriftTest::isTriedInStretchesThatHaveRowsEnough() {
  const OwnedDesign owned = gridDesign({Eigen::Quaterniond::Identity()}, true, false);
  std::vector<std::string> names;
  for (const auto& way : findEffect("gain_drift").value()->fits(owned.design)) names.push_back(way->name());
  QVERIFY((names == std::vector<std::string>{"linear", "exponential", "quadratic", "course_of_4", "course_of_8"}));
  const FittedEffect fitted =
      wayOf("gain_drift", owned.design, "course_of_4")->describe({}, Eigen::Vector4d(0.01, 0.03, -0.01, 0.02));
  const auto effect = effectOf("gain_drift", fitted.parameters);
  FT_VERIFY_MATCH(near(gainAt(*effect, 20.0), 0.0, 1e-12));
  FT_VERIFY_MATCH(near(gainAt(*effect, 317.0), 0.03, 1e-12));
  FT_VERIFY_MATCH(near(gainAt(*effect, 614.0), 0.02, 1e-12));
  FT_VERIFY_MATCH(near(gainAt(*effect, 94.25), 0.005, 1e-12));
  QCOMPARE(fitted.values.at(1).name, std::string("gain_after_2_of_4"));
}

void GainDriftTest::refusesACourseThatIsNone_data() {
  QTest::addColumn<QByteArray>("parameters");
  QTest::addColumn<QByteArray>("needed");
  QTest::newRow("lengths") << QByteArray(R"({"course_times_s": [0, 1, 2], "course_gains": [0.1, 0.2]})")
                           << QByteArray("course_times_s has 3 numbers and course_gains 2");
  QTest::newRow("twice the same moment") << QByteArray(
                                                R"({"course_times_s": [0, 5, 5], "course_gains": [0.0, 0.1, 0.2]})")
                                         << QByteArray("must rise");
  QTest::newRow("falling") << QByteArray(R"({"course_times_s": [5, 1], "course_gains": [0.0, 0.1]})")
                           << QByteArray("must rise");
}

void GainDriftTest::refusesACourseThatIsNone() {
  QFETCH(QByteArray, parameters);
  QFETCH(QByteArray, needed);
  const Effect& drift = *findEffect("gain_drift").value();
  const auto resolved = resolveEffectParameters(drift, nlohmann::json::parse(parameters.toStdString()));
  FT_VERIFY_OK(resolved);
  const auto made = drift.make(*resolved, {});
  QVERIFY(!made.has_value());
  QCOMPARE(made.error().code, ErrorCode::kBadInput);
  FT_VERIFY_MATCH(holdsAll(made.error().message, {needed}));
}

FIELDTRUE_TEST(GainDriftTest)
#include "gain_drift_test.moc"
