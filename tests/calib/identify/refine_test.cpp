#include <QTest>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/identify/joint_fit.h"
#include "calib/identify/ranking.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

/// Draws of a Student t of three dimensions: a normal vector over the root of chi-square per degree of freedom.
std::vector<Vector6d> drawn(std::size_t count, double nu, double position_scale, double rotation_scale) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  std::chi_squared_distribution<double> chi_squared(nu);
  std::vector<Vector6d> rows(count);
  for (Vector6d& row : rows) {
    const double position = position_scale / std::sqrt(chi_squared(generator) / nu);
    const double rotation = rotation_scale / std::sqrt(chi_squared(generator) / nu);
    for (int k = 0; k < 6; ++k) row[k] = (k < 3 ? position : rotation) * normal(generator);
  }
  return rows;
}

/// -2 log of the density of a Student t of three dimensions (Kotz and Nadarajah 2004, eq. 1.1), summed over rows.
double minusTwiceLogDensity(std::span<const Vector6d> rows, Eigen::Index first, double nu, double scale) {
  double sum = 0.0;
  for (const Vector6d& row : rows) {
    const double d2 = row.segment<3>(first).squaredNorm() / (scale * scale);
    sum += std::lgamma(0.5 * (nu + 3.0)) - std::lgamma(0.5 * nu) - 1.5 * std::log(nu * std::numbers::pi) -
           3.0 * std::log(scale) - 0.5 * (nu + 3.0) * std::log1p(d2 / nu);
  }
  return -2.0 * sum;
}

/// Its least value over the scale, by halving a bracket of its logarithm.
double leastOverScale(std::span<const Vector6d> rows, Eigen::Index first, double nu) {
  double low = std::log(1e-3);
  double high = std::log(1e3);
  for (int step = 0; step < 200; ++step) {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    if (minusTwiceLogDensity(rows, first, nu, std::exp(a)) < minusTwiceLogDensity(rows, first, nu, std::exp(b)))
      high = b;
    else
      low = a;
  }
  return minusTwiceLogDensity(rows, first, nu, std::exp(low));
}

}  // namespace

class RefineTest : public QObject {
  Q_OBJECT
 private slots:
  void devianceIsThatOfTheDensity_data() {
    QTest::addColumn<double>("nu");
    QTest::newRow("heavy tails") << 3.0;
    QTest::newRow("light tails") << 8.0;
    QTest::newRow("nearly normal") << 100.0;
  }
  void devianceIsThatOfTheDensity() {
    QFETCH(double, nu);
    const std::vector<Vector6d> rows = drawn(300, nu, 1.7, 0.6);
    const Deviance seen = devianceOf(rows, true, {nu});
    // The power of pi is left out: the same for every model of the same rows.
    const double of_pi = 2.0 * 1.5 * std::log(std::numbers::pi) * static_cast<double>(rows.size());
    FT_VERIFY_MATCH(near(seen.value, leastOverScale(rows, 0, nu) + leastOverScale(rows, 3, nu) - 2.0 * of_pi, 1e-3));
    const Deviance positions = devianceOf(rows, false, {nu});
    FT_VERIFY_MATCH(near(positions.value, leastOverScale(rows, 0, nu) - of_pi, 1e-3));
    // 300 rows tell a scale to 4 %.
    FT_VERIFY_MATCH(near(seen.scale.position, 1.7, 0.2));
    FT_VERIFY_MATCH(near(seen.scale.rotation, 0.6, 0.07));
  }

