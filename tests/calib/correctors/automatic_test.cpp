#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/correctors/automatic_choice.h"
#include "calib/correctors/base/fit_rows.h"
#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

Eigen::Vector3d quadratic_m(const Eigen::Vector3d& p) {
  return {0.02 * p.x() * p.x() - 0.01 * p.y(), 0.03 * p.x() * p.z(), 0.02 * p.y() * p.y() + 0.01 * p.z() * p.x()};
}

/// A bump a few spacings wide, which no polynomial of low degree follows.
Eigen::Vector3d bump_m(const Eigen::Vector3d& p) {
  const double near = std::exp(-12.0 * (p - Eigen::Vector3d(0.9, 0.2, 0.1)).squaredNorm());
  return near * Eigen::Vector3d(0.03, -0.02, 0.01);
}

FitData noisy(const Displacement& displacement_m, double noise_m, unsigned seed,
              std::array<int, 3> counts = {5, 5, 5}) {
  RandomGeometry random(seed);
  FitData data = fitDataOf(shakenGrid(counts, 0.2, 0.02), displacement_m);
  for (Eigen::Vector3d& truth_m : data.p_true_m)
    truth_m += noise_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  return data;
}

std::vector<AutomaticCandidate> ranked(const std::vector<int>& complexities) {
  std::vector<AutomaticCandidate> candidates;
  for (const int complexity : complexities) candidates.push_back({nullptr, {}, "", complexity});
  return candidates;
}

double freshError_m(const PositionModel& model, const Displacement& truth_m) {
  RandomGeometry random(99);
  double squares_m2 = 0.0;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d p_m(random.between(0.45, 1.35), random.between(-0.25, 0.65), random.between(-0.15, 0.55));
    const Eigen::Vector3d seen_m = model.covers(p_m) ? model.displacement_m(p_m) : Eigen::Vector3d::Zero();
    squares_m2 += (seen_m - truth_m(p_m)).squaredNorm();
  }
  return std::sqrt(squares_m2 / 400.0);
}

std::string chosen(const PositionModel& model) { return model.parameters().at("method").get<std::string>(); }

}  // namespace

class AutomaticTest : public QObject {
  Q_OBJECT
 private slots:
  void takesTheSimplestWithinOneStandardError_data() {
    QTest::addColumn<double>("excess");
    QTest::addColumn<double>("scatter");
    QTest::addColumn<int>("expected");
    // Differences excess +- scatter over 100 places: standard error scatter / sqrt(99).
    QTest::newRow("within") << 0.09 << 1.0 << 1;
    QTest::newRow("beyond") << 0.11 << 1.0 << 2;
    QTest::newRow("the same at every place, yet more") << 0.01 << 0.0 << 2;
    QTest::newRow("better itself") << -0.5 << 0.1 << 1;
  }
  void takesTheSimplestWithinOneStandardError() {
    QFETCH(double, excess);
    QFETCH(double, scatter);
    QFETCH(int, expected);
    std::vector<InnerScore> scores(3);
    for (int i = 0; i < 100; ++i) {
      scores[0].squares_m2.push_back(20.0);
      scores[1].squares_m2.push_back(4.0 + excess + (i % 2 == 0 ? scatter : -scatter));
      scores[2].squares_m2.push_back(4.0);
    }
    QCOMPARE(chooseCandidate(ranked({0, 3, 10}), scores).candidate, static_cast<std::size_t>(expected));
  }

  void staysWithNoneUnlessTheGainIsClear_data() {
    QTest::addColumn<double>("left");
    QTest::addColumn<double>("scatter");
    QTest::addColumn<int>("expected");
    QTest::newRow("RMS lower by 4 %") << 0.96 * 0.96 << 0.0 << 0;
    QTest::newRow("RMS lower by 6 %") << 0.94 * 0.94 << 0.0 << 1;
    // Gain 0.5 with standard error 3.2 / sqrt(99) = 0.322, 1.55 of it; and 2.9 / sqrt(99) = 0.291, 1.72 of it. Carried
    // by one place in four, while the others lose: signed ranks are against it.
    QTest::newRow("1.55 standard errors") << 0.5 << 3.2 << 0;
    QTest::newRow("1.72 standard errors") << 0.5 << 2.9 << 1;
  }
  void staysWithNoneUnlessTheGainIsClear() {
    QFETCH(double, left);
    QFETCH(double, scatter);
    QFETCH(int, expected);
    std::vector<InnerScore> scores(2);
    for (int i = 0; i < 100; ++i) {
      scores[0].squares_m2.push_back(1.0 + scatter * (i % 4 == 0 ? std::sqrt(3.0) : -std::sqrt(1.0 / 3.0)));
      scores[1].squares_m2.push_back(left);
    }
    QCOMPARE(chooseCandidate(ranked({0, 3}), scores).candidate, static_cast<std::size_t>(expected));
  }

