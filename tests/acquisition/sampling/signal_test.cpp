#include <Eigen/Geometry>
#include <QTest>
#include <cmath>
#include <numbers>
#include <random>

#include "acquisition/sampling/signal_questions.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

constexpr double kReadings_hz = 100.0;
const Eigen::Vector3d kLies_m{0.4, 0.0, 0.3};  ///< 0.5 m from the transmitter.

Sample sampleAt(double t_s, const Eigen::Vector3d& p_m, int sensor = 0, const std::string& status = {}) {
  return {t_s, sensor, {p_m, Eigen::Quaterniond::Identity()}, status};
}

/// A sensor that lies, with independent noise of its own SD on each axis.
SignalWindow lying(double seconds, const Eigen::Vector3d& sd_m, const Eigen::Vector3d& m_per_s = {0.0, 0.0, 0.0}) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  SignalWindow window;
  for (int i = 0; i < seconds * kReadings_hz; ++i) {
    const double t_s = i / kReadings_hz;
    const Eigen::Vector3d noise{normal(random), normal(random), normal(random)};
    window.add(sampleAt(t_s, kLies_m + t_s * m_per_s + sd_m.cwiseProduct(noise)));
  }
  return window;
}

SignalReport reportOf(const SignalWindow& window) { return signalReport(window.sensors().at(0)); }

SecondMean secondAt(double t_s, double x_m) { return {t_s, {x_m, 0.0, 0.0}, 1e-4}; }

Moves movesOf(const Eigen::Matrix3d& columns_m) {
  return {Eigen::Vector3d(columns_m.col(0)), Eigen::Vector3d(columns_m.col(1)), Eigen::Vector3d(columns_m.col(2))};
}

}  // namespace

class SignalTest : public QObject {
  Q_OBJECT
 private slots:
  void theWindowForgets();
  void aStandBeginsWhereTheSensorRests();
  void aGapOrAClockThatStepsBackEndsTheStand();
  void ellipsoidOfAKnownCovariance();
  void driftOfALine();
  void driftOfAnUnevenLine();
  void reportOfASensorThatLies();
  void aLineStandsOut();
  void movesAreFollowed();
  void hemisphere();
  void axes_data();
  void axes();
  void warmUp();
  void noise();
  void theLeastNoiseThatIsTold();
};

void SignalTest::theWindowForgets() {
  SignalWindow window;
  for (int i = 0; i < 8 * 7200; ++i) window.add(sampleAt(i / 8.0, kLies_m, i % 2));
  const auto of_sensors = window.sensors();
  QCOMPARE(of_sensors.size(), std::size_t{2});
  QCOMPARE(of_sensors[1].sensor, 1);
  // Half a minute at four a second, both ends; an hour of seconds.
  QVERIFY(of_sensors[0].recent.size() == 121 || of_sensors[0].recent.size() == 120);
  SignalWindow fast;
  for (int i = 0; i < 10 * 7200; ++i) fast.add(sampleAt(i / 10.0, kLies_m));
  QCOMPARE(fast.sensors()[0].seconds.size(), SignalWindow::kMostSeconds);
}

void SignalTest::aStandBeginsWhereTheSensorRests() {
  SignalWindow window;
  // Rests 5 s, is carried 0.5 m in 2 s, and rests again from 7 s on.
  for (int i = 0; i < 1200; ++i) {
    const double t_s = i / kReadings_hz;
    const double x_m = 0.25 * std::clamp(t_s - 5.0, 0.0, 2.0);
    window.add(sampleAt(t_s, {x_m, 0.0, 0.0}));
    if (i == 490) QCOMPARE(window.sensors()[0].rests_from_s, std::optional(0.0));
    if (i == 690) QVERIFY(!window.sensors()[0].rests_from_s);
  }
  const SensorSignal signal = window.sensors()[0];
  QCOMPARE(signal.rests_from_s, std::optional(7.0));
  QCOMPARE(signal.seconds.size(), std::size_t{4});  // 7, 8, 9, 10; the last one runs.
  QCOMPARE(signal.seconds[0].mean_m.x(), 0.5);
}

void SignalTest::aGapOrAClockThatStepsBackEndsTheStand() {
  SignalWindow window = lying(5.0, Eigen::Vector3d::Zero());
  for (int i = 0; i < 250; ++i) window.add(sampleAt(9.0 + i / kReadings_hz, kLies_m));
  QCOMPARE(window.sensors()[0].rests_from_s, std::optional(9.0));
  for (int i = 0; i < 250; ++i) window.add(sampleAt(1.0 + i / kReadings_hz, kLies_m));
  QCOMPARE(window.sensors()[0].rests_from_s, std::optional(1.0));
  QCOMPARE(window.sensors()[0].recent.size(), std::size_t{250});
}

