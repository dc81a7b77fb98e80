#include <QElapsedTimer>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "calib/core/pose.h"
#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// A grid on which some places were visited twice, one visit after the other at the end of the rows.
FitData revisited() {
  FitData data = fitDataOf(shakenGrid({5, 4, 4}, 0.2, 0.02), wave_m);
  for (const std::size_t place : {3U, 40U, 41U}) {
    data.p_tracked_m.push_back(data.p_tracked_m[place] + Eigen::Vector3d(0.002, -0.003, 0.001));
    data.p_true_m.push_back(data.p_true_m[place]);
    data.node.push_back(data.node[place]);
  }
  return data;
}

FitData rest(const FitData& data, const std::vector<std::size_t>& left_out, const Pose& fold_from_data) {
  FitData kept;
  for (std::size_t row = 0; row < data.size(); ++row) {
    if (std::find(left_out.begin(), left_out.end(), row) != left_out.end()) continue;
    kept.p_tracked_m.push_back(data.p_tracked_m[row]);
    kept.p_true_m.push_back(fold_from_data * data.p_true_m[row]);
    kept.node.push_back(data.node[row]);
  }
  return kept;
}

std::unique_ptr<HoldOutFits<PositionModel>> holdOut(const FitData& data,
                                                    const std::map<std::string, std::string>& given = {}) {
  const PositionMethod& method = *findPositionMethod("hmq").value();
  return method.hold_out(data, settingsOf(method, given), {}).value();
}

}  // namespace

/// Leaving rows out in closed form against fitting the rest.
class HmqHoldOutTest : public QObject {
  Q_OBJECT
 private slots:
  void isTheFitOfTheRest_data() {
    QTest::addColumn<QList<int>>("left_out");
    QTest::addColumn<bool>("moved");
    QTest::newRow("nothing") << QList<int>{} << true;
    QTest::newRow("one place") << QList<int>{17} << false;
    QTest::newRow("one place, the alignment moved") << QList<int>{17} << true;
    QTest::newRow("a corner") << QList<int>{0} << true;
    QTest::newRow("a place with both visits") << QList<int>{40, 81} << true;
    QTest::newRow("one of two visits") << QList<int>{40} << true;
    QTest::newRow("a block and a visit") << QList<int>{0, 1, 4, 5, 16, 17, 20, 21, 82} << true;
    QTest::newRow("half") << [] {
      QList<int> half;
      for (int row = 0; row < 40; ++row) half << row;
      return half;
    }() << true;
  }
  void isTheFitOfTheRest() {
    QFETCH(QList<int>, left_out);
    QFETCH(bool, moved);
    const FitData data = revisited();
    const std::vector<std::size_t> rows(left_out.begin(), left_out.end());
    const Pose fold_from_data = moved ? Pose{{0.03, -0.02, 0.05}, rotationFromVector({0.04, -0.02, 0.07})} : Pose();
    const auto expected = fitPosition("hmq", rest(data, rows, fold_from_data));
    FT_VERIFY_OK(expected);
    const auto seen = holdOut(data)->without(rows, fold_from_data);
    FT_VERIFY_OK(seen);
    for (const Eigen::Vector3d& p_m : randomPoints(200))
      FT_VERIFY_MATCH(near((*seen)->displacement_m(p_m), (*expected)->displacement_m(p_m), 1e-9));
  }

  void holdsAtBothEndsOfRSquared_data() {
    QTest::addColumn<QByteArray>("r2_cm2");
    QTest::newRow("lowest") << QByteArray("10");
    QTest::newRow("highest") << QByteArray("1000");
  }
  void holdsAtBothEndsOfRSquared() {
    QFETCH(QByteArray, r2_cm2);
    const std::map<std::string, std::string> given = {{"r2_cm2", r2_cm2.toStdString()}};
    const FitData data = fitDataOf(shakenGrid({8, 8, 7}, 0.1, 0.005), wave_m);
    const auto fits = holdOut(data, given);
    for (const std::size_t row : {0U, 100U, 447U}) {
      const auto expected = fitPosition("hmq", rest(data, {row}, Pose()), given);
      FT_VERIFY_OK(expected);
      const auto seen = fits->without(std::span(&row, 1), Pose());
      FT_VERIFY_OK(seen);
      const Eigen::Vector3d& p_m = data.p_tracked_m[row];
      FT_VERIFY_MATCH(near((*seen)->displacement_m(p_m), (*expected)->displacement_m(p_m), 1e-6));
    }
  }

