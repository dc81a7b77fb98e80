#include <QTest>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "tests/blind/generate_effects.h"
#include "tests/blind/generate_session.h"
#include "tests/blind/is_near.h"
#include "tests/blind/session_draw.h"
#include "tests/support/test_main.h"

using namespace blind;

namespace {

/// One column of a node or sample table.
std::vector<double> columnOf(const std::string& csv, const std::string& name) {
  std::istringstream lines(csv);
  std::vector<double> values;
  int wanted = -1;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::string field;
    for (int at = 0; std::getline(fields, field, ','); ++at) {
      if (wanted < 0 && field == name) {
        wanted = at;
        break;
      }
      if (wanted == at) values.push_back(std::stod(field));
    }
  }
  return values;
}

/// A design of many rows whose readings are as good as free of noise: what varies is the seating.
Setup seatedMany(bool heavy_tails) {
  Setup setup;
  setup.heavy_tails = heavy_tails;
  setup.coupling_noise = 1e-9;
  setup.samples = 2;
  setup.counts = {2000, 1, 1};
  for (int n = 0; n < 2000; ++n) {
    Row row;
    row.node = row.i = n;
    row.place_m = Vector3d(1, 0.2, 0.1);
    row.start_s = n;
    row.end_s = n + 0.1;
    setup.rows.push_back(row);
  }
  setup.latest_s = 2000;
  return setup;
}

}  // namespace

/// What varies from reading to reading and from row to row.
class BlindRecordingTest : public QObject {
  Q_OBJECT
 private slots:
  void seatingHasTheTailsItSays_data();
  void seatingHasTheTailsItSays();
  void driftWarmsUpAndWanders();
  void readingsAreFiltered();
};

void BlindRecordingTest::seatingHasTheTailsItSays_data() {
  QTest::addColumn<bool>("heavy");
  QTest::addColumn<double>("beyond");
  QTest::addColumn<double>("middle");
  // Beyond 3 SD and median of the absolute value: Gaussian 0.0027 and 0.6745; Student t of 4 degrees of freedom, whose
  // variance is 2: P(|t| > 3 sqrt 2) = 0.0132, median 0.7407 / sqrt 2.
  QTest::newRow("Gaussian") << false << 0.0027 << 0.6745;
  QTest::newRow("Student") << true << 0.0132 << 0.5238;
}

void BlindRecordingTest::seatingHasTheTailsItSays() {
  QFETCH(bool, heavy);
  QFETCH(double, beyond);
  QFETCH(double, middle);
  const Setup setup = seatedMany(heavy);
  Random random(3);
  const std::string csv = recordSession(setup, World(), Alignment(setup), {}, false, random).nodes_csv;
  std::vector<double> sizes;
  for (const auto& [name, at] : {std::pair("x_m", 1.0), std::pair("y_m", 0.2), std::pair("z_m", 0.1)})
    for (double value : columnOf(csv, name)) sizes.push_back(std::abs(value - at) / setup.jig_m);
  QCOMPARE(sizes.size(), std::size_t(6000));
  std::sort(sizes.begin(), sizes.end());
  const double share = static_cast<double>(sizes.end() - std::upper_bound(sizes.begin(), sizes.end(), 3.0)) / 6000;
  // Three standard errors of 6,000 draws.
  QVERIFY2(std::abs(share - beyond) < 3 * std::sqrt(beyond / 6000), qPrintable(QString::number(share)));
  QVERIFY(isNear(sizes[3000], middle, 0.05));
}

void BlindRecordingTest::driftWarmsUpAndWanders() {
  const std::vector<Kind>& kinds = catalogueKinds();
  const auto drift = std::find_if(kinds.begin(), kinds.end(), [](const Kind& kind) { return kind.id == "gain_drift"; });
  QVERIFY(drift != kinds.end());
  Random random(9);
  const Setup setup = drawSetup(random);
  double sum_half = 0, sum_end = 0, sum_rough = 0;
  const int draws = 600;
  for (int n = 0; n < draws; ++n) {
    const Drawn drawn = drift->draw(setup, random);
    nlohmann::json effect = {{"parameters", nlohmann::json::object()}};
    drawn.describe(1.0, effect);
    World world;
    drawn.apply(world, 1e-3, {});
    const auto gainAt = [&](double share) {
      Row row;
      row.start_s = share * setup.duration_s();
      Matrix3d couplings = Matrix3d::Identity();
      world.signal.front()(row, SolvedPose(), couplings);
      return (couplings(0, 0) - 1) / 1e-3 * effect["parameters"]["gain_at_end"].get<double>();
    };
    QVERIFY(std::abs(gainAt(0)) < 1e-9);
    sum_half += gainAt(0.5) / draws;
    sum_end += gainAt(0.9999) / draws;
    sum_rough += std::pow(gainAt(0.9) - 2 * gainAt(0.8) + gainAt(0.7), 2) / draws;
  }
  // The walk averages out and leaves 3/4 (1 - exp(-t / c)), averaged over c from 0.2 to 0.7 of the session by Simpson's
  // rule: 0.887 at the end, 0.687 half way. The walk bends by the difference of two steps of a tenth of the session:
  // variance 0.2, times the mean square of its share 1/12; the exponential adds less than a twentieth of that.
  QVERIFY2(std::abs(sum_end - 0.75 * 0.887) < 0.05, qPrintable(QString::number(sum_end)));
  QVERIFY2(std::abs(sum_half - 0.75 * 0.687) < 0.05, qPrintable(QString::number(sum_half)));
  QVERIFY2(sum_rough > 0.012 && sum_rough < 0.022, qPrintable(QString::number(sum_rough)));
}

void BlindRecordingTest::readingsAreFiltered() {
  Setup setup = seatedMany(false);
  setup.rows.resize(40);
  setup.samples = 200;
  setup.filter = 0.6;
  setup.coupling_noise = 1e-3;
  Random random(12);
  const GeneratedSession session = recordSession(setup, World(), Alignment(setup), {}, true, random);
  const std::vector<double> x = columnOf(session.samples_csv, "x_m");
  QCOMPARE(x.size(), std::size_t(40 * 200));
  double together = 0, alone = 0;
  for (std::size_t row = 0; row < 40; ++row) {
    double mean = 0;
    for (std::size_t s = 0; s < 200; ++s) mean += x[200 * row + s] / 200;
    for (std::size_t s = 0; s + 1 < 200; ++s) {
      together += (x[200 * row + s] - mean) * (x[200 * row + s + 1] - mean);
      alone += (x[200 * row + s] - mean) * (x[200 * row + s] - mean);
    }
  }
  // Taking the mean of 200 readings out lowers it by (1 + 3 a) / n = 0.014 (Kendall 1954, Biometrika 41, 403).
  QVERIFY2(std::abs(together / alone - 0.586) < 0.03, qPrintable(QString::number(together / alone)));
  // As many independent readings as n (1 - a) / (1 + a) of a first-order filter.
  QVERIFY(isNear(columnOf(session.nodes_csv, "n_effective").front(), 50.0, 1e-9));
}

FIELDTRUE_TEST(BlindRecordingTest)
#include "blind_recording_test.moc"