void SignalTest::ellipsoidOfAKnownCovariance() {
  // SDs 1, 2 and 3 mm along axes turned by 30 degrees about z; the largest is the turned x axis.
  const double angle = std::numbers::pi / 6.0;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d variances_m2{9e-6, 4e-6, 1e-6};
  const NoiseEllipsoid noise = noiseEllipsoid(turn * variances_m2.asDiagonal() * turn.transpose(), {0.0, 0.7, 0.0});
  QVERIFY((noise.sds_m - Eigen::Vector3d(0.003, 0.002, 0.001)).norm() < 1e-9);
  QVERIFY(std::abs(std::abs(noise.axes.col(0).dot(turn.col(0))) - 1.0) < 1e-9);
  // From the y axis the turned x axis is 60 degrees away.
  QVERIFY(std::abs(noise.from_line_of_sight_rad - std::numbers::pi / 3.0) < 1e-9);
  QVERIFY(std::abs(noise.sd_m() - std::sqrt(14e-6)) < 1e-12);
}

void SignalTest::driftOfALine() {
  std::vector<SecondMean> seconds;
  for (int i = 0; i < 60; ++i) seconds.push_back(secondAt(i + 0.5, 0.1 + 2e-6 * i));
  const auto drift = driftOf(seconds);
  QVERIFY(drift.has_value());
  QVERIFY((drift->m_per_s - Eigen::Vector3d(2e-6, 0.0, 0.0)).norm() < 1e-15);
  QVERIFY(drift->sd_m_per_s < 1e-15);
  QCOMPARE(drift->over_s, 59.0);
  seconds.resize(19);
  QVERIFY(!driftOf(seconds));
}

void SignalTest::driftOfAnUnevenLine() {
  // Ten parts of two seconds, their means at 1, 3, ... 19 s alternating between +d and -d: sum of (t - 10)^2 = 330,
  // sum of (t - 10) x = d (-9 + 7 - 5 + 3 - 1 - 1 + 3 - 5 + 7 - 9) = -10 d, so the slope is -d/33; left over are
  // 10 d^2 - 330 (d/33)^2 = 320/33 d^2, of 8 degrees of freedom, and so an SD of sqrt(320/33/8/330) d.
  const double d = 1e-4;
  std::vector<SecondMean> seconds;
  for (int i = 0; i < 20; ++i) seconds.push_back(secondAt(i + 0.5, (i / 2) % 2 == 0 ? d : -d));
  const auto drift = driftOf(seconds);
  QVERIFY(drift.has_value());
  QVERIFY(std::abs(drift->m_per_s.x() + d / 33.0) < 1e-12);
  QVERIFY(std::abs(drift->sd_m_per_s - std::sqrt(320.0 / 33.0 / 8.0 / 330.0) * d) < 1e-12);
}

void SignalTest::reportOfASensorThatLies() {
  SignalWindow window = lying(20.0, {1e-4, 2e-4, 3e-4});
  for (int i = 0; i < 20; ++i) window.add(sampleAt(20.0 + i / kReadings_hz, kLies_m, 0, "k"));
  const SignalReport report = reportOf(window);
  QCOMPARE(report.readings, std::size_t{2020});
  QVERIFY(std::abs(report.rate_hz - kReadings_hz) < 1e-9);
  QCOMPARE(report.marks, (std::map<std::string, std::size_t>{{"k", 20}}));
  QVERIFY(report.stand && (report.stand->position_m - kLies_m).norm() < 3e-5);
  // 2000 readings tell an SD to 1/sqrt(4000), 1.6 %; the outlier test takes a little of the tails.
  QVERIFY((report.noise->sds_m - Eigen::Vector3d(3e-4, 2e-4, 1e-4)).norm() < 2e-5);
  QVERIFY(std::abs(report.correlation) < 0.1);
  QVERIFY2(report.spectrum.has_value() && report.spectrum->lines.empty(), "white noise has no line");
  QVERIFY(report.drift.has_value());
  // One that moves has neither stand nor noise.
  for (int i = 0; i < 300; ++i)
    window.add(sampleAt(21.0 + i / kReadings_hz, kLies_m + Eigen::Vector3d(0.001 * i, 0, 0)));
  const SignalReport moving = reportOf(window);
  QVERIFY(!moving.stand && !moving.noise && !moving.spectrum && !moving.drift && moving.rested_s == 0.0);
}

