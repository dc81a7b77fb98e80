#include "calib/correctors/automatic_blend.h"

#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

using Errors = std::vector<Eigen::Vector3d>;

std::vector<AutomaticCandidate> candidatesOf(const std::vector<std::string>& ids) {
  std::vector<AutomaticCandidate> candidates;
  for (const std::string& id : ids) {
    const PositionMethod* method = findPositionMethod(id).value();
    candidates.push_back({method, settingsOf(*method), id, 0});
  }
  return candidates;
}

/// Scores of candidates from what each errs by in every row; each row a place.
std::vector<InnerScore> scoresOf(const std::vector<Errors>& errors_m) {
  std::vector<InnerScore> scores;
  for (const Errors& of_one : errors_m) {
    InnerScore score;
    score.squares_m2.assign(of_one.size(), 0.0);
    score.residual_m.assign(of_one.size(), Eigen::Vector3d::Zero());
    score.row_residual_m.assign(of_one.size(), Eigen::Vector3d::Zero());
    for (std::size_t row = 0; row < of_one.size(); ++row) score.add(row, row, of_one[row], 1.0);
    scores.push_back(std::move(score));
  }
  return scores;
}

Errors everywhere(std::size_t n, const Eigen::Vector3d& error_m) { return Errors(n, error_m); }

Errors scattered(std::size_t n, double sd_m, unsigned seed) {
  RandomGeometry random(seed);
  Errors errors;
  for (std::size_t i = 0; i < n; ++i)
    errors.emplace_back(sd_m * random.normal(), sd_m * random.normal(), sd_m * random.normal());
  return errors;
}

double sumOfSquares(const Errors& a, const Errors& b, double weight_of_a, const std::vector<std::size_t>& rows) {
  double sum = 0.0;
  for (const std::size_t row : rows) sum += (weight_of_a * a[row] + (1.0 - weight_of_a) * b[row]).squaredNorm();
  return sum;
}

/// Every place stands for as much of the region as any other.
InnerFolds alikeFolds(const FitData& data) {
  InnerFolds folds = innerFolds(data);
  std::fill(folds.shares.begin(), folds.shares.end(), 1.0);
  return folds;
}

FitData someData() { return fitDataOf(shakenGrid({3, 3, 3}, 0.2, 0.02), nothing_m); }

}  // namespace

class AutomaticBlendTest : public QObject {
  Q_OBJECT
 private slots:
  /// Errors at right angles of 1 and 2 mm: weights w and 1 - w leave w^2 + 4 (1 - w)^2, least 0.8 at w = 0.8.
  void errorsAtRightAnglesAreMixedByTheirSquares() {
    const FitData data = someData();
    const auto blend = blendCandidates(
        candidatesOf({"affine", "rbf"}),
        scoresOf({everywhere(data.size(), {0.001, 0.0, 0.0}), everywhere(data.size(), {0.0, 0.002, 0.0})}), data,
        alikeFolds(data));
    QVERIFY(blend);
    QVERIFY((blend->members == std::vector<std::size_t>{0, 1}));
    FT_VERIFY_MATCH(near(blend->weights[0], 0.8, 1e-9));
    FT_VERIFY_MATCH(near(blend->weights[1], 0.2, 1e-9));
    FT_VERIFY_MATCH(near(blend->score.rms_m(), std::sqrt(0.8) * 0.001, 1e-12));
    FT_VERIFY_MATCH(near(blend->score.residual_m[5], Eigen::Vector3d(0.0008, 0.0004, 0.0), 1e-12));
  }

  /// Two places of which the first stands for three quarters: errors of 1 and 2 at one, of 2 and 1 at the other, at
  /// right angles, leave w^2 (3 + 4) / 4 + (1 - w)^2 (12 + 1) / 4, least at w = 13 / 20.
  void placesCountForWhatTheyStandFor() {
    const FitData data = someData();
    InnerFolds folds = innerFolds(data);
    Errors a, b;
    for (std::size_t row = 0; row < data.size(); ++row) {
      const bool is_first = row % 2 == 0;
      folds.shares[row] = is_first ? 0.75 / 14.0 : 0.25 / 13.0;
      a.emplace_back(is_first ? 0.001 : 0.002, 0.0, 0.0);
      b.emplace_back(0.0, is_first ? 0.002 : 0.001, 0.0);
    }
    const auto blend = blendCandidates(candidatesOf({"affine", "rbf"}), scoresOf({a, b}), data, folds);
    QVERIFY(blend);
    FT_VERIFY_MATCH(near(blend->weights[0], 13.0 / 20.0, 1e-9));
  }

  void noWeightIsBelowZero() {
    const FitData data = someData();
    // The second errs as the first does, only farther: the best mean would be twice the first less the second.
    QVERIFY(!blendCandidates(
        candidatesOf({"affine", "rbf"}),
        scoresOf({everywhere(data.size(), {0.001, 0.0, 0.0}), everywhere(data.size(), {0.002, 0.0, 0.0})}), data,
        alikeFolds(data)));
  }

  void oneCandidateOfAMethodTakesPart() {
    const FitData data = someData();
    QVERIFY(!blendCandidates(
        candidatesOf({"rbf", "rbf"}),
        scoresOf({everywhere(data.size(), {0.001, 0.0, 0.0}), everywhere(data.size(), {0.0, 0.002, 0.0})}), data,
        alikeFolds(data)));
  }

  void skippedCandidatesTakeNoPart() {
    const FitData data = someData();
    auto scores = scoresOf({everywhere(data.size(), {0.001, 0.0, 0.0}), everywhere(data.size(), {0.0, 0.002, 0.0})});
    scores[1] = {};
    scores[1].skipped = "cannot";
    QVERIFY(!blendCandidates(candidatesOf({"affine", "rbf"}), scores, data, alikeFolds(data)));
  }

