#include "calib/correctors/automatic_evidence.h"

#include <QTest>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/base/method.h"
#include "calib/effects/compact_metal.h"
#include "calib/field/pose_solver.h"
#include "calib/field/tracker_model.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

using Errors = std::vector<Eigen::Vector3d>;

/// ln Gamma(3) - ln Gamma(3/2) - 3/2 ln(3 pi s2): the t's density at no error.
double densityAtNone(double variance_m2) {
  return std::log(2.0) - std::log(std::sqrt(M_PI) / 2.0) - 1.5 * std::log(3.0 * M_PI * variance_m2);
}

Errors along(const Eigen::Vector3d& direction, std::size_t n, double error_m) { return Errors(n, error_m * direction); }

/// Forty places, some of which err by another length.
Errors someFarOff(double error_m, std::size_t n_far, double far_m) {
  Errors errors = along(Eigen::Vector3d::UnitX(), 40 - n_far, error_m);
  errors.insert(errors.end(), n_far, Eigen::Vector3d(far_m, 0.0, 0.0));
  return errors;
}

InnerScore leaving(const Errors& errors_m) {
  InnerScore score;
  score.squares_m2.assign(errors_m.size(), 0.0);
  score.residual_m.assign(errors_m.size(), Eigen::Vector3d::Zero());
  score.row_residual_m.assign(errors_m.size(), Eigen::Vector3d::Zero());
  for (std::size_t row = 0; row < errors_m.size(); ++row) score.add(row, row, errors_m[row], 1.0);
  return score;
}

/// No correction, which leaves 10 mm everywhere, a polynomial, and the harmonic field.
struct Three {
  std::vector<AutomaticCandidate> candidates;
  std::vector<InnerScore> scores;
  FitData data = fitDataOf(shakenGrid({5, 4, 2}, 0.2, 0.02), nothing_m);
  InnerFolds folds = innerFolds(data);

  Three(const Errors& polynomial_m, const Errors& field_m)
      : scores({leaving(along(Eigen::Vector3d::UnitX(), 40, 0.010)), leaving(polynomial_m), leaving(field_m)}) {
    folds.shares.assign(40, 1.0);
    for (const auto& [id, rank] : {std::pair("none", 0), std::pair("polynomial", 3), std::pair("harmonic_field", 10)})
      candidates.push_back({findPositionMethod(id).value(), {}, id, rank});
  }
  AutomaticAnswer answer(double more_nats, double whole_rms_m = 0.0) const {
    const FieldEvidence evidence{2, more_nats, whole_rms_m};
    return answerOf(candidates, scores, data, folds, &evidence);
  }
};

Eigen::Vector3d trackedBeside_m(const field::CouplingDistortion& metal, const Eigen::Vector3d& p_true_m) {
  const Eigen::Matrix3d field = field::dipoleField(p_true_m, 1.0) + metal.fieldChange(p_true_m, 1.0, 0.0);
  return field::solvePose(field, 1.0, p_true_m).value().tracker_from_sensor.position_m;
}

/// A sphere that two of the places of `besideSphere` stand near, and no other.
std::unique_ptr<field::CouplingDistortion> sphere() {
  return effects::makeCompactMetal(
      {1.3, 0.82, 0.1}, effects::spherePolarizability_m3(0.2, false, 1.0) * Eigen::Matrix3d::Identity(), 0.2);
}

/// Scattered places of a jig that stands off by 2 mm, beside one sphere or nothing.
FitData besideSphere(const field::CouplingDistortion* metal) {
  RandomGeometry random(4);
  FitData data;
  for (int i = 0; i < 40; ++i) {
    Eigen::Vector3d p_m(random.between(0.7, 1.9), random.between(-0.7, 0.3), random.between(-0.5, 0.5));
    if (i < 2) p_m = {1.25 + 0.12 * i, 0.45 + 0.03 * i, 0.05 + 0.1 * i};
    data.p_tracked_m.push_back(metal == nullptr ? p_m : trackedBeside_m(*metal, p_m));
    data.p_true_m.push_back(p_m + 0.002 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    data.node.push_back(i);
  }
  data.jig_sd_m = 0.002;
  return data;
}

/// At true places between those measured and a little nearer to the sphere.
double freshRms_m(const PositionModel& model, const field::CouplingDistortion& metal) {
  RandomGeometry random(99);
  double sum_m2 = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p_true_m(random.between(0.7, 1.9), random.between(-0.7, 0.5), random.between(-0.5, 0.5));
    const Eigen::Vector3d p_m = trackedBeside_m(metal, p_true_m);
    sum_m2 += (p_m + model.displacement_m(p_m) - p_true_m).squaredNorm();
  }
  return std::sqrt(sum_m2 / 300.0);
}

}  // namespace