  /// Two places of fifty carry the squares, so the gain is 1.4 standard errors, and half of the others err more; yet
  /// where it moves far the correction points to where the place errs: cosines of 1 at two, of 1 and -1 in turn at 48,
  /// weights 10, 10 and 48 times 0.1.
  void aCorrectionThatPointsTheRightWayIsBelieved_data() {
    QTest::addColumn<double>("turned");
    QTest::addColumn<int>("expected");
    // Sum of lengths 20 over sqrt((200 + 0.48) / 3) = 8.17: 2.45 SDs, of the 2.326 that are asked for; 2.12 of them.
    QTest::newRow("towards the errors") << 1.0 << 1;
    QTest::newRow("30 degrees off") << std::sqrt(0.75) << 0;
  }
  void aCorrectionThatPointsTheRightWayIsBelieved() {
    QFETCH(double, turned);
    QFETCH(int, expected);
    std::vector<InnerScore> scores(2);
    for (int i = 0; i < 50; ++i) {
      const bool carries = i < 2;
      const Eigen::Vector3d before_m(carries ? 20.0 : 1.0, 0.0, 0.0);
      const Eigen::Vector3d move_m = carries ? 10.0 * Eigen::Vector3d(turned, std::sqrt(1.0 - turned * turned), 0.0)
                                             : Eigen::Vector3d(i % 2 == 0 ? 0.1 : -0.1, 0.0, 0.0);
      scores[0].residual_m.push_back(before_m);
      scores[1].residual_m.push_back(before_m - move_m);
    }
    for (InnerScore& score : scores)
      for (const Eigen::Vector3d& residual_m : score.residual_m) score.squares_m2.push_back(residual_m.squaredNorm());
    QCOMPARE(chooseCandidate(ranked({0, 3}), scores).candidate, static_cast<std::size_t>(expected));
  }

  /// Of fifty places two carry the squares, 400 each before, 300 and 430 after: the mean gains 1.7 with a standard
  /// error of 2, the RMS 5 %. Places 3 to 50 gain or lose 0.50, 0.51, ...: all gained, the signed ranks sum up to 1275
  /// - 2 x 49, which is 5.7 times sqrt(50 x 51 x 101 / 6); in turn, to next to nothing.
  void aCorrectionThatErrsLessAtMostPlacesIsBelieved_data() {
    QTest::addColumn<bool>("all");
    QTest::addColumn<int>("expected");
    QTest::newRow("at all but one") << true << 1;
    QTest::newRow("at every other") << false << 0;
  }
  void aCorrectionThatErrsLessAtMostPlacesIsBelieved() {
    QFETCH(bool, all);
    QFETCH(int, expected);
    std::vector<InnerScore> scores(2);
    scores[0].squares_m2 = {400.0, 400.0};
    scores[1].squares_m2 = {300.0, 430.0};
    for (int i = 0; i < 48; ++i) {
      const double gain_m2 = (all || i % 2 == 0 ? 1.0 : -1.0) * (0.5 + 0.01 * i);
      scores[0].squares_m2.push_back(2.0);
      scores[1].squares_m2.push_back(2.0 - gain_m2);
    }
    QVERIFY(scores[1].rms_m() < 0.97 * scores[0].rms_m());
    QCOMPARE(chooseCandidate(ranked({0, 3}), scores).candidate, static_cast<std::size_t>(expected));
  }

