#include "calib/identify/scan.h"

#include <Eigen/QR>
#include <QTest>
#include <cmath>

#include "calib/identify/search.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

/// Rows of a matrix by whether they are of one hold-out block.
Eigen::MatrixXd rowsOf(const Eigen::MatrixXd& all, const Segment& block, bool of_block) {
  if (of_block) return all.middleRows(block.begin, block.count);
  Eigen::MatrixXd rest(all.rows() - block.count, all.cols());
  rest.topRows(block.begin) = all.topRows(block.begin);
  rest.bottomRows(rest.rows() - block.begin) = all.bottomRows(rest.rows() - block.begin);
  return rest;
}

struct Refit {
  Eigen::VectorXd x;
  double cost = 0.0;  ///< Sum of squares, and what the prior adds.
};

/// Least squares written out: nuisance and columns stacked, the prior as rows of their own, a bound held where it is
/// crossed.
Refit refit(const Eigen::MatrixXd& nuisance, const Eigen::MatrixXd& columns, const Eigen::VectorXd& r,
            const LinearPrior& prior) {
  const Eigen::Index q = nuisance.cols();
  const Eigen::Index m = columns.cols();
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(r.size() + m, q + m);
  design.topLeftCorner(r.size(), q) = nuisance;
  design.topRightCorner(r.size(), m) = columns;
  design.bottomRightCorner(m, m) = prior.precision.cwiseSqrt().asDiagonal();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(r.size() + m);
  y.head(r.size()) = r;
  Refit fit;
  fit.x = design.colPivHouseholderQr().solve(y);
  if (m == 1 && (fit.x[q] < prior.low || fit.x[q] > prior.high)) {
    const double held = std::min(std::max(fit.x[q], prior.low), prior.high);
    fit.x.head(q) = design.leftCols(q).colPivHouseholderQr().solve(y - held * design.col(q));
    fit.x[q] = held;
  }
  fit.cost = (y - design * fit.x).squaredNorm();
  return fit;
}

double squaresLeft(const Eigen::MatrixXd& nuisance, const Eigen::MatrixXd& columns, const Eigen::VectorXd& r,
                   const Eigen::VectorXd& x) {
  return (r - nuisance * x.head(nuisance.cols()) - columns * x.tail(columns.cols())).squaredNorm();
}

}  // namespace

/// The scan, which sums cross products once, against a least-squares fit for every start and every block.
class ScanTest : public QObject {
  Q_OBJECT
 private slots:
  void isARefitOfEveryStart_data() {
    QTest::addColumn<QByteArray>("effect");
    QTest::addColumn<QByteArray>("parameters");
    QTest::newRow("a body") << QByteArray("compact_metal")
                            << QByteArray(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})");
    QTest::newRow("nothing") << QByteArray() << QByteArray();
  }
  void isARefitOfEveryStart() {
    QFETCH(QByteArray, effect);
    QFETCH(QByteArray, parameters);
    simulation::Scene scene = gapScene();
    if (!effect.isEmpty())
      scene.effects.push_back({effect.toStdString(), nlohmann::json::parse(parameters.toStdString())});
    const CalibrationTable table = recordedIn(scene, gapPlan({.counts = {4, 4, 3}, .pitch_m = 0.2}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const Linearized at(search.physics(), search.none().model, search.whitening(), search.spaceBlocks());
    const Eigen::MatrixXd no_columns(at.size(), 0);
    const LinearPrior no_prior{Eigen::VectorXd(), -HUGE_VAL, HUGE_VAL};
    const Refit none = refit(at.nuisance(), no_columns, at.residual(), no_prior);
    std::size_t n_starts = 0;
    for (const EffectWay& way : search.ways()) {
      std::vector<Eigen::VectorXd> starts = way.fit->starts();
      std::erase_if(starts, [&](const Eigen::VectorXd& start) { return !way.fit->allows(start); });
      const std::size_t stride = std::max<std::size_t>(1, starts.size() / 3);
      for (std::size_t i = 0; i < starts.size(); i += stride, ++n_starts) {
        const ScanResult seen = Scanner(at).scan(*way.fit, {starts[i]}, 1, {});
        const Eigen::MatrixXd columns = at.columns(*way.fit, starts[i]);
        const LinearPrior prior = priorOf(*way.fit);
        const Refit all = refit(at.nuisance(), columns, at.residual(), prior);
        // A millionth of the gain, and what the scan's guard against dependent columns costs.
        const auto near_enough = [](double seen_gain, double expected) {
          return near(seen_gain, expected, 1e-4 * std::abs(expected) + 1e-4);
        };
        FT_VERIFY_MATCH(near_enough(seen.best.front().gain, none.cost - all.cost));
        for (std::size_t b = 0; b < at.segments().size(); ++b) {
          const Segment& block = at.segments()[b];
          const auto split = [&](const Eigen::MatrixXd& m, bool of_block) { return rowsOf(m, block, of_block); };
          const Refit before =
              refit(split(at.nuisance(), false), split(no_columns, false), split(at.residual(), false), no_prior);
          const Refit after =
              refit(split(at.nuisance(), false), split(columns, false), split(at.residual(), false), prior);
          FT_VERIFY_MATCH(near_enough(seen.without_block[b].gain, before.cost - after.cost));
          const double held_out =
              squaresLeft(split(at.nuisance(), true), split(no_columns, true), split(at.residual(), true), before.x) -
              squaresLeft(split(at.nuisance(), true), split(columns, true), split(at.residual(), true), after.x);
          FT_VERIFY_MATCH(near(seen.held_out_gain[b], held_out, 2e-3 * std::abs(held_out) + 2e-3));
        }
      }
    }
    QVERIFY2(n_starts > 15, qPrintable(QString::number(n_starts)));
  }

  void keepsTheBestStartsInOrder() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back(
        {"compact_metal", nlohmann::json::parse(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})")});
    const CalibrationTable table = recordedIn(scene, gapPlan());
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const Linearized at(search.physics(), search.none().model, search.whitening(), search.spaceBlocks());
    for (const EffectWay& way : search.ways()) {
      if (!way.fit->searchesPlace()) continue;
      const std::vector<Eigen::VectorXd> starts = way.fit->starts();
      const ScanResult few = Scanner(at).scan(*way.fit, starts, 3, {});
      const ScanResult all = Scanner(at).scan(*way.fit, starts, starts.size(), {});
      QVERIFY(few.best.size() == 3 && all.best.size() >= 3);
      for (std::size_t i = 0; i < 3; ++i) QVERIFY(few.best[i].searched == all.best[i].searched);
      for (std::size_t i = 1; i < all.best.size(); ++i) QVERIFY(all.best[i - 1].gain >= all.best[i].gain);
      for (const ScanResult::Start& start : all.best) QVERIFY(way.fit->allows(start.searched));
    }
  }
};

FIELDTRUE_TEST(ScanTest)
#include "scan_test.moc"