class AutomaticEvidenceTest : public QObject {
  Q_OBJECT
 private slots:
  /// Each place weighs 6 / (3 + q / s2), which is 1 at s2 = q / 3: the scale is the fixed point at once, and the errors
  /// cost 3 ln(1 + q / (3 s2)) = 3 ln 2.
  void errorsOfOneLengthAreOfThatScale() {
    const double square_m2 = 4e-6;
    Errors errors = along(Eigen::Vector3d::UnitZ(), 20, 0.002);
    errors.insert(errors.end(), 10, Eigen::Vector3d(0.0, -0.0012, 0.0016));
    const double expected = 30.0 * (densityAtNone(square_m2 / 3.0) - 3.0 * std::log(2.0));
    FT_VERIFY_MATCH(near(heavyTailedLikelihood(errors, {}), expected, 1e-9));
  }

  /// A share f of places errs by q, the rest by nothing: f 6 q / (3 + q / s2) = 3 s2 gives q / s2 = 3 / (2 f - 1), 6 of
  /// three quarters; which may be three of four places, or one of two that stands for three quarters of the region.
  void sharesCountAsPlacesDo() {
    const double per_place = densityAtNone(4e-6 / 6.0) - 0.75 * 3.0 * std::log(3.0);
    const Eigen::Vector3d far_m(0.002, 0.0, 0.0), none_m = Eigen::Vector3d::Zero();
    FT_VERIFY_MATCH(near(heavyTailedLikelihood(Errors{far_m, far_m, none_m, far_m}, {}), 4.0 * per_place, 1e-6));
    FT_VERIFY_MATCH(near(heavyTailedLikelihood(Errors{far_m, none_m}, {0.3, 0.1}), 2.0 * per_place, 1e-6));
  }

  void noFitIsBelievedToBeExact() {
    const Errors errors = along(Eigen::Vector3d::UnitX(), 5, 0.0);
    FT_VERIFY_MATCH(near(heavyTailedLikelihood(errors, {}), 5.0 * densityAtNone(1e-10), 1e-9));
  }

  /// Mean squares in mm^2. Two places far off: 5.95 against 4 of the polynomial, more by 0.56 standard errors, and
  /// likelier. Six at 20 mm: 60.85 against 4, more by 2.5 standard errors. Where the polynomial errs by 2 mm and at one
  /// place by 30, the field by 3 mm: less by squares, but the polynomial is likelier by 1.5 * 39 ln(9 / 4) = 47 nats
  /// less what one place costs, about 16.
  void allPlacesDecideUnlessPlacesLeftOutObject_data() {
    QTest::addColumn<Errors>("polynomial");
    QTest::addColumn<Errors>("field");
    QTest::addColumn<double>("more_nats");
    QTest::addColumn<int>("expected");
    const Errors even = someFarOff(0.002, 0, 0.0);
    QTest::newRow("enough") << even << someFarOff(0.001, 2, 0.010) << 3.01 << 2;
    QTest::newRow("too little") << even << someFarOff(0.001, 2, 0.010) << 2.99 << 1;
    QTest::newRow("clearly worse by squares") << even << someFarOff(0.001, 6, 0.020) << 100.0 << 1;
    QTest::newRow("far less likely") << someFarOff(0.002, 1, 0.030) << someFarOff(0.003, 0, 0.0) << 100.0 << 1;
  }
  void allPlacesDecideUnlessPlacesLeftOutObject() {
    QFETCH(Errors, polynomial);
    QFETCH(Errors, field);
    QFETCH(double, more_nats);
    QFETCH(int, expected);
    const AutomaticAnswer answer = Three(polynomial, field).answer(more_nats);
    QCOMPARE(answer.decision.candidate, static_cast<std::size_t>(expected));
    QCOMPARE(answer.decision.is_by_evidence, expected == 2);
    QVERIFY(!answer.blend && !answer.stuck);
  }

