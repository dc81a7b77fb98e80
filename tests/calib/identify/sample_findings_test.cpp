#include "calib/identify/sample_findings.h"

#include <QTest>
#include <cmath>

#include "calib/recording/finding.h"
#include "calib/recording/noise_law.h"
#include "calib/recording/reading_lattice.h"
#include "calib/recording/sample_spectrum.h"
#include "calib/simulation/simulator.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

/// 5 x 5 x 4 places from 0.6 to 2.1 m in front of the transmitter.
std::vector<PlannedPlace> plan() {
  std::vector<PlannedPlace> places;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) {
      for (int k = 0; k < 4; ++k) {
        PlannedPlace place;
        place.node = static_cast<int>(places.size());
        place.reference_from_sensor.position_m = Eigen::Vector3d(0.6 + 0.3 * i, 0.25 * (j - 2), 0.25 * (k - 1.5));
        places.push_back(place);
      }
    }
  }
  return places;
}

simulation::Simulation record(const simulation::Scene& scene, std::uint64_t seed = 1) {
  simulation::SimulationOptions options;
  options.seed = seed;
  auto recorded = simulation::simulate(scene, plan(), options);
  if (!recorded) qFatal("%s", recorded.error().message.c_str());
  return *std::move(recorded);
}

/// Readings moved away from the first of their stop by a factor that depends on range.
template <class Factor>
void scaleNoise(simulation::Simulation& recorded, Factor factor) {
  for (SampleRow& row : recorded.samples.rows) {
    const Eigen::Vector3d mean_m =
        recorded.table.nodes[static_cast<std::size_t>(row.node)].tracker_from_sensor.position_m;
    Eigen::Vector3d& p_m = row.sample.tracker_from_sensor.position_m;
    p_m = mean_m + factor(mean_m.norm()) * (p_m - mean_m);
  }
}

std::vector<std::string> effectsOf(const std::vector<GapFinding>& findings) {
  std::vector<std::string> effects;
  for (const GapFinding& finding : findings) effects.push_back(finding.effect);
  return effects;
}

std::vector<std::string> found(const simulation::Simulation& recorded, const simulation::Scene* scene = nullptr) {
  return effectsOf(sampleFindings(&recorded.samples, recorded.table, scene));
}

bool holds(const std::vector<std::string>& effects, const std::string& effect) {
  return std::find(effects.begin(), effects.end(), effect) != effects.end();
}

}  // namespace

class SampleFindingsTest : public QObject {
  Q_OBJECT

 private slots:
  void theLeastSquaresTrackersLawIsMeasured() {
    const simulation::Simulation recorded = record({});
    for (const bool from_samples : {true, false}) {
      const auto rows =
          from_samples ? noiseRows(sampleVisits(recorded.samples), 0.0, 0.0) : noiseRows(recorded.table.nodes, 0.0);
      const auto law = fitNoiseLaw(rows);
      QVERIFY(law.has_value());
      QCOMPARE(law->rows, std::size_t(100));
      FT_VERIFY_MATCH(near(law->position_power.value, 4.0, 0.15));
      FT_VERIFY_MATCH(near(law->rotation_power->value, 3.0, 0.15));
      FT_VERIFY_MATCH(near(std::exp(law->log_transverse_to_radial.value), std::sqrt(30.0), 0.4));
      FT_VERIFY_MATCH(near(std::exp(law->log_coupling_noise.value), simulation::TrackerModel{}.coupling_noise, 1e-5));
      QVERIFY(law->position_power.sd < 0.1);
    }
  }

  void aCleanRecordingShowsNothing() {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const simulation::Scene scene;
      const simulation::Simulation recorded = record(scene, seed);
      QCOMPARE(found(recorded).size(), std::size_t(0));
      QCOMPARE(found(recorded, &scene).size(), std::size_t(0));
      QVERIFY(sampleFindings(nullptr, recorded.table, &scene).empty());
    }
  }

  void noiseThatGrowsOtherwiseIsFound_data() {
    QTest::addColumn<double>("power");
    QTest::newRow("r^5") << 1.0;
    QTest::newRow("r^3") << -1.0;
    QTest::newRow("r^2") << -2.0;
  }

  void noiseThatGrowsOtherwiseIsFound() {
    QFETCH(double, power);
    simulation::Simulation recorded = record({});
    scaleNoise(recorded, [power](double r_m) { return std::pow(r_m, power); });
    const auto law = fitNoiseLaw(noiseRows(sampleVisits(recorded.samples), 0.0, 0.0));
    FT_VERIFY_MATCH(near(law->position_power.value, 4.0 + power, 0.2));
    QVERIFY(holds(found(recorded), "range_noise"));
  }

  void aLevelOtherThanTheScenesIsFound() {
    simulation::Simulation recorded = record({});
    scaleNoise(recorded, [](double) { return 2.0; });
    const simulation::Scene scene;
    QVERIFY(!holds(found(recorded), "range_noise"));
    QVERIFY(holds(found(recorded, &scene), "range_noise"));
  }

  void effectsOfTheCatalogueAreFoundUntilTheSceneHasThem_data() {
    QTest::addColumn<QString>("id");
    QTest::addColumn<QString>("parameters");
    QTest::newRow("mains") << "mains_interference"
                           << R"({"line_hz": [50], "amplitude_per_m3": [1e-4]})";
    QTest::newRow("filter") << "correlated_samples"
                            << R"({"correlation": 0.6})";
    QTest::newRow("lattice") << "quantization"
                             << R"({"quantum_m": 0.01})";
  }

  void effectsOfTheCatalogueAreFoundUntilTheSceneHasThem() {
    QFETCH(QString, id);
    QFETCH(QString, parameters);
    simulation::Scene scene;
    scene.effects = {{id.toStdString(), nlohmann::json::parse(parameters.toStdString())}};
    const simulation::Simulation recorded = record(scene);
    const std::vector<std::string> without = found(recorded);
    QVERIFY2(holds(without, id.toStdString()), qPrintable(QString::number(without.size())));
    QVERIFY(!holds(found(recorded, &scene), id.toStdString()));
  }

  void theLatticeOfReadingsIsMeasured() {
    simulation::Scene scene;
    scene.tracker.quantum_m = 0.00127;
    const simulation::Simulation recorded = record(scene);
    const auto lattice = readingLattice(recorded.samples, sampleVisits(recorded.samples));
    QVERIFY(lattice.has_value());
    FT_VERIFY_MATCH(near(lattice->quantum_m, 0.00127, 1e-9));
    QVERIFY(!lattice->biased.empty());
    // Noise grows as r^4: only near places lie below half a step.
    double farthest_m = 0.0;
    for (const int node : lattice->biased) {
      farthest_m = std::max(farthest_m,
                            recorded.table.nodes[static_cast<std::size_t>(node)].tracker_from_sensor.position_m.norm());
    }
    // Per axis 2e-4 r^4 sqrt((1/54 + 10/9)/3) = 0.635 mm at r = 1.509 m.
    QVERIFY2(farthest_m < 1.75, qPrintable(QString::number(farthest_m)));
  }

  void nothingIsSaidOfNothing() {
    QVERIFY(sampleFindings(nullptr, {}, nullptr).empty());
    const SampleTable empty;
    QVERIFY(sampleFindings(&empty, {}, nullptr).empty());
    QVERIFY(!fitNoiseLaw({}));
  }
};

FIELDTRUE_TEST(SampleFindingsTest)
#include "sample_findings_test.moc"
