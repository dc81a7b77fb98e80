#include "calib/identify/joint_fit.h"

#include <QTest>
#include <algorithm>
#include <cmath>

#include "calib/identify/ranking.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

class JointFitTest : public QObject {
  Q_OBJECT
 private slots:
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

FIELDTRUE_TEST(JointFitTest)
#include "joint_fit_test.moc"