  /// Errors of 2 mm at right angles: halves of both leave 1.41, and are likelier by 40 * 1.5 ln 2 = 42 nats. At right
  /// angles to one of 6 mm the field keeps 0.9, and 1.90 mm are left, 0.95 of its RMS: 6.3 nats; with 7 mm 0.92, 0.96.
  void aBlendMustForetellBetterAndLikelier_data() {
    QTest::addColumn<double>("polynomial_m");
    QTest::addColumn<bool>("is_blend");
    QTest::newRow("as good") << 0.002 << true;
    QTest::newRow("a third as good") << 0.006 << true;
    QTest::newRow("two sevenths as good") << 0.007 << false;
  }
  void aBlendMustForetellBetterAndLikelier() {
    QFETCH(double, polynomial_m);
    QFETCH(bool, is_blend);
    const Three three(along(Eigen::Vector3d::UnitY(), 40, polynomial_m), along(Eigen::Vector3d::UnitX(), 40, 0.002));
    const AutomaticAnswer answer = three.answer(10.0);
    QCOMPARE(answer.decision.candidate, std::size_t{2});
    QCOMPARE(answer.blend.has_value(), is_blend);
  }

  /// The field leaves 1 mm held out, the polynomial 3.
  void aFieldThatIsStuckIsLeftOut_data() {
    QTest::addColumn<double>("more_nats");
    QTest::addColumn<double>("whole_m");
    QTest::addColumn<int>("expected");
    QTest::newRow("stuck") << 0.0 << 0.0011 << 1;
    QTest::newRow("not stuck") << 0.0 << 0.0009 << 2;
    QTest::newRow("all places speak for it") << 4.0 << 0.0011 << 2;
  }
  void aFieldThatIsStuckIsLeftOut() {
    QFETCH(double, more_nats);
    QFETCH(double, whole_m);
    QFETCH(int, expected);
    const Three three(someFarOff(0.003, 0, 0.0), someFarOff(0.001, 0, 0.0));
    const AutomaticAnswer answer = three.answer(more_nats, whole_m);
    QCOMPARE(answer.decision.candidate, static_cast<std::size_t>(expected));
    QCOMPARE(answer.stuck.has_value(), expected == 1);
    QCOMPARE(answer.decision.is_by_evidence, more_nats > 3.0);
    // Nothing is said of it where it would not have been used.
    const Three unused(someFarOff(0.001, 0, 0.0), someFarOff(0.003, 0, 0.0));
    QVERIFY(!unused.answer(0.0, 0.004).stuck);
  }

  void withoutEvidencePlacesLeftOutDecide() {
    const Three three(someFarOff(0.002, 0, 0.0), someFarOff(0.001, 2, 0.010));
    const AutomaticAnswer answer = answerOf(three.candidates, three.scores, three.data, three.folds, nullptr);
    QCOMPARE(answer.decision.candidate, chooseCandidate(three.candidates, three.scores).candidate);
    QVERIFY(!answer.decision.is_by_evidence);
  }

