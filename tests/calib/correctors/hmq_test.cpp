#include <Eigen/Dense>
#include <QRegularExpression>
#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

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
  return W.partialPivLu().solve(values).transpose() * w;
}

Eigen::MatrixXd truthOf(const FitData& data) {
  Eigen::MatrixXd values(static_cast<Eigen::Index>(data.size()), 3);
  for (std::size_t i = 0; i < data.size(); ++i) values.row(static_cast<Eigen::Index>(i)) = data.p_true_m[i].transpose();
  return values;
}

/// RMS over places of what fits to all other places miss it by.
double refittedRms_m(const FitData& data, double r2_cm2) {
  double squares_m2 = 0.0;
  for (std::size_t left_out = 0; left_out < data.size(); ++left_out) {
    std::vector<Eigen::Vector3d> rest_m = data.p_tracked_m;
    Eigen::MatrixXd truth = truthOf(data);
    rest_m.erase(rest_m.begin() + static_cast<std::ptrdiff_t>(left_out));
    const auto last = truth.rows() - 1;
    const auto at = static_cast<Eigen::Index>(left_out);
    truth.middleRows(at, last - at) = truth.bottomRows(last - at).eval();
    const Eigen::Vector3d predicted_m =
        solveAndEvaluate(rest_m, truth.topRows(last), 1e-4 * r2_cm2, data.p_tracked_m[left_out]);
    squares_m2 += (predicted_m - data.p_true_m[left_out]).squaredNorm();
  }
  return std::sqrt(squares_m2 / static_cast<double>(data.size()));
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
    FT_VERIFY_MATCH(holdsAll(model.error().message, {"A4, pipe 3 and C3, pipe 1", "same position"}));
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

  void automaticRSquaredPredictsLeftOutPlacesBest_data() {
    QTest::addColumn<double>("sharpness");
    QTest::newRow("gentle bend") << 1.0;
    QTest::newRow("sharp bend") << 6.0;
  }
  void automaticRSquaredPredictsLeftOutPlacesBest() {
    QFETCH(double, sharpness);
    const auto bend_m = [&](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(0.02 * std::sin(sharpness * p.x() + p.y()), 0.02 * std::cos(sharpness * p.y()),
                             0.01 * std::sin(sharpness * (p.z() - p.x())));
    };
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.02), bend_m);
    const auto automatic = fitPosition("hmq", data, {{"r2_cm2", "auto"}});
    FT_VERIFY_OK(automatic);
    const double chosen_cm2 = 1e4 * (*automatic)->parameters().at("r2_m2").get<double>();
    const double chosen_rms_m = refittedRms_m(data, chosen_cm2);
    for (int k = 0; k <= 8; ++k) {
      const double tried_cm2 = std::pow(10.0, 1.0 + 0.25 * k);
      QVERIFY2(chosen_rms_m <= 1.0005 * refittedRms_m(data, std::min(tried_cm2, 1000.0)),
               qPrintable(QString("%1 beats the chosen %2 cm2").arg(tried_cm2).arg(chosen_cm2)));
    }
    const QString note = QString::fromStdString((*automatic)->note());
    const QRegularExpressionMatch said = QRegularExpression("R squared = (\\S+) cm2.*RMS (\\S+) mm").match(note);
    QVERIFY2(said.hasMatch(), qPrintable(note));
    FT_VERIFY_MATCH(near(said.captured(1).toDouble(), chosen_cm2, 1e-9));
    FT_VERIFY_MATCH(near(said.captured(2).toDouble(), 1000.0 * chosen_rms_m, 0.006 * 1000.0 * chosen_rms_m));
    // The number that is said, given as the setting, makes the same field.
    const auto by_hand = fitPosition("hmq", data, {{"r2_cm2", said.captured(1).toStdString()}});
    FT_VERIFY_OK(by_hand);
    QVERIFY((*by_hand)->parameters().at("alpha") == (*automatic)->parameters().at("alpha"));
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

FIELDTRUE_TEST(HmqTest)
#include "hmq_test.moc"