  void keepsTheRSquaredThatAllRowsChose() {
    const FitData data = fitDataOf(shakenGrid({5, 4, 4}, 0.2, 0.02), wave_m);
    const auto all = fitPosition("hmq", data, {{"r2_cm2", "auto"}});
    FT_VERIFY_OK(all);
    const std::size_t row = 30;
    const auto without = holdOut(data, {{"r2_cm2", "auto"}})->without(std::span(&row, 1), Pose());
    FT_VERIFY_OK(without);
    QVERIFY((*without)->parameters().at("r2_m2") == (*all)->parameters().at("r2_m2"));
    QVERIFY((*without)->parameters().at("centers_m").size() == data.size() - 1);
  }

  /// By how much the squares left at all others grow as each place is left out with them, from fits anew to the rest.
  void variesAsFitsWithoutEachPairDo() {
    const FitData data = fitDataOf(shakenGrid({4, 3, 3}, 0.2, 0.02), wave_m);
    const auto squareAt = [&](std::size_t at, const std::vector<std::size_t>& left_out) {
      const auto fit = fitPosition("hmq", rest(data, left_out, Pose())).value();
      const Eigen::Vector3d& p_m = data.p_tracked_m[at];
      return (p_m + fit->displacement_m(p_m) - data.p_true_m[at]).squaredNorm();
    };
    std::vector<double> alone, grown;
    for (std::size_t i = 0; i < data.size(); ++i) alone.push_back(squareAt(i, {i}));
    for (std::size_t j = 0; j < data.size(); ++j) {
      grown.push_back(0.0);
      for (std::size_t i = 0; i < data.size(); ++i)
        if (i != j) grown.back() += squareAt(i, {i, j}) - alone[i];
    }
    const double mean = std::accumulate(grown.begin(), grown.end(), 0.0) / static_cast<double>(grown.size());
    const double sum = std::accumulate(alone.begin(), alone.end(), 0.0);
    double variance = 0.0;
    for (const double one : grown) variance += std::pow((one - mean) / sum, 2);
    QVERIFY(variance > 0.01);
    FT_VERIFY_MATCH(near(holdOut(data)->ownVariance(), variance, 1e-5 * variance));
  }

  void aRestOnOneLineIsRefused() {
    const FitData data = fitDataOf(shakenGrid({4, 3, 3}, 0.2, 0.0), wave_m);
    std::vector<std::size_t> all_but_one_line;
    // Along the last axis three places follow one another.
    for (std::size_t row = 3; row < data.size(); ++row) all_but_one_line.push_back(row);
    FitData straight = data;
    for (std::size_t row = 0; row < 3; ++row) straight.p_true_m[row] = straight.p_tracked_m[row];
    const auto without = holdOut(straight)->without(all_but_one_line, Pose());
    QVERIFY(!without);
    QCOMPARE(without.error().code, ErrorCode::kDegenerate);
    std::vector<std::size_t> everything;
    for (std::size_t row = 0; row < data.size(); ++row) everything.push_back(row);
    QCOMPARE(holdOut(data)->without(everything, Pose()).error().code, ErrorCode::kTooFewNodes);
  }

  void leavesEachOf1000PlacesOutInSeconds() {
    const FitData data = fitDataOf(shakenGrid({10, 10, 10}, 0.15, 0.01), wave_m);
    QElapsedTimer timer;
    timer.start();
    const auto fits = holdOut(data);
    for (std::size_t row = 0; row < data.size(); ++row) FT_VERIFY_OK(fits->without(std::span(&row, 1), Pose()));
    // Fitted anew a thousand times it takes a minute and more.
    QVERIFY2(timer.elapsed() < 20000, qPrintable(QString("%1 ms").arg(timer.elapsed())));
  }
};

FIELDTRUE_TEST(HmqHoldOutTest)
#include "hmq_hold_out_test.moc"