  /// Two places near a sphere carry the disturbance. Left out, neither is foretold, and what errs least is chance; all
  /// places together tell the field, which holds where nothing was measured.
  void twoPlacesNearABodyDecide() {
    const auto metal = sphere();
    const FitData data = besideSphere(metal.get());
    const auto candidates = automaticCandidates(CandidateSet::kAll);
    const auto scores = scoreCandidates(candidates, data, innerFolds(data), {});
    FT_VERIFY_OK(scores);
    const AutomaticCandidate& held_out = candidates[chooseCandidate(candidates, *scores).candidate];
    QVERIFY(held_out.method->id != "harmonic_field");
    const auto model = fitPosition("auto", data);
    FT_VERIFY_OK(model);
    QCOMPARE((*model)->parameters().at("method").get<std::string>(), std::string("harmonic_field"));
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"Chosen: Harmonic field", "by the evidence of all places"}));
    const double before_m = freshRms_m(**fitPosition("none", data), *metal);
    QVERIFY(freshRms_m(**model, *metal) < 0.4 * before_m);
    QVERIFY(freshRms_m(**held_out.method->fit(data, held_out.settings, {}), *metal) > before_m);
    // It is the harmonic field of all places, to the bit.
    const auto alone = fitPosition("harmonic_field", data);
    FT_VERIFY_OK(alone);
    QVERIFY((*model)->parameters().at("model") == (*alone)->parameters());
  }

  /// Likelihood of what is left, less half of ln 120 an unknown: 6 and 9 a source, none, 6, and 3 a term.
  void evidenceCountsUnknowns() {
    const auto metal = sphere();
    const FitData data = besideSphere(metal.get());
    std::vector<AutomaticCandidate> candidates;
    int rank = 0;
    for (const char* id : {"none", "rigid", "affine"})
      candidates.push_back({findPositionMethod(id).value(), {}, id, rank++});
    const PositionMethod& field = *findPositionMethod("harmonic_field").value();
    candidates.push_back({&field, settingsOf(field), field.id, simplicity::kPhysical});
    const InnerFolds folds = innerFolds(data);
    const auto whole = fitWhole(candidates, std::vector<InnerScore>(4), data, folds, {});
    FT_VERIFY_OK(whole);
    QVERIFY(whole->evidence.has_value());
    QCOMPARE(whole->evidence->candidate, std::size_t{3});
    const double n_sources = static_cast<double>(whole->models[3]->parameters().at("sources").size());
    std::vector<double> nats;
    for (const double unknowns : {0.0, 6.0, 12.0, 6.0 + 9.0 * n_sources}) {
      Errors left_m;
      for (std::size_t i = 0; i < data.size(); ++i) {
        const Eigen::Vector3d& p_m = data.p_tracked_m[i];
        left_m.push_back(data.p_true_m[i] - p_m - whole->models[nats.size()]->displacement_m(p_m));
      }
      nats.push_back(heavyTailedLikelihood(left_m, {}) - 0.5 * unknowns * std::log(120.0));
    }
    const double others = *std::max_element(nats.begin(), nats.end() - 1);
    FT_VERIFY_MATCH(near(whole->evidence->more_nats, nats.back() - others, 1e-6));
  }

  void noSourceNoEvidence() {
    const FitData data = besideSphere(nullptr);
    const auto candidates = automaticCandidates(CandidateSet::kAll);
    const auto whole = fitWhole(candidates, std::vector<InnerScore>(candidates.size()), data, innerFolds(data), {});
    FT_VERIFY_OK(whole);
    QVERIFY(!whole->evidence);
    const auto n_made =
        std::count_if(whole->models.begin(), whole->models.end(), [](const auto& model) { return model != nullptr; });
    QCOMPARE(n_made, std::ptrdiff_t{1});
  }

  /// Readings that scatter off a plane by 3 mm, 80 of truths in it: pressing them into it would leave two axes of
  /// three.
  void aPlaneGivesNoEvidence() {
    RandomGeometry random(2);
    FitData data;
    data.dimension = 2;
    data.jig_sd_m = 0.003;
    for (int i = 0; i < 80; ++i) {
      const Eigen::Vector3d p_m(random.between(0.5, 1.5), random.between(-0.5, 0.5), 0.1);
      data.p_true_m.push_back(p_m);
      data.p_tracked_m.push_back(p_m + 0.003 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
      data.node.push_back(i);
    }
    const auto candidates = automaticCandidates(CandidateSet::kAll);
    const auto whole = fitWhole(candidates, std::vector<InnerScore>(candidates.size()), data, innerFolds(data), {});
    FT_VERIFY_OK(whole);
    QVERIFY(!whole->evidence);
    QVERIFY(
        std::all_of(whole->models.begin(), whole->models.end(), [](const auto& model) { return model == nullptr; }));
  }

  void stopsOnRequest() {
    std::stop_source source;
    source.request_stop();
    RunControl control;
    control.stop = source.get_token();
    const FitData data = besideSphere(nullptr);
    const auto candidates = automaticCandidates(CandidateSet::kAll);
    const auto whole =
        fitWhole(candidates, std::vector<InnerScore>(candidates.size()), data, innerFolds(data), control);
    QVERIFY(!whole);
    QCOMPARE(whole.error().code, ErrorCode::kCancelled);
  }
};

FIELDTRUE_TEST(AutomaticEvidenceTest)
#include "automatic_evidence_test.moc"