  /// Fifty places; far off ones err by 20 before and by sqrt(500) after, the others by 1 before. Two far off: the mean
  /// square is more by (2 x 100 - 48 x 0.75) / 50 = 3.3 with a standard error of 2.8, so the squares cannot tell; the
  /// corrections are 48 of 0.5 towards the truth and two of 2.36 away from it, (24 - 4.7) / sqrt((12 + 11.1) / 3) = 6.9
  /// SDs of chance. Four: more by 7.3 with 3.9, which is clear. Corrected by 2.1, the others end 1.1 beyond the truth.
  void mostPlacesDecideWhereSquaresCannot_data() {
    QTest::addColumn<int>("n_far_off");
    QTest::addColumn<double>("move");
    QTest::addColumn<int>("expected");
    QTest::newRow("squares cannot tell") << 2 << 0.5 << 1;
    QTest::newRow("clearly worse by squares") << 4 << 0.5 << 0;
    QTest::newRow("right directions, yet worse at most places") << 2 << 2.1 << 0;
  }
  void mostPlacesDecideWhereSquaresCannot() {
    QFETCH(int, n_far_off);
    QFETCH(double, move);
    QFETCH(int, expected);
    std::vector<InnerScore> scores(2);
    for (int i = 0; i < 50; ++i) {
      const bool is_far_off = i < n_far_off;
      scores[0].residual_m.emplace_back(is_far_off ? 20.0 : 1.0, 0.0, 0.0);
      scores[1].residual_m.emplace_back(is_far_off ? std::sqrt(500.0) : 1.0 - move, 0.0, 0.0);
    }
    for (InnerScore& score : scores)
      for (const Eigen::Vector3d& residual_m : score.residual_m) score.squares_m2.push_back(residual_m.squaredNorm());
    QVERIFY(scores[1].rms_m() > scores[0].rms_m());
    const AutomaticDecision decision = chooseCandidate(ranked({0, 3}), scores);
    QCOMPARE(decision.candidate, static_cast<std::size_t>(expected));
    QCOMPARE(decision.is_despite_squares, expected == 1);
  }

  /// One that leaves 1 at most of fifty places and 60 at a few, beside an equally simple one that leaves 2 everywhere:
  /// its mean square is more by 0.18 with a standard error of 1.2, or, with eight, by 8.4 with one of 3.1.
  void equallySimpleOnesAreToldApartByMostPlaces_data() {
    QTest::addColumn<int>("n_far_off");
    QTest::addColumn<int>("expected");
    QTest::newRow("one far off") << 1 << 1;
    QTest::newRow("eight far off") << 8 << 2;
  }
  void equallySimpleOnesAreToldApartByMostPlaces() {
    QFETCH(int, n_far_off);
    QFETCH(int, expected);
    std::vector<InnerScore> scores(3);
    for (int i = 0; i < 50; ++i) {
      scores[0].squares_m2.push_back(100.0);
      scores[1].squares_m2.push_back(i < n_far_off ? 60.0 : 1.0 + 0.001 * i);
      scores[2].squares_m2.push_back(2.0);
    }
    QCOMPARE(chooseCandidate(ranked({0, 5, 5}), scores).candidate, static_cast<std::size_t>(expected));
  }

  /// 80 places at the edge stand for a fifth of the region, 20 inside for the rest: mean squares of
  /// 0.2 * 1 + 0.8 * 9 against 0.2 * 16 + 0.8 * 1; counted alike the first would be the better one.
  void placesCountForWhatTheyStandFor() {
    std::vector<InnerScore> scores(3);
    for (int i = 0; i < 100; ++i) {
      const bool is_edge = i < 80;
      scores[0].squares_m2.push_back(100.0);
      scores[1].squares_m2.push_back(is_edge ? 1.0 : 9.0);
      scores[2].squares_m2.push_back(is_edge ? 16.0 : 1.0);
    }
    QCOMPARE(chooseCandidate(ranked({0, 5, 5}), scores).candidate, std::size_t{1});
    for (InnerScore& score : scores) {
      score.shares.assign(80, 0.2 / 80.0);
      score.shares.insert(score.shares.end(), 20, 0.8 / 20.0);
    }
    FT_VERIFY_MATCH(near(scores[1].rms_m(), std::sqrt(7.4), 1e-12));
    FT_VERIFY_MATCH(near(scores[2].rms_m(), 2.0, 1e-12));
    QCOMPARE(chooseCandidate(ranked({0, 5, 5}), scores).candidate, std::size_t{2});
  }

  void skippedCandidatesAreNeverChosen() {
    std::vector<InnerScore> scores(3);
    scores[0].squares_m2 = std::vector<double>(50, 1.0);
    scores[1].skipped = "cannot";
    scores[2].squares_m2 = std::vector<double>(50, 0.1);
    QCOMPARE(chooseCandidate(ranked({0, 1, 2}), scores).candidate, std::size_t{2});
  }

