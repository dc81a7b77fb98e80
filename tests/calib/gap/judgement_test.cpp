#include "calib/gap/judgement.h"

#include <QTest>
#include <array>
#include <cmath>

#include "calib/gap/candidates.h"
#include "calib/gap/unseen.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

/// A body that stands there in some of six equal parts of the session.
CalibrationTable recordedWhileABodyStood(const std::array<bool, 6>& parts) {
  const std::vector<PlannedPlace> plan = gapPlan({.counts = {5, 5, 5}});
  simulation::Scene scene = gapScene();
  CalibrationTable table = recordedIn(scene, plan);
  scene.effects.push_back(
      {"compact_metal", nlohmann::json::parse(R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})")});
  const CalibrationTable beside = recordedIn(scene, plan);
  for (std::size_t i = 0; i < table.nodes.size(); ++i)
    if (parts[6 * i / table.nodes.size()]) table.nodes[i] = beside.nodes[i];
  return table;
}

/// A recording and what the search names in it.
struct Named {
  explicit Named(const CalibrationTable& table)
      : rows(identify::makeGapRows(table.nodes, table.metadata).value()),
        search(rows, {}),
        selection(identify::selectEffects(search, {}, {})) {}

  identify::GapRows rows;
  identify::GapSearch search;
  identify::EffectSelection selection;
};

QString tracesOf(const CalibrationTable& table) {
  const Named named(table);
  QStringList texts;
  for (const identify::Trace& trace : leftBy(named.search, named.selection.model.model).traces)
    if (trace.p_value < named.search.thresholds().sure_trace) texts << QString::fromStdString(trace.text);
  return texts.join("; ");
}

}  // namespace

class JudgementTest : public QObject {
  Q_OBJECT
 private slots:
  /// What was refused and stands out of no floor is not the likeliest cause of a gap that is not there; where there is
  /// one, a field without a name comes first.
  void refusedWithoutAGapNoneComesFirst() {
    const Named named(recordedIn(gapScene(), gapPlan()));
    Judgement judgement = judge(named.search, named.selection, {});
    QVERIFY(judgement.selection.ways.empty());
    judgement.refusal = Refusal::kForetellsNoBetter;
    judgement.nats_over_unnamed = 8.0;
    judgement.selection.alternatives.front().bic_gain = 23.0;
    judgement.selection.alternatives.front().held_out_gain = 5.0;
    QCOMPARE(describeCandidates(named.search, judgement, false, 0.0).front().effect, std::string("none"));
    QCOMPARE(describeCandidates(named.search, judgement, true, 0.0).front().effect, std::string(kUnnamedSmooth));
  }

  void namesErrorsThatOneBodyHides() {
    const Named named(instrumentErrors());
    const Judgement judgement = judge(named.search, named.selection, {});
    QVERIFY(judgement.refusal == Refusal::kNone);
    QCOMPARE(judgement.selection.ways.size(), std::size_t{3});
    const double left = judgement.far.remaining().value;
    QVERIFY2(std::abs(left) < 0.1, qPrintable(QString::number(left)));
  }

  /// Taking the best at each step, folds take the body that passes for these errors; the true set, fitted to the fold's
  /// rows, is likelier by them. So what is left of unseen rows is what explicit refits of that set leave.
  void foldsAreNotWorseThanWhatTheRecordingNames() {
    const Named named(instrumentErrors());
    const std::vector<int> blocks = scatteredBlocks(named.rows);
    const UnseenScores scores =
        scoreUnseen(named.search, named.selection, identify::UnnamedRival(named.search), {}, blocks, {});
    int n_alike = 0;
    for (int block = 0; block < 10; ++block) {
      std::vector<char> used;
      for (const int of_row : blocks) used.push_back(of_row != block ? 1 : 0);
      const identify::GapModel refitted = named.search.fitted(named.selection.model.model, used);
      const std::vector<identify::Vector6d> left = named.search.physics().residuals(refitted);
      for (std::size_t i = 0; i < left.size(); ++i) {
        const double square_m2 = left[i].head<3>().squaredNorm();
        if (used[i] == 0 && std::abs(scores.step.back()[i].square_m2 - square_m2) < 0.01 * square_m2) ++n_alike;
      }
    }
    QVERIFY2(n_alike >= 90, qPrintable(QStringLiteral("%1 of 100 rows").arg(n_alike)));
  }

  /// Few rows tell where a body stood that came during the session: a fold may not have its place from all of them. So
  /// what folds leave does not change when the whole recording's place does.
  void foldsDoNotKnowThePlaceOfWhatMoved() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back({"metal_moved", nlohmann::json::parse(R"({"center_m": [1.2, 0.5, 0.3], "radius_m": 0.15,
                                                                      "change_s": 200})")});
    Named named(recordedIn(scene, gapPlan()));
    QCOMPARE(named.selection.ways.size(), std::size_t{1});
    const std::vector<int> blocks = scatteredBlocks(named.rows);
    const auto left = [&] {
      return scoreUnseen(named.search, named.selection, identify::UnnamedRival(named.search), {}, blocks, {});
    };
    const UnseenScores as_found = left();
    named.selection.model.model.terms.front().searched *= 1.02;
    const UnseenScores displaced = left();
    for (std::size_t i = 0; i < named.rows.rows.size(); ++i)
      QCOMPARE(displaced.step.back()[i].square_m2, as_found.step.back()[i].square_m2);
  }

  /// A rig of another scale that leans is as smooth as a field without a name: evidence alone can name the two, and
  /// what is asked of each decides.
  void severalCausesNeedEvidenceEach() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back({"grid_scale", nlohmann::json::parse(R"({"scale": [0.01, -0.008, 0.004]})")});
    scene.effects.push_back({"jig_tilt", nlohmann::json::parse(R"({"shear_rad": [0.02, -0.015, 0.0]})")});
    const CalibrationTable table = recordedIn(scene, gapPlan(), 2);
    const Named named(table);
    QCOMPARE(named.selection.ways.size(), std::size_t{2});
    const Judgement usual = judge(named.search, named.selection, {});
    QVERIFY(usual.refusal == Refusal::kNone);
    QVERIFY2(*usual.unseen_gain.low90 < 0.0, qPrintable(QString::number(*usual.unseen_gain.low90)));
    for (const double share : {0.9, 1.1}) {
      identify::Thresholds thresholds;
      thresholds.least_nats_of_several = share * usual.nats_over_unnamed / 2.0;
      const identify::GapSearch search(named.rows, {}, identify::NoiseFrom::kResiduals, thresholds);
      const Judgement judgement = judge(search, identify::selectEffects(search, {}, {}), {});
      QVERIFY(judgement.refusal == (share < 1.0 ? Refusal::kNone : Refusal::kForetellsNoBetter));
      QCOMPARE(judgement.refused.size(), std::size_t{share < 1.0 ? 0U : 2U});
    }
  }

  void whatStoodThereAllTheTimeLeavesNoTrace() {
    QCOMPARE(tracesOf(recordedWhileABodyStood({true, true, true, true, true, true})), QString());
  }

  void whatCameAndWentIsTold() {
    const QString told = tracesOf(recordedWhileABodyStood({false, true, false, true, false, true}));
    QVERIFY2(told.contains("did not stand there alike all the time"), qPrintable(told));
  }
};

FIELDTRUE_TEST(JudgementTest)
#include "judgement_test.moc"
