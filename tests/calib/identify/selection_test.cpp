#include "calib/identify/selection.h"

#include <QTest>
#include <algorithm>
#include <limits>
#include <utility>

#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::identify;
using namespace fieldtrue::testing;

namespace {

struct Withheld {
  const char* id;
  const char* parameters;
};

constexpr Withheld kBody{"compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.12})"};
constexpr Withheld kScale{"grid_scale", R"({"scale": [0.01, -0.008, 0.004]})"};

CalibrationTable recordedWith(std::initializer_list<Withheld> effects, unsigned seed = 1) {
  simulation::Scene scene = gapScene();
  for (const Withheld& one : effects) scene.effects.push_back({one.id, nlohmann::json::parse(one.parameters)});
  return recordedIn(scene, gapPlan({.orientations = threeTurns()}, seed), seed);
}

QString namesOf(const EffectSelection& selection) {
  QStringList ids;
  for (const GapTerm& term : selection.model.model.terms) ids << QString::fromStdString(term.effect->id);
  ids.sort();
  return ids.join(' ');
}

}  // namespace

/// Adding, exchanging and dropping effects.
class SelectionTest : public QObject {
  Q_OBJECT
 private slots:
  void selectsWhatWasWithheld() {
    const CalibrationTable table = recordedWith({kBody, kScale});
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const EffectSelectionOptions options;
    const EffectSelection seen = selectEffects(search, options, {});
    QCOMPARE(namesOf(seen), QString("compact_metal grid_scale"));
    QCOMPARE(seen.ways.size(), seen.model.model.terms.size());
    const double bic = search.bicOf(seen.model.model);
    const double none = search.bicOf(search.none().model);
    FT_VERIFY_MATCH(near(seen.bic_gain, none - bic, 1e-6));
    double most = 0.0, leading = 0.0;
    for (std::size_t term = 0; term < seen.ways.size(); ++term) {
      const GapModel rest = search.fitted(withoutTerm(seen.model.model, term));
      const double cost = search.bicOf(rest) - bic;
      // Nothing is left to drop, nothing to exchange: the two things that it ends with.
      QVERIFY2(cost >= search.thresholds().least_gain_more, qPrintable(QString::number(cost)));
      most = std::max(most, cost);
      if (term == 0) leading = cost;
      for (const TriedEffect& other : rankEffects(search, rest, {}))
        if (other.fitted.is_plausible && other.held_out_gain > 0.0)
          QVERIFY2(search.bicOf(other.model) > bic - search.thresholds().least_gain_exchange,
                   search.ways()[other.way].effect->id.c_str());
    }
    FT_VERIFY_MATCH(near(leading, most, 1e-6));
    // Nor to add.
    for (const TriedEffect& more : rankEffects(search, seen.model.model, {}))
      QVERIFY(more.bic_gain < search.thresholds().least_gain_more || !more.fitted.is_plausible ||
              more.held_out_gain <= 0.0);
  }

  /// Bodies that imitate a jig that leans can be added, fitted and dropped again for less and less gain. Two sets are
  /// grown to four effects at most, and each addition ranks the catalogue once and once more for each effect that is
  /// there: so often at most it may be ranked.
  void growingEnds() {
    simulation::Scene scene = gapScene();
    scene.effects.push_back({"jig_tilt", nlohmann::json::parse(R"({"shear_rad": [0.05, 0.05, 0.0]})")});
    const CalibrationTable table = recordedIn(scene, gapPlan({.counts = {6, 6, 3}}, 4), 11);
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    int n_loops = 0;
    RunControl counting;
    counting.parallel_for = [&](std::size_t count, const std::function<void(std::size_t)>& body) {
      ++n_loops;
      serialFor(count, body);
    };
    rankEffects(search, search.none().model, counting);
    const int n_once = std::exchange(n_loops, 0);
    QCOMPARE(namesOf(selectEffects(search, {}, counting)), QString("jig_tilt"));
    QVERIFY2(n_loops <= 2 * 4 * 4 * n_once, qPrintable(QStringLiteral("%1 of %2").arg(n_loops).arg(n_once)));
  }

  /// Nearer to each other than to the places, two bodies are not told from one of another shape; farther apart they are
  /// two causes.
  void namesTwoBodiesOnlyWhereTheyAreApart_data() {
    QTest::addColumn<QString>("second");
    QTest::addColumn<int>("named");
    QTest::newRow("beside the first") << R"({"center_m": [1.35, 0.75, 0.3], "radius_m": 0.13})" << 1;
    QTest::newRow("on the other side") << R"({"center_m": [0.7, -0.9, 0.1], "radius_m": 0.13})" << 2;
  }
  void namesTwoBodiesOnlyWhereTheyAreApart() {
    QFETCH(QString, second);
    QFETCH(int, named);
    const std::string parameters = second.toStdString();
    const CalibrationTable table = recordedWith({kBody, {"compact_metal", parameters.c_str()}});
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const EffectSelection seen = selectEffects(GapSearch(rows, {}), {}, {});
    QCOMPARE(namesOf(seen).count("compact_metal"), named);
  }