  void foldsHoldEveryRowOnceAndNoPlaceTwice() {
    FitData data = noisy(nothing_m, 0.001, 1, {6, 6, 5});
    for (std::size_t row = 0; row < data.size(); ++row) data.node[row] = static_cast<int>(row / 2);
    const auto folds = innerFolds(data).rows;
    QCOMPARE(folds.size(), std::size_t{5});
    std::set<std::size_t> rows;
    std::map<int, std::set<std::size_t>> folds_of_place;
    for (std::size_t k = 0; k < folds.size(); ++k) {
      QVERIFY(std::is_sorted(folds[k].begin(), folds[k].end()));
      QCOMPARE(folds[k].size(), data.size() / 5);
      for (const std::size_t row : folds[k]) {
        QVERIFY(rows.insert(row).second);
        folds_of_place[data.node[row]].insert(k);
      }
    }
    QCOMPARE(rows.size(), data.size());
    for (const auto& [place, in] : folds_of_place) QCOMPARE(in.size(), std::size_t{1});
    QVERIFY(innerFolds(data).rows == folds);
    const FitData few = rowsOfFitData(data, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
    QCOMPARE(innerFolds(few).rows.size(), std::size_t{5});
  }

  void candidatesAreThoseOfTheSetAndNeverItself() {
    const auto idsOf = [](CandidateSet set) {
      std::set<std::string> ids;
      for (const AutomaticCandidate& candidate : automaticCandidates(set)) ids.insert(candidate.method->id);
      return ids;
    };
    const auto survey = idsOf(CandidateSet::kSurvey), ours = idsOf(CandidateSet::kOurs),
               all = idsOf(CandidateSet::kAll);
    for (const std::string id : {"none", "rigid", "affine"}) QVERIFY(survey.contains(id) && ours.contains(id));
    for (const std::string id : {"polynomial", "hmq"}) QVERIFY(survey.contains(id) && !ours.contains(id));
    for (const std::string id : {"rbf", "gaussian_process", "bspline"})
      QVERIFY(!survey.contains(id) && ours.contains(id));
    QVERIFY(!all.contains("auto"));
    QCOMPARE(all.size(), survey.size() + ours.size() - 3);
    QCOMPARE(automaticCandidates(CandidateSet::kAll).front().method->id, std::string("none"));
  }

  void innerScoresAreThoseOfRefits_data() {
    QTest::addColumn<QString>("id");
    for (const char* id : {"none", "affine", "polynomial", "rbf", "gaussian_process", "tetrahedral"})
      QTest::newRow(id) << id;
  }
  void innerScoresAreThoseOfRefits() {
    QFETCH(QString, id);
    const FitData data = noisy(quadratic_m, 0.002, 4);
    const auto folds = innerFolds(data);
    const PositionMethod& method = *findPositionMethod(id.toStdString()).value();
    const AutomaticCandidate candidate{&method, settingsOf(method), "", 0};
    const auto score = scoreCandidate(candidate, data, folds, nullptr, {});
    FT_VERIFY_OK(score);
    QVERIFY(!score->skipped);
    for (const auto& fold : folds.rows) {
      std::vector<std::size_t> kept;
      for (std::size_t row = 0; row < data.size(); ++row)
        if (!std::binary_search(fold.begin(), fold.end(), row)) kept.push_back(row);
      const auto model = method.fit(rowsOfFitData(data, kept), candidate.settings, {});
      FT_VERIFY_OK(model);
      for (const std::size_t row : fold) {
        const Eigen::Vector3d& p_m = data.p_tracked_m[row];
        const double expected_m2 = (p_m + (*model)->displacement_m(p_m) - data.p_true_m[row]).squaredNorm();
        FT_VERIFY_MATCH(near(score->squares_m2[row], expected_m2, 1e-9 * expected_m2 + 1e-18));
      }
    }
  }

  void aCostlyMethodThatIsClearlyWorseIsDroppedEarly() {
    const FitData data = noisy(quadratic_m, 0.0005, 4);
    const auto folds = innerFolds(data);
    PositionMethod costly = *findPositionMethod("none").value();
    costly.hold_out = nullptr;
    costly.cost = FitCost::kCostly;
    const PositionMethod& good = *findPositionMethod("polynomial").value();
    const auto best = scoreCandidate({&good, settingsOf(good), "", 0}, data, folds, nullptr, {});
    FT_VERIFY_OK(best);
    const auto dropped = scoreCandidate({&costly, {}, "", 0}, data, folds, &*best, {});
    FT_VERIFY_OK(dropped);
    QVERIFY(dropped->skipped);
    FT_VERIFY_MATCH(holdsAll(*dropped->skipped, {"1 of 5 folds"}));
    // Against something as bad as itself it is scored to its end, on the folds of all.
    const auto alone = scoreCandidate({&costly, {}, "", 0}, data, folds, nullptr, {});
    FT_VERIFY_OK(alone);
    QVERIFY(!alone->skipped);
    const auto equal = scoreCandidate({&costly, {}, "", 0}, data, folds, &*alone, {});
    FT_VERIFY_OK(equal);
    QVERIFY(!equal->skipped);
    QCOMPARE(equal->squares_m2.size(), data.size());
    for (const double square_m2 : equal->squares_m2) QVERIFY(std::isfinite(square_m2));
  }

  void pureNoiseIsLeftAlone_data() {
    QTest::addColumn<int>("seed");
    for (int seed = 1; seed <= 4; ++seed) QTest::addRow("seed %d", seed) << seed;
  }
  void pureNoiseIsLeftAlone() {
    QFETCH(int, seed);
    const auto model = fitPosition("auto", noisy(nothing_m, 0.003, static_cast<unsigned>(seed)));
    FT_VERIFY_OK(model);
    QCOMPARE(chosen(**model), std::string("none"));
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"Chosen: No correction"}));
  }

  void errsNoMoreThanTheBestCandidateAllows_data() {
    QTest::addColumn<bool>("is_bump");
    QTest::addColumn<double>("tolerance");
    // The quadratic field is a candidate's own. For the bump, one standard error may cost more.
    QTest::newRow("quadratic field") << false << 1.05;
    QTest::newRow("narrow bump") << true << 1.3;
  }
  void errsNoMoreThanTheBestCandidateAllows() {
    QFETCH(bool, is_bump);
    QFETCH(double, tolerance);
    const Displacement truth_m = is_bump ? Displacement(bump_m) : Displacement(quadratic_m);
    const FitData data = noisy(truth_m, 0.0005, 21);
    const auto model = fitPosition("auto", data);
    FT_VERIFY_OK(model);
    double best_m = HUGE_VAL, linear_m = HUGE_VAL;
    for (const AutomaticCandidate& candidate : automaticCandidates(CandidateSet::kAll)) {
      const auto fitted = candidate.method->fit(data, candidate.settings, {});
      if (!fitted) continue;
      best_m = std::min(best_m, freshError_m(**fitted, truth_m));
      if (candidate.method->id == "affine") linear_m = freshError_m(**fitted, truth_m);
    }
    const double seen_m = freshError_m(**model, truth_m);
    QVERIFY2(seen_m <= tolerance * best_m,
             qPrintable(QString("%1 chosen: %2 against %3").arg(chosen(**model).c_str()).arg(seen_m).arg(best_m)));
    QVERIFY(seen_m < 0.5 * linear_m);
  }

  void choosesAmongTheSetAskedFor() {
    const FitData data = noisy(bump_m, 0.0005, 21);
    const auto survey = fitPosition("auto", data, {{"candidates", "survey"}});
    const auto ours = fitPosition("auto", data, {{"candidates", "ours"}});
    FT_VERIFY_OK(survey);
    FT_VERIFY_OK(ours);
    const auto textsOf = [](const PositionModel& model) {
      std::string texts;
      const nlohmann::json parameters = model.parameters();
      for (const nlohmann::json& row : parameters.at("candidates")) texts += row.at("method").get<std::string>() + " ";
      return texts;
    };
    FT_VERIFY_MATCH(holdsAll(textsOf(**survey), {"none", "polynomial:degree=4", "hmq"}));
    QVERIFY(textsOf(**survey).find("rbf") == std::string::npos);
    FT_VERIFY_MATCH(holdsAll(textsOf(**ours), {"none", "rbf", "gaussian_process", "bspline"}));
    QVERIFY(textsOf(**ours).find("polynomial") == std::string::npos);
  }

  void stopsOnRequestAndTellsHowFarItIs() {
    std::stop_source source;
    RunControl control;
    control.stop = source.get_token();
    double last = 0.0;
    control.progress = [&](double fraction) {
      QVERIFY(fraction >= last && fraction <= 1.0);
      last = fraction;
      if (fraction > 0.2) source.request_stop();
    };
    const PositionMethod& method = *findPositionMethod("auto").value();
    const auto stopped = method.fit(noisy(quadratic_m, 0.001, 3), settingsOf(method), control);
    QVERIFY(!stopped);
    QCOMPARE(stopped.error().code, ErrorCode::kCancelled);
    QVERIFY(last > 0.2 && last < 0.9);
  }

  void aFileCannotNameItselfOrAStranger() {
    const PositionMethod& method = *findPositionMethod("auto").value();
    nlohmann::json parameters = fitPosition("auto", noisy(quadratic_m, 0.001, 3)).value()->parameters();
    parameters["method"] = "auto";
    QVERIFY(!method.load(parameters));
    parameters["method"] = "stranger";
    QVERIFY(!method.load(parameters));
  }
};

FIELDTRUE_TEST(AutomaticTest)
#include "automatic_test.moc"