  /// The weights of each fold come from the others. Searched for here in steps of 1e-4.
  void aFoldIsJudgedByWeightsThatDidNotSeeIt() {
    const FitData data = someData();
    const auto folds = alikeFolds(data);
    const Errors a = scattered(data.size(), 0.001, 3), b = scattered(data.size(), 0.0015, 4);
    const auto blend = blendCandidates(candidatesOf({"affine", "rbf"}), scoresOf({a, b}), data, folds);
    QVERIFY(blend);
    for (const auto& fold : folds.rows) {
      std::vector<std::size_t> others;
      for (std::size_t row = 0; row < data.size(); ++row)
        if (!std::binary_search(fold.begin(), fold.end(), row)) others.push_back(row);
      double weight = 0.0;
      for (int step = 0; step <= 10000; ++step)
        if (sumOfSquares(a, b, 1e-4 * step, others) < sumOfSquares(a, b, weight, others)) weight = 1e-4 * step;
      for (const std::size_t row : fold)
        FT_VERIFY_MATCH(near(blend->score.row_residual_m[row], weight * a[row] + (1.0 - weight) * b[row], 1e-6));
    }
  }

  void aPlaceCountsOnceHoweverOftenItWasVisited() {
    FitData data = someData();
    // Three visits of the first place and one of each other one.
    data.node[1] = data.node[2] = data.node[0];
    auto errors_a = everywhere(data.size(), {0.001, 0.0, 0.0}), errors_b = everywhere(data.size(), {0.0, 0.001, 0.0});
    for (std::size_t row = 0; row < 3; ++row) {
      errors_a[row] *= 5.0;
      errors_b[row] *= 0.0;
    }
    const auto blend =
        blendCandidates(candidatesOf({"affine", "rbf"}), scoresOf({errors_a, errors_b}), data, alikeFolds(data));
    QVERIFY(blend);
    // 25 places: one of 25 (mm2) and 24 of 1 against 24 of 1: weights as 24 to 49.
    FT_VERIFY_MATCH(near(blend->weights[0], 24.0 / 73.0, 1e-9));
  }

  void itIsWorthItsPartsFromFivePercentOn() {
    const auto scoreOf = [](double error_m) { return scoresOf({everywhere(10, {error_m, 0.0, 0.0})}).front(); };
    QVERIFY(isWorthBlending(scoreOf(0.00094), scoreOf(0.001)));
    QVERIFY(!isWorthBlending(scoreOf(0.00096), scoreOf(0.001)));
  }

  /// Half the error at one place of twenty, and a twentieth more at all others.
  void itIsNotWorthThemForOnePlaceThatCarriesTheSquares() {
    const auto scoreOf = [](double most_m, double one_m) {
      std::vector<Eigen::Vector3d> errors_m = everywhere(20, {most_m, 0.0, 0.0});
      errors_m.front().x() = one_m;
      return scoresOf({errors_m}).front();
    };
    const InnerScore blend = scoreOf(0.00105, 0.005), alone = scoreOf(0.001, 0.010);
    QVERIFY(blend.rms_m() < 0.7 * alone.rms_m());
    QVERIFY(!isWorthBlending(blend, alone));
  }

  void theModelIsTheMeanOfItsMembersAndComesBackToTheBit() {
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.02), [](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(0.02 * p.x() * p.x(), 0.03 * p.x() * p.z(), 0.02 * p.y() * p.y());
    });
    const auto candidates = candidatesOf({"affine", "gaussian_process"});
    const Eigen::Vector3d p_m(0.71, 0.13, 0.22);
    std::vector<BlendMember> members;
    Eigen::Vector3d expected_m = Eigen::Vector3d::Zero();
    double uncertainty_m = 0.0;
    for (const double weight : {0.25, 0.75}) {
      const AutomaticCandidate& candidate = candidates[members.size()];
      auto model = candidate.method->fit(data, candidate.settings, {});
      FT_VERIFY_OK(model);
      expected_m += weight * (*model)->displacement_m(p_m);
      uncertainty_m += weight * (*model)->uncertainty_m(p_m).value_or(HUGE_VAL);
      members.push_back({candidate.method->id, toJson(candidate.settings), weight, *std::move(model)});
    }
    const auto blend = makeBlend(std::move(members));
    FT_VERIFY_MATCH(near(blend->displacement_m(p_m), expected_m, 1e-15));
    FT_VERIFY_MATCH(near(blend->uncertainty_m(p_m).value_or(HUGE_VAL), uncertainty_m, 1e-15));
    const auto again =
        readJson<std::unique_ptr<PositionModel>>(nlohmann::json::parse(blend->parameters().dump()), "blend", readBlend);
    FT_VERIFY_OK(again);
    QCOMPARE((*again)->parameters().dump(), blend->parameters().dump());
    QVERIFY((*again)->displacement_m(p_m) == blend->displacement_m(p_m));

    nlohmann::json wrong = blend->parameters();
    wrong["members"][0]["weight"] = 0.5;
    const auto refused = readJson<std::unique_ptr<PositionModel>>(wrong, "blend", readBlend);
    QVERIFY(!refused);
    FT_VERIFY_MATCH(holdsAll(refused.error().message, {"members", "sum to 1"}));
    wrong = blend->parameters();
    wrong["members"][0]["method"] = "auto";
    QVERIFY(!readJson<std::unique_ptr<PositionModel>>(wrong, "blend", readBlend));
    wrong["members"] = nlohmann::json::array();
    QVERIFY(!readJson<std::unique_ptr<PositionModel>>(wrong, "blend", readBlend));
  }
};

FIELDTRUE_TEST(AutomaticBlendTest)
#include "automatic_blend_test.moc"
