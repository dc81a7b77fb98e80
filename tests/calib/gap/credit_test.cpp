#include <QTest>
#include <algorithm>
#include <map>
#include <numeric>

#include "calib/gap/candidates.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

/// Which effect takes how much of what all take, averaged over every order in which they can be added.
class CreditTest : public QObject {
  Q_OBJECT
 private slots:
  void isTheMeanOverTheOrdersOfAdding() {
    simulation::Scene scene = gapScene();
    scene.effects = {{"compact_metal", nlohmann::json::parse(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})")},
                     {"grid_scale", nlohmann::json::parse(R"({"scale": [0.01, -0.008, 0.004]})")},
                     {"global_gain", nlohmann::json::parse(R"({"gain": 0.02})")}};
    const CalibrationTable table = recordedIn(scene, gapPlan({.orientations = threeTurns()}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const EffectSelection selection = selectEffects(search, {}, {});
    const std::size_t n = selection.ways.size();
    QVERIFY2(n >= 2, qPrintable(QString::number(n)));
    std::map<std::vector<std::size_t>, double> squares;
    const auto squaresWith = [&](std::vector<std::size_t> terms) {
      std::sort(terms.begin(), terms.end());
      const auto known = squares.find(terms);
      if (known != squares.end()) return known->second;
      GapModel model{selection.model.model.alignment, {}};
      for (const std::size_t term : terms) model.terms.push_back(selection.model.model.terms[term]);
      double sum = 0.0;
      for (const Vector6d& left : whitenedResiduals(search.physics(), search.fitted(model), search.whitening()))
        sum += left.squaredNorm();
      return squares[terms] = sum;
    };
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::vector<double> expected(n, 0.0);
    double n_orders = 0.0;
    do {
      std::vector<std::size_t> added;
      for (const std::size_t term : order) {
        const double before = squaresWith(added);
        added.push_back(term);
        expected[term] += before - squaresWith(added);
      }
      ++n_orders;
    } while (std::next_permutation(order.begin(), order.end()));
    const double total = squaresWith({}) - squaresWith(order);
    const std::vector<double> seen = gap::creditShares(search, selection);
    QCOMPARE(seen.size(), n);
    for (std::size_t term = 0; term < n; ++term)
      FT_VERIFY_MATCH(near(seen[term], expected[term] / n_orders / total, 1e-6));
    FT_VERIFY_MATCH(near(std::accumulate(seen.begin(), seen.end(), 0.0), 1.0, 1e-9));
  }

  void oneEffectTakesAll() {
    simulation::Scene scene = gapScene();
    scene.effects = {{"global_gain", nlohmann::json::parse(R"({"gain": 0.02})")}};
    const CalibrationTable table = recordedIn(scene, gapPlan());
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const EffectSelection selection = selectEffects(search, {}, {});
    QCOMPARE(selection.ways.size(), std::size_t{1});
    QVERIFY(gap::creditShares(search, selection) == std::vector<double>{1.0});
  }
};

FIELDTRUE_TEST(CreditTest)
#include "credit_test.moc"