void SignalTest::aLineStandsOut() {
  // A monitor's 72 Hz read 100 times a second shows at 100 - 72 = 28 Hz.
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 1e-4);
  SignalWindow window;
  for (int i = 0; i < 2500; ++i) {
    const double t_s = i / kReadings_hz;
    const double hum_m = 1e-4 * std::sin(2.0 * std::numbers::pi * 72.0 * t_s);
    window.add(sampleAt(t_s, kLies_m + Eigen::Vector3d(hum_m + normal(random), normal(random), normal(random))));
  }
  const SignalReport report = reportOf(window);
  QVERIFY(report.spectrum && !report.spectrum->lines.empty());
  QVERIFY(std::abs(report.spectrum->lines[0].frequency_hz - 28.0) < 0.2);
  const Answer answer = noiseAnswer(report, 1e-5);
  QVERIFY(answer.verdict == Verdict::kLook);
  FT_VERIFY_MATCH(holdsAll(answer.text, {"a line stands out at", "as a monitor of 72"}));
}

void SignalTest::movesAreFollowed() {
  AxisMoves moves;
  moves.add(kLies_m);
  QVERIFY2(!moves.hasStart(), "nothing is followed before it is asked for");
  moves.begin();
  QCOMPARE(moves.asked(), std::optional(0));
  moves.add(std::nullopt);
  QVERIFY(!moves.hasStart());
  moves.add(kLies_m);
  moves.add(kLies_m + Eigen::Vector3d(0.03, 0.0, 0.0));
  QVERIFY2(moves.asked() == 0, "less than a move");
  moves.add(std::nullopt);
  moves.add(kLies_m + Eigen::Vector3d(0.2, 0.0, 0.0));
  QCOMPARE(moves.asked(), std::optional(1));
  moves.add(kLies_m + Eigen::Vector3d(0.2, 0.0, 0.0));
  QCOMPARE(moves.asked(), std::optional(1));
  moves.add(kLies_m + Eigen::Vector3d(0.2, 0.1, 0.0));
  moves.add(kLies_m + Eigen::Vector3d(0.2, 0.1, 0.3));
  QVERIFY(!moves.asked());
  QVERIFY((*moves.moves()[0] - Eigen::Vector3d(0.2, 0.0, 0.0)).norm() < 1e-15);
  QVERIFY((*moves.moves()[1] - Eigen::Vector3d(0.0, 0.1, 0.0)).norm() < 1e-15);
  QVERIFY((*moves.moves()[2] - Eigen::Vector3d(0.0, 0.0, 0.3)).norm() < 1e-15);
}

void SignalTest::hemisphere() {
  SignalReport report;
  QVERIFY(hemisphereAnswer(report, {}, "+x").verdict == Verdict::kNotKnown);
  report.newest = sampleAt(0.0, {0.3, 0.0, 0.4});
  const Answer asked = hemisphereAnswer(report, {}, "+x");
  QVERIFY(asked.verdict == Verdict::kNotKnown);
  FT_VERIFY_MATCH(holdsAll(asked.text, {"0.50 m from the transmitter", "side +z"}));
  // Moves that are seen as they are, turned with the transmitter, or mirrored through it, turned or not.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  QVERIFY(hemisphereAnswer(report, movesOf(0.2 * turn), "+x").verdict == Verdict::kGood);
  const Answer mirrored = hemisphereAnswer(report, movesOf(-0.2 * turn), "+x");
  QVERIFY(mirrored.verdict == Verdict::kLook);
  FT_VERIFY_MATCH(holdsAll(mirrored.text, {"left-handed", "connect with hemisphere -x in place of +x"}));
  Eigen::Matrix3d flat = Eigen::Matrix3d::Identity();
  flat.col(2) = flat.col(0) + flat.col(1);
  FT_VERIFY_MATCH(holdsAll(hemisphereAnswer(report, movesOf(flat), "+x").text, {"not at right angles"}));
  // 2 cm from the plane x = 0, at 0.5 m.
  report.newest = sampleAt(0.0, {-0.02, 0.0, 0.5});
  FT_VERIFY_MATCH(holdsAll(hemisphereAnswer(report, {}, "-x").text, {"20 mm", "-x ends"}));
  QVERIFY(hemisphereAnswer(report, {}, "+z").verdict == Verdict::kNotKnown);
  report.marks["flipped"] = 7;
  FT_VERIFY_MATCH(holdsAll(hemisphereAnswer(report, {}, "+z").text, {"7 readings", "mirrored side"}));
}