  /// At a refined model no parameter can be moved for less cost.
  void jointFitIsAtAMinimum() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back(
        {"compact_metal", nlohmann::json::parse(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})")});
    const CalibrationTable table = recordedIn(scene, gapPlan({.orientations = threeTurns()}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const std::vector<TriedEffect> tried = rankEffects(search, search.none().model, {});
    QVERIFY(!tried.empty());
    const RefinedModel best = search.withCovariance(tried.front().model);
    QVERIFY(best.model.terms.size() == 1 && best.model.terms[0].effect->id == std::string("compact_metal"));
    const double least = search.bicOf(best.model);
    const GapTerm& term = best.model.terms[0];
    const Eigen::Index n_linear = term.linear.size();
    for (Eigen::Index k = 0; k < n_linear + term.searched.size(); ++k) {
      const Eigen::Index at = best.n_alignment + k;
      const double sd = std::sqrt(best.covariance(at, at));
      QVERIFY(sd > 0.0 && std::isfinite(sd));
      for (const double step : {-0.5 * sd, 0.5 * sd}) {
        GapModel moved = best.model;
        (k < n_linear ? moved.terms[0].linear[k] : moved.terms[0].searched[k - n_linear]) += step;
        QVERIFY2(search.bicOf(moved) > least - 0.02, qPrintable(QString("parameter %1").arg(k)));
      }
    }
    // One SD of one parameter, all others refitted, costs about 1 of minus twice the log likelihood.
    const double sd = std::sqrt(best.covariance(best.n_alignment + n_linear, best.n_alignment + n_linear));
    for (const double way : {-1.0, 1.0}) {
      GapModel moved = best.model;
      moved.terms[0].searched[0] += way * sd;
      const GapModel rest = search.fittedWithout(moved, best.n_alignment + n_linear);
      const double cost = search.bicOf(rest) - least;
      QVERIFY2(cost > 0.6 && cost < 1.6, qPrintable(QString::number(cost)));
    }
  }

  /// What is not the true cause leaves much, and its fit creeps along bent valleys: it ends at the same wherever along
  /// one of them it began.
  void slowFitsEndAlike_data() {
    QTest::addColumn<QString>("effect");
    for (const char* effect : {"finite_plate", "closed_loop", "compact_metal"}) QTest::newRow(effect) << effect;
  }
  void slowFitsEndAlike() {
    QFETCH(QString, effect);
    simulation::Scene scene = gapScene();
    for (int k = -3; k <= 3; ++k)  // A bar.
      scene.effects.push_back({"compact_metal",
                               {{"center_m", {1.6, 0.15, 0.14 * k}},
                                {"polarizability_m3", {{-0.02, 0.0, 0.0}, {0.0, -0.02, 0.0}, {0.0, 0.0, -0.01}}}}});
    const CalibrationTable table = recordedIn(scene, gapPlan({}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const std::vector<TriedEffect> tried = rankEffects(search, search.none().model, {});
    const auto one = std::find_if(tried.begin(), tried.end(), [&](const TriedEffect& other) {
      return other.model.terms.back().effect->id == effect.toStdString();
    });
    QVERIFY(one != tried.end());
    std::vector<double> bics;
    for (const double off_m : {0.05, 0.15, 0.3}) {
      GapModel start = one->model;
      start.terms.back().searched[0] += off_m;
      QVERIFY(start.terms.back().fit->allows(start.terms.back().searched));
      bics.push_back(search.bicOf(search.fitted(start)));
    }
    const auto [least, most] = std::minmax_element(bics.begin(), bics.end());
    const double gain = search.bicOf(search.none().model) - *least;
    QVERIFY2(gain > 1000.0 && *most - *least < 2.0, qPrintable(QString("%1 of %2").arg(*most - *least).arg(gain)));
  }

  /// A body nearer to a place than any is looked for draws its fit to the bound; the other body's fit goes on.
  void whatStandsAtItsBoundHoldsNoOther() {
    simulation::Scene scene = gapScene();
    const Pose tracker_from_rig = inverse(scene.reference_from_tracker);
    const Eigen::Vector3d far_m(1.3, 0.5, 0.3), near_m = tracker_from_rig * Eigen::Vector3d(0.4, 0.2, -0.05);
    const auto put = [&](const Eigen::Vector3d& at_m, double radius_m) {
      scene.effects.push_back(
          {"compact_metal", {{"center_m", {at_m.x(), at_m.y(), at_m.z()}}, {"radius_m", radius_m}}});
    };
    put(far_m, 0.12);
    put(near_m, 0.04);
    const CalibrationTable table = recordedIn(scene, gapPlan({}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const std::vector<TriedEffect> tried = rankEffects(search, search.none().model, {});
    const auto one = std::find_if(tried.begin(), tried.end(), [&](const TriedEffect& other) {
      return other.model.terms.back().effect->id == std::string("compact_metal");
    });
    QVERIFY(one != tried.end());
    std::vector<double> bics;
    for (const double off_m : {0.05, 0.1, 0.2}) {
      GapModel start = one->model;
      start.terms.push_back(start.terms.back());
      start.terms[0].searched.head<3>() = far_m + off_m * Eigen::Vector3d(1.0, -1.0, 0.5);
      start.terms[1].searched.head<3>() = near_m - tracker_from_rig.orientation * Eigen::Vector3d(0.0, 0.0, 0.06);
      start.terms[1].linear.setZero();
      for (const GapTerm& term : start.terms) QVERIFY(term.fit->allows(term.searched));
      bics.push_back(search.bicOf(search.fitted(start)));
    }
    const auto [least, most] = std::minmax_element(bics.begin(), bics.end());
    // Where along its bound the near body came to stand is worth some units; the far one left aside would be hundreds.
    QVERIFY2(*most - *least < 50.0, qPrintable(QString::number(*most - *least)));
  }

  void fitsAreKnownByStartAndRows() {
    const CalibrationTable table = recordedIn(gapScene(), gapPlan({}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    std::vector<char> half(rows.rows.size(), 0);
    std::fill(half.begin(), half.begin() + static_cast<std::ptrdiff_t>(half.size() / 2), 1);
    GapModel start = search.none().model;
    start.alignment.tracker_from_reference.position_m.x() += 0.01;
    for (int time = 0; time < 2; ++time) {
      for (const std::vector<char>& used : {std::vector<char>(), half}) {
        const GapModel anew = fitJointly(search.physics(), start, search.whitening(), {search.law(), used});
        QVERIFY(isSame(search.fitted(start, used), anew));
      }
    }
    QVERIFY(!isSame(search.fitted(start), search.fitted(start, half)));
  }
};

FIELDTRUE_TEST(RefineTest)
#include "refine_test.moc"
