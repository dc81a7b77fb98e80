#include "calib/identify/linearized_model.h"

#include <QTest>
#include <cmath>

#include "calib/identify/ranking.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

GapRows turnedRows() {
  const GapPlan plan{.counts = {4, 3, 3}, .pitch_m = 0.2, .orientations = threeTurns()};
  const CalibrationTable table = recordedIn(gapScene(), gapPlan(plan));
  return makeGapRows(table.nodes, table.metadata).value();
}

/// Whitened residuals of a model as one column, in the order of a linearised one.
Eigen::VectorXd residualsOf(const GapSearch& search, const GapModel& model, std::span<const std::size_t> order) {
  const std::vector<Vector6d> left = whitenedResiduals(search.physics(), model, search.whitening());
  Eigen::VectorXd column(6 * static_cast<Eigen::Index>(left.size()));
  for (std::size_t k = 0; k < order.size(); ++k) column.segment<6>(6 * static_cast<Eigen::Index>(k)) = left[order[k]];
  return column;
}

/// What a change of a model does to its residuals, by a difference about the middle: columns are the negative of it.
template <class Change>
Eigen::VectorXd differenceBy(const GapSearch& search, const GapModel& at, std::span<const std::size_t> order,
                             double step, Change change) {
  GapModel ahead = at;
  GapModel behind = at;
  change(ahead, step);
  change(behind, -step);
  return (residualsOf(search, behind, order) - residualsOf(search, ahead, order)) / (2.0 * step);
}

Match isNearly(const Eigen::VectorXd& seen, const Eigen::VectorXd& expected, double share) {
  const double off = (seen - expected).norm();
  return {off <= share * expected.norm() + 1e-6,
          QByteArray::number(off) + " off a column of length " + QByteArray::number(expected.norm())};
}

/// What no dipole makes of the field is left out of the columns.
constexpr double kInABentField = 0.2;

/// The middle one of the starts that are allowed.
Eigen::VectorXd middleStart(const effects::EffectFit& fit) {
  std::vector<Eigen::VectorXd> starts = fit.starts();
  std::erase_if(starts, [&](const Eigen::VectorXd& start) { return !fit.allows(start); });
  return starts[starts.size() / 2];
}

}  // namespace

/// The linearised model against the tracker's own nonlinear solution.
class LinearizedModelTest : public QObject {
  Q_OBJECT
 private slots:
  void columnsOfEveryEffectAreDifferences() {
    const GapRows rows = turnedRows();
    const GapSearch search(rows, {});
    const GapModel& none = search.none().model;
    const Linearized at(search.physics(), none, search.whitening(), search.spaceBlocks());
    std::size_t n_compared = 0;
    for (const EffectWay& way : search.ways()) {
      const std::vector<effects::FitParameter> linear = way.fit->linear();
      const Eigen::VectorXd searched = middleStart(*way.fit);
      const Eigen::MatrixXd columns = at.columns(*way.fit, searched);
      for (std::size_t j = 0; j < linear.size(); ++j) {
        const auto of = static_cast<Eigen::Index>(j);
        // A change of a hundredth of the noise's length, so that what is not linear in it is a hundredth of that.
        const double length = columns.col(of).norm();
        if (length == 0.0) continue;
        const Eigen::VectorXd seen =
            differenceBy(search, none, at.order(), 0.01 / length, [&](GapModel& model, double step) {
              Eigen::VectorXd x = Eigen::VectorXd::Zero(columns.cols());
              x[of] = step;
              model.terms.push_back({way.effect, way.fit, searched, x});
            });
        // The columns are taken where the model is, a response to a bent pose half way: none is bent here.
        FT_VERIFY_MATCH(isNearly(columns.col(of), seen, 0.02));
        ++n_compared;
      }
    }
    QVERIFY2(n_compared > 20, qPrintable(QString::number(n_compared)));
  }

  void columnsOfTheAlignmentAreDifferences() {
    const GapRows rows = turnedRows();
    const GapSearch search(rows, {});
    const GapModel& none = search.none().model;
    const Linearized at(search.physics(), none, search.whitening(), search.spaceBlocks());
    const Eigen::Vector3d center_m = alignmentCenter_m(at.settings());
    QCOMPARE(at.nAlignment(), 12);  // Shift, turn, mounting and arm.
    for (int k = 0; k < at.nAlignment(); ++k) {
      const Eigen::VectorXd seen = differenceBy(search, none, at.order(), 1e-5, [&](GapModel& model, double step) {
        const Eigen::VectorXd x = step * Eigen::VectorXd::Unit(at.nAlignment(), k);
        applyAlignmentStep(x, center_m, rows, model.alignment);
      });
      FT_VERIFY_MATCH(isNearly(at.nuisance().col(k), seen, 0.02));
    }
  }