void SignalTest::axes_data() {
  QTest::addColumn<QVector<double>>("seen");  // of x, then of y, then of z
  QTest::addColumn<bool>("is_good");
  QTest::addColumn<QByteArray>("says");
  QTest::newRow("as meant") << QVector<double>{0.2, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.3} << true
                            << QByteArray("within 0 degrees");
  // A transmitter turned by a quarter about its z sees what goes along the room's x go along its own -y.
  QTest::newRow("a quarter turn")
      << QVector<double>{0.0, -0.2, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.2} << false
      << QByteArray("+x came out as -y, +y came out as +x; the transmitter stands turned by 90 degrees about +z");
  QTest::newRow("mirrored")
      << QVector<double>{-0.2, 0.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, -0.2} << false
      << QByteArray("+x came out as -x, +y came out as -y, +z came out as -z; set the hemisphere right first");
  // By 36.87 degrees: 3-4-5.
  QTest::newRow("askew") << QVector<double>{0.16, -0.12, 0.0, 0.12, 0.16, 0.0, 0.0, 0.0, 0.2} << false
                         << QByteArray("askew; the transmitter stands turned by 37 degrees about +z");
  QTest::newRow("along one line") << QVector<double>{0.2, 0.0, 0.0, 0.2, 0.01, 0.0, 0.0, 0.0, 0.2} << false
                                  << QByteArray("not at right angles");
}

void SignalTest::axes() {
  QFETCH(QVector<double>, seen);
  QFETCH(bool, is_good);
  QFETCH(QByteArray, says);
  const Answer answer = axesAnswer(movesOf(Eigen::Map<const Eigen::Matrix3d>(seen.constData())));
  QCOMPARE(answer.verdict == Verdict::kGood, is_good);
  FT_VERIFY_MATCH(holdsAll(answer.text, {says}));
  QVERIFY(axesAnswer({Eigen::Vector3d::UnitX(), std::nullopt, std::nullopt}).verdict == Verdict::kNotKnown);
}

void SignalTest::warmUp() {
  QVERIFY(warmUpAnswer(reportOf(lying(1.5, Eigen::Vector3d::Zero()))).text.find("the sensor moves") == 0);
  FT_VERIFY_MATCH(holdsAll(warmUpAnswer(reportOf(lying(30.5, {1e-5, 1e-5, 1e-5}))).text, {"for a minute: 30 s"}));
  // 0.1 mm a minute under a noise of 0.1 mm.
  const Answer drifts = warmUpAnswer(reportOf(lying(120.5, {1e-4, 1e-4, 1e-4}, {1e-4 / 60.0, 0.0, 0.0})));
  QVERIFY2(drifts.verdict == Verdict::kLook, drifts.text.c_str());
  const Answer steady = warmUpAnswer(reportOf(lying(300.5, {1e-4, 1e-4, 1e-4})));
  QVERIFY2(steady.verdict == Verdict::kGood, steady.text.c_str());
  // In ten times the noise a minute does not tell.
  const Answer unsure = warmUpAnswer(reportOf(lying(61.5, {1e-3, 1e-3, 1e-3})));
  QVERIFY2(unsure.verdict == Verdict::kNotKnown, unsure.text.c_str());
}

void SignalTest::noise() {
  const SignalReport report = reportOf(lying(10.0, {1e-4, 1e-4, 1e-4}));  // 3-D 0.173 mm
  const Answer good = noiseAnswer(report, 1.5e-4);
  QVERIFY2(good.verdict == Verdict::kGood, good.text.c_str());
  FT_VERIFY_MATCH(holdsAll(good.text, {"SD 0.17 mm at 0.50 m", "about 0.15 mm"}));
  QVERIFY(noiseAnswer(report, 5e-5).verdict == Verdict::kLook);
  QVERIFY(noiseAnswer(report, std::nullopt).verdict == Verdict::kNotKnown);
  FT_VERIFY_MATCH(
      holdsAll(noiseAnswer(reportOf(lying(10.0, Eigen::Vector3d::Zero())), 1e-4).text, {"every reading is the same"}));
  QVERIFY(noiseAnswer(SignalReport{}, 1e-4).verdict == Verdict::kNotKnown);
}

void SignalTest::theLeastNoiseThatIsTold() {
  // Noise of a nanometre: a step of a micrometre, uniform, has an SD of 1/sqrt(12) = 0.29 um.
  const SignalReport report = reportOf(lying(10.0, {1e-9, 1e-9, 1e-9}));
  QVERIFY(std::abs(report.least_sd_m - 1e-6 / std::sqrt(12.0)) < 1e-12);
  QVERIFY(std::abs(report.noise->sds_m[2] - report.least_sd_m) < 1e-10);
  FT_VERIFY_MATCH(holdsAll(noiseAnswer(report, std::nullopt).text, {"along an axis no less than 0.00029 mm is told"}));
  const Answer loud = noiseAnswer(reportOf(lying(10.0, {1e-4, 1e-4, 1e-4})), std::nullopt);
  QVERIFY2(loud.text.find("no less than") == std::string::npos, loud.text.c_str());
}

FIELDTRUE_TEST(SignalTest)
#include "signal_test.moc"