  /// Which way the rig's frame is turned and where its origin is is nothing that a tracker can tell.
  void theFrameOfTheRigChangesNothing() {
    const CalibrationTable table = recordedWith({kBody});
    const auto seenIn = [&](const Pose& other_from_rig) {
      CalibrationTable turned = table;
      for (Node& node : turned.nodes) node.reference_from_sensor = other_from_rig * node.reference_from_sensor;
      const GapRows rows = makeGapRows(turned.nodes, turned.metadata).value();
      return selectEffects(GapSearch(rows, {}), {}, {});
    };
    const EffectSelection seen = seenIn({});
    for (const Eigen::Vector3d& turn_rad : {Eigen::Vector3d(0.0, 0.0, 1.5707963), Eigen::Vector3d(0.9, -0.5, 0.4)}) {
      const EffectSelection other = seenIn({{0.3, -1.1, 0.7}, rotationFromVector(turn_rad)});
      // What is of the room or of the tracker; errors of the rig are of its axes.
      const auto gainOf = [](const EffectSelection& selection, const std::string& id) {
        for (const TriedEffect& one : selection.first)
          if (one.model.terms.back().effect->id == id) return one.bic_gain;
        return -std::numeric_limits<double>::infinity();
      };
      for (const char* id : {"compact_metal", "metal_plane", "finite_plate", "closed_loop", "metal_moved"})
        QVERIFY2(std::abs(gainOf(other, id) - gainOf(seen, id)) < 0.5, id);
    }
  }

  /// One body with a polarizability of any kind takes more than any one of three errors of the instrument, and is still
  /// a poor excuse for all of them.
  void findsErrorsThatOneBodyHides() {
    const CalibrationTable table = instrumentErrors();
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const QString truth = "coil_nonorthogonality gain_drift grid_scale";
    Thresholds never;
    never.other_kind_start = std::numeric_limits<double>::infinity();
    const GapSearch step_by_step(rows, {}, NoiseFrom::kResiduals, never);
    const EffectSelection hidden = selectEffects(step_by_step, {}, {});
    QVERIFY2(namesOf(hidden).contains("compact_metal"), qPrintable(namesOf(hidden)));
    const EffectSelection seen = selectEffects(GapSearch(rows, {}), {}, {});
    // A rig that is too short on all axes and a gain of the whole tracker read alike.
    QCOMPARE(namesOf(seen).replace("global_gain", "grid_scale"), truth);
    QVERIFY(seen.bic_gain > hidden.bic_gain);
  }

  void findsNothingInNoise() {
    for (const unsigned seed : {1U, 2U, 3U}) {
      const CalibrationTable table = recordedWith({}, seed);
      const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
      const GapSearch search(rows, {});
      const EffectSelection seen = selectEffects(search, {}, {});
      QCOMPARE(namesOf(seen), QString());
      QCOMPARE(seen.bic_gain, 0.0);
    }
  }

  void keepsToTheNumberAskedFor() {
    const CalibrationTable table = recordedWith({kBody, kScale});
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    for (const int most : {0, 1}) {
      EffectSelectionOptions options;
      options.most_effects = most;
      const EffectSelection seen = selectEffects(search, options, {});
      QCOMPARE(static_cast<int>(seen.ways.size()), most);
    }
  }

  /// An effect whose whole gain is asked for and a little more is not taken.
  void takesNoEffectBelowItsPrice() {
    const CalibrationTable table = recordedWith({kScale});
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const GapSearch search(rows, {});
    const EffectSelection free = selectEffects(search, {}, {});
    QCOMPARE(namesOf(free), QString("grid_scale"));
    Thresholds dear;
    dear.least_gain_first = free.first.front().bic_gain + 1.0;
    const EffectSelection seen = selectEffects(GapSearch(rows, {}, NoiseFrom::kResiduals, dear), {}, {});
    QCOMPARE(namesOf(seen), QString());
    QCOMPARE(seen.first.size(), free.first.size());
  }

  void doesNotDependOnTheOrderOfRows() {
    CalibrationTable table = recordedWith({kBody, kScale});
    const GapRows rows = makeGapRows(table.nodes, table.metadata).value();
    const EffectSelection seen = selectEffects(GapSearch(rows, {}), {}, {});
    std::reverse(table.nodes.begin(), table.nodes.end());
    const GapRows reversed = makeGapRows(table.nodes, table.metadata).value();
    const EffectSelection other = selectEffects(GapSearch(reversed, {}), {}, {});
    QCOMPARE(namesOf(other), namesOf(seen));
    FT_VERIFY_MATCH(near(other.bic_gain, seen.bic_gain, 0.05));
  }
};

FIELDTRUE_TEST(SelectionTest)
#include "selection_test.moc"