  /// The searched parameters of a term too: a body of metal, its place moved.
  void columnsOfATermAreDifferences() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back(
        {"compact_metal", nlohmann::json::parse(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})")});
    const CalibrationTable table =
        recordedIn(scene, gapPlan({.counts = {4, 3, 3}, .pitch_m = 0.2, .orientations = threeTurns()}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const std::vector<TriedEffect> tried = rankEffects(search, search.none().model, {});
    QVERIFY(!tried.empty() && tried.front().is_refined);
    const GapModel& state = tried.front().model;
    const Linearized at(search.physics(), state, search.whitening(), search.spaceBlocks());
    const Eigen::Index n_linear = state.terms[0].linear.size();
    for (Eigen::Index d = 0; d < state.terms[0].searched.size(); ++d) {
      const Eigen::VectorXd column = at.nuisance().col(at.nAlignment() + n_linear + d);
      const Eigen::VectorXd seen =
          differenceBy(search, state, at.order(), 0.05 / column.norm(),
                       [&](GapModel& model, double step) { model.terms[0].searched[d] += step; });
      FT_VERIFY_MATCH(isNearly(column, seen, 0.05));
    }
  }

  /// Where the model's own floor bends poses by decimetres, a shift of the rig is not reported as it is.
  void columnsHoldOverAStrongFloor() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back({"metal_plane", nlohmann::json::parse(R"({"distance_m": 0.9, "strength": 0.8})")});
    const CalibrationTable table = recordedIn(scene, gapPlan({.counts = {6, 3, 3}, .pitch_m = 0.3}));
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const std::vector<TriedEffect> tried = rankEffects(search, search.none().model, {});
    QVERIFY(!tried.empty() && tried.front().is_refined);
    const GapModel& state = tried.front().model;
    QCOMPARE(state.terms[0].effect->id, std::string("metal_plane"));
    const Linearized at(search.physics(), state, search.whitening(), search.spaceBlocks());
    const Linearized as_it_is(search.physics(), {state.alignment, {}}, search.whitening(), search.spaceBlocks());
    const Eigen::Vector3d center_m = alignmentCenter_m(at.settings());
    double off = 0.0;
    double off_as_it_is = 0.0;
    for (int k = 0; k < at.nAlignment(); ++k) {
      const Eigen::VectorXd seen = differenceBy(search, state, at.order(), 1e-5, [&](GapModel& model, double step) {
        applyAlignmentStep(step * Eigen::VectorXd::Unit(at.nAlignment(), k), center_m, rows, model.alignment);
      });
      FT_VERIFY_MATCH(isNearly(at.nuisance().col(k), seen, kInABentField));
      off += (at.nuisance().col(k) - seen).norm();
      off_as_it_is += (as_it_is.nuisance().col(k) - seen).norm();
    }
    QVERIFY2(off < 0.5 * off_as_it_is, qPrintable(QString::number(off / off_as_it_is)));
    const Eigen::Index n_linear = state.terms[0].linear.size();
    for (Eigen::Index d = 0; d < state.terms[0].searched.size(); ++d) {
      const Eigen::VectorXd column = at.nuisance().col(at.nAlignment() + n_linear + d);
      const Eigen::VectorXd seen =
          differenceBy(search, state, at.order(), 0.05 / column.norm(),
                       [&](GapModel& model, double step) { model.terms[0].searched[d] += step; });
      FT_VERIFY_MATCH(isNearly(column, seen, kInABentField));
    }
  }

  void whiteningGivesUnitVariance() {
    // One row of known noise: samples of 1, 2 and 3 mm an axis beside 2 mm of placing, 4 mrad beside 3.
    GapRow row;
    row.mean_covariance_m2 = Eigen::Vector3d(1e-6, 4e-6, 9e-6).asDiagonal();
    row.mean_rotation_variance_rad2 = 16e-6;
    GapRows rows;
    rows.rows = {row};
    const Whitening whitening = makeWhitening(rows, 0.002, 0.003);
    Vector6d residual;
    residual << std::sqrt(1e-6 + 4e-6), std::sqrt(4e-6 + 4e-6), std::sqrt(9e-6 + 4e-6), 0.005, -0.005, 0.010;
    const std::vector<Vector6d> white = whitened({residual}, whitening);
    const Vector6d expected = (Vector6d() << 1.0, 1.0, 1.0, 1.0, -1.0, 2.0).finished();
    for (int k = 0; k < 6; ++k) FT_VERIFY_MATCH(near(white[0][k], expected[k], 1e-6));
  }
};

FIELDTRUE_TEST(LinearizedModelTest)
#include "linearized_model_test.moc"
