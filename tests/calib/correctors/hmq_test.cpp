#include <Eigen/Dense>
#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

Eigen::Vector3d wave_m(const Eigen::Vector3d& p) {
  return 0.03 *
         Eigen::Vector3d(std::sin(3.0 * p.x()), std::cos(2.0 * p.y() + p.z()), std::sin(p.x() * p.y() + 2.0 * p.z()));
}

/// Equations 16 to 18 written out with Eigen's own LU: f at a point, of any right-hand side.
Eigen::VectorXd solveAndEvaluate(const std::vector<Eigen::Vector3d>& centers_m, const Eigen::MatrixXd& values,
                                 double r2_m2, const Eigen::Vector3d& p_m) {
  const auto n = static_cast<Eigen::Index>(centers_m.size());
  Eigen::MatrixXd W(n, n);
  Eigen::VectorXd w(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d& p_i = centers_m[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j)
      W(i, j) = std::sqrt((p_i - centers_m[static_cast<std::size_t>(j)]).squaredNorm() + r2_m2);
    w[i] = std::sqrt((p_m - p_i).squaredNorm() + r2_m2);
  }
  return W.fullPivLu().solve(values).transpose() * w;
}

Eigen::MatrixXd truthOf(const FitData& data) {
  Eigen::MatrixXd values(static_cast<Eigen::Index>(data.size()), 3);
  for (std::size_t i = 0; i < data.size(); ++i) values.row(static_cast<Eigen::Index>(i)) = data.p_true_m[i].transpose();
  return values;
}

}  // namespace

class HmqTest : public QObject {
  Q_OBJECT
 private slots:
  void agreesWithAnIndependentSolution_data() {
    QTest::addColumn<QByteArray>("r2_cm2");
    QTest::addColumn<double>("r2_m2");
    // 1 cm2 = 1e-4 m2.
    QTest::newRow("lowest") << QByteArray("10") << 0.001;
    QTest::newRow("default") << QByteArray() << 0.01;
    QTest::newRow("highest") << QByteArray("1000") << 0.1;
  }
  void agreesWithAnIndependentSolution() {
    QFETCH(QByteArray, r2_cm2);
    QFETCH(double, r2_m2);
    const FitData data = fitDataOf(shakenGrid({4, 4, 3}, 0.25, 0.02), wave_m);
    std::map<std::string, std::string> given;
    if (!r2_cm2.isEmpty()) given["r2_cm2"] = r2_cm2.toStdString();
    const auto model = fitPosition("hmq", data, given);
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m : randomPoints(40)) {
      // Interpolates q itself and has no tail: far away it is not p + something.
      const Eigen::Vector3d expected_m = solveAndEvaluate(data.p_tracked_m, truthOf(data), r2_m2, p_m);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(p_m + (*model)->displacement_m(p_m)), expected_m, 1e-9));
    }
  }

  void passesThroughEveryPlace() {
    const FitData data = fitDataOf(shakenGrid({8, 8, 8}, 0.15, 0.01), wave_m);
    const auto model = fitPosition("hmq", data);
    FT_VERIFY_OK(model);
    for (std::size_t i = 0; i < data.size(); ++i)
      FT_VERIFY_MATCH(near(Eigen::Vector3d(data.p_tracked_m[i] + (*model)->displacement_m(data.p_tracked_m[i])),
                           data.p_true_m[i], 1e-8));
  }

  void visitsOfOnePlaceAreAveraged() {
    FitData once = fitDataOf(shakenGrid({4, 4, 3}, 0.2, 0.02), wave_m);
    FitData twice = once;
    const Eigen::Vector3d apart_m(0.004, -0.002, 0.001);
    twice.p_tracked_m[5] += apart_m;
    twice.p_tracked_m.push_back(once.p_tracked_m[5] - apart_m);
    twice.p_true_m.push_back(once.p_true_m[5]);
    twice.node.push_back(once.node[5]);
    const auto expected = fitPosition("hmq", once);
    const auto seen = fitPosition("hmq", twice);
    FT_VERIFY_OK(expected);
    FT_VERIFY_OK(seen);
    for (const Eigen::Vector3d& p_m : randomPoints(50))
      FT_VERIFY_MATCH(near((*seen)->displacement_m(p_m), (*expected)->displacement_m(p_m), 1e-9));
  }

  void sensorsOfABarThatShareANodeStayApart() {
    // Two rows of one node number whose true positions are 0.2 m apart are two places.
    FitData data = fitDataOf(shakenGrid({4, 4, 3}, 0.2, 0.02), wave_m);
    data.node[1] = data.node[0];
    const auto model = fitPosition("hmq", data);
    FT_VERIFY_OK(model);
    for (const std::size_t i : {0U, 1U})
      FT_VERIFY_MATCH(near(Eigen::Vector3d(data.p_tracked_m[i] + (*model)->displacement_m(data.p_tracked_m[i])),
                           data.p_true_m[i], 1e-9));
  }

  void twoPlacesTrackedAtOnePositionAreNamed() {
    FitData data = fitDataOf(shakenGrid({4, 4, 3}, 0.2, 0.02), wave_m);
    data.p_tracked_m[30] = data.p_tracked_m[11];
    const auto model = fitPosition("hmq", data);
    QVERIFY(!model);
    QCOMPARE(model.error().code, ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(holdsAll(model.error().message, {"places 11 and 30", "same position"}));
  }

  void placesTooCloseForTheirSmoothnessAreRefused() {
    // A 1 mm grid under R = 316 mm, with readings that jump by 5 mm from one place to the next.
    FitData data = fitDataOf(shakenGrid({6, 6, 6}, 0.001, 0.0), wave_m);
    for (std::size_t i = 0; i < data.size(); i += 2) data.p_true_m[i].x() += 0.005;
    const auto model = fitPosition("hmq", data, {{"r2_cm2", "1000"}});
    QVERIFY(!model);
    QCOMPARE(model.error().code, ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(holdsAll(model.error().message, {"316 mm", "smaller R squared"}));
  }

  void settingOutsideTheRangeIsRefused() {
    const PositionMethod& method = *findPositionMethod("hmq").value();
    for (const std::string bad : {"9.99", "1001", "x"}) {
      const auto settings = resolveSettings(method.id, method.settings, {{"r2_cm2", bad}});
      QVERIFY(!settings && settings.error().code == ErrorCode::kBadInput);
    }
  }

  void stopsWhenAsked() {
    const PositionMethod& method = *findPositionMethod("hmq").value();
    std::stop_source source;
    source.request_stop();
    RunControl control;
    control.stop = source.get_token();
    const auto model = method.fit(fitDataOf(shakenGrid({4, 4, 3}, 0.2, 0.02), wave_m), settingsOf(method), control);
    QVERIFY(!model && model.error().code == ErrorCode::kCancelled);
  }
};

QTEST_GUILESS_MAIN(HmqTest)
#include "hmq_test.moc"
