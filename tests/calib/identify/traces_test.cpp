#include "calib/identify/traces.h"

#include <QTest>
#include <cmath>

#include "tests/calib/identify/noisy_rows.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

const NoisyRows kNoise{.per_axis = 4, .turns = 1, .change = {}};

std::vector<Trace> tracesIn(const std::vector<Node>& nodes) {
  const GapRows rows = makeGapRows(nodes, {}).value();
  const GapPhysics physics(rows, {});
  const GapModel state{initialAlignment(rows), {}};
  const Linearized at(physics, state, makeWhitening(rows, kNoise.sd_m, kNoise.sd_rad), octantBlocks(rows));
  return findTraces(at, rows, state);
}

}  // namespace

/// Kinds of error that no row of the catalogue holds.
class TracesTest : public QObject {
  Q_OBJECT
 private slots:
  // Pearson and Hartley 1966, Biometrika Tables for Statisticians I, table 18.
  void tailsAreThoseOfTheTables_data() {
    QTest::addColumn<double>("f");
    QTest::addColumn<double>("d1");
    QTest::addColumn<double>("d2");
    QTest::addColumn<double>("tail");
    QTest::newRow("5 %, 3 and 20") << 3.098 << 3.0 << 20.0 << 0.05;
    QTest::newRow("5 %, 10 and 120") << 1.910 << 10.0 << 120.0 << 0.05;
    QTest::newRow("1 %, 5 and 60") << 3.339 << 5.0 << 60.0 << 0.01;
    QTest::newRow("1 %, 4 and 40") << 3.828 << 4.0 << 40.0 << 0.01;
    QTest::newRow("2.5 %, 6 and 30") << 2.867 << 6.0 << 30.0 << 0.025;
  }
  void tailsAreThoseOfTheTables() {
    QFETCH(double, f);
    QFETCH(double, d1);
    QFETCH(double, d2);
    QFETCH(double, tail);
    FT_VERIFY_MATCH(near(tailOfF(f, d1, d2), tail, 0.04 * tail));
  }

  /// A hundred recordings of noise, five traces each: as many below one in twenty as there should be, three SD allowed.
  void noiseLeavesNoTrace() {
    int n_below = 0;
    for (unsigned seed = 1; seed <= 100; ++seed)
      for (const Trace& trace : tracesIn(noisyNodes(kNoise, seed))) n_below += trace.p_value < 0.05;
    QVERIFY2(n_below <= 25 + 15, qPrintable(QString::number(n_below)));
  }

  void aLayerThatIsNotWhereItSaysIsFound() {
    std::vector<Node> nodes = noisyNodes(kNoise, 3);
    for (Node& node : nodes)  // The second layer up from the floor.
      if (node.node % 4 == 1) node.tracker_from_sensor.position_m.x() += 0.006;
    const std::vector<Trace> traces = tracesIn(nodes);
    FT_VERIFY_MATCH(holdsAll(traces.front().text, {"one layer of the rig"}));
    QVERIFY(traces.front().p_value < 1e-6 && traces.front().explained > 10.0);
  }

  void aSensorThatChangedIsFound() {
    std::vector<Node> nodes = noisyNodes(kNoise, 4);
    for (Node& node : nodes)
      if (node.t_start_s > 500.0)
        node.tracker_from_sensor.position_m += node.tracker_from_sensor.orientation * Eigen::Vector3d(0.0, 0.006, 0.0);
    const std::vector<Trace> traces = tracesIn(nodes);
    FT_VERIFY_MATCH(holdsAll(traces.front().text, {"changed during the session"}));
    QVERIFY(traces.front().p_value < 1e-6);
  }

  void aGainThatFollowsThePlaceIsFound() {
    NoisyRows bent = kNoise;
    bent.change = [](const Pose& pose, const Eigen::Matrix3d& undisturbed) {
      return Eigen::Matrix3d(0.5 * pose.position_m.y() * pose.position_m.y() * undisturbed);
    };
    // Layers bent in their plane take much of it too, and may come first.
    double p_value = 1.0;
    for (const Trace& trace : tracesIn(noisyNodes(bent, 5)))
      if (trace.text.find("gain follows the place") != std::string::npos) p_value = trace.p_value;
    QVERIFY2(p_value < 1e-6, qPrintable(QString::number(p_value)));
  }

  // Of 101 rows one lies 100 scales out: it alone loses weight. Its squared length is 23,660.
  void weightsFallOnlyWhereARowIsFarOut() {
    constexpr Eigen::Index kRows = 101;
    Eigen::VectorXd left = Eigen::VectorXd::Ones(3 * kRows) * std::sqrt(2.366 / 3.0);
    left.segment<3>(30) *= 100.0;
    const Eigen::VectorXd weight = robustWeights(left, kRows, 3);
    for (Eigen::Index i = 0; i < 3 * kRows; ++i)
      FT_VERIFY_MATCH(near(weight[i], i >= 30 && i < 33 ? std::sqrt(12.0 / 23660.0) : 1.0, 1e-9));
  }
};

FIELDTRUE_TEST(TracesTest)
#include "traces_test.moc"
