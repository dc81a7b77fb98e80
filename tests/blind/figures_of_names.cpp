#include <algorithm>

#include "tests/blind/judgement.h"
#include "tests/blind/section.h"

namespace blind {
namespace {

/// Effects of several sessions, by how often they were called for and how often called.
struct SetCounts {
  std::vector<Tally> recalled;
  std::vector<Tally> precise;
  std::size_t exact = 0;
};

SetCounts countSets(const Sessions& sessions) {
  SetCounts counts;
  for (const Session* session : sessions) {
    const std::set<std::string> truth = trueClasses(*session);
    const std::set<std::string> selected = selectedClasses(*session);
    double shared = 0.0;
    for (const std::string& label : selected) shared += static_cast<double>(truth.count(label));
    counts.recalled.push_back({shared, static_cast<double>(truth.size())});
    counts.precise.push_back({shared, static_cast<double>(selected.size())});
    counts.exact += session->answer.is_answered && truth == selected ? 1 : 0;
  }
  return counts;
}

/// Whether the class that is stated with the first cause holds the truth: what this recording could not tell apart.
bool isTruthStated(const Session& session) {
  const NamedCause* first = firstCandidate(session);
  return first != nullptr && std::find(first->equivalents.begin(), first->equivalents.end(),
                                       session.effects.front().id) != first->equivalents.end();
}

}  // namespace

void addTopOne(std::vector<Figure>& figures, const Sessions& single) {
  const LevelTargets pose = {atLeast(0.85), atLeast(0.95), atLeast(0.98), atLeast(0.98)};
  const LevelTargets positions = {atLeast(0.60), atLeast(0.90), atLeast(0.95), atLeast(0.95)};
  const LevelTargets serpentine = {atLeast(0.80), atLeast(0.92), atLeast(0.95), atLeast(0.95)};
  const auto part = [&](bool is_position_only, bool is_random) {
    return where(single, [=](const Session& session) {
      return session.is_position_only == is_position_only && (session.order == "random") == is_random;
    });
  };
  const Sessions random_poses = part(false, true);
  Section section(figures, "Top-1: the effect named first is in the truth's class");
  section.addShares("poses, random order", random_poses, isFirstRight, pose);
  section.addShares("poses, random order, first selected", random_poses,
                    [](const Session& session) { return isRight(session, firstSelected(session)); });
  section.addShares("positions only, random order", part(true, true), isFirstRight, positions);
  section.addShares("poses, serpentine order", part(false, false), isFirstRight, serpentine);
  section.addShares("positions only, serpentine order", part(true, false), isFirstRight);
  section.addShares("poses, random order, classes by the generator's physics", random_poses,
                    [](const Session& session) {
                      Session other = session;
                      if (!session.own_classes.empty()) other.classes = session.own_classes;
                      return isFirstRight(other);
                    });
  section.addShares("poses, random order, or the class that is stated with the name holds the truth", random_poses,
                    [](const Session& session) { return isFirstRight(session) || isTruthStated(session); });
  section.add("the class stated with the right name holds the truth itself", "all", "share",
              shareOf(where(single, isFirstRight), isTruthStated));
  std::vector<double> sizes;
  for (const Session* session : random_poses)
    if (const NamedCause* first = firstCandidate(*session))
      sizes.push_back(static_cast<double>(first->equivalents.size()));
  section.add("names in the class that is stated, mean", "poses, random order", "", bootstrap(sizes, meanOf));
}

void addTopOneByEffect(std::vector<Figure>& figures, const Sessions& single) {
  Section section(figures, "Top-1 by effect, all data, rho 0.7 and more");
  for (const std::string& id : firstIds(single))
    section.add("named right", id, "share", shareOf(fromStrength(ofFirstId(single, id), 0.7), isFirstRight));
}

void addLocation(std::vector<Figure>& figures, const Sessions& single) {
  static const std::array<std::string, 5> kPlaced = {"compact_metal", "closed_loop", "metal_moved", "finite_plate", ""};
  const std::array<double, 4> medians = {15.0, 8.0, 5.0, 4.0};
  const std::array<double, 4> tails = {40.0, 15.0, 10.0, 8.0};
  Section section(figures, "Location error, where the class was named right");
  for (const std::string& id : kPlaced) {
    const Sessions placed = where(single, [&](const Session& session) {
      const std::string& true_id = session.effects.front().id;
      return id.empty() ? std::find(kPlaced.begin(), kPlaced.end(), true_id) != kPlaced.end() : true_id == id;
    });
    for (const double share : {0.5, 0.9}) {
      LevelTargets targets;
      for (std::size_t at = 0; at < targets.size(); ++at)
        targets[at] = valueAtMost(share < 0.7 ? medians[at] : tails[at]);
      section.addByStrength(
          (id.empty() ? std::string("these four") : id) + (share < 0.7 ? ", median" : ", 90 %"), "cm", placed,
          [&](const Sessions& some) {
            std::vector<double> errors_cm;
            for (const Session* session : some)
              if (const auto error_m = locationError(*session)) errors_cm.push_back(100.0 * *error_m);
            return bootstrap(errors_cm, [=](std::span<const double> values) { return quantileOf(values, share); });
          },
          targets);
    }
  }
}

void addCoverage(std::vector<Figure>& figures, const Sessions& single) {
  Section section(figures, "Coverage of 90 % intervals, where the class was named right");
  const auto add = [&](const std::string& name, const auto& coverage) {
    std::vector<Tally> tallies;
    for (const Session* session : single) {
      const std::vector<bool> covered = coverage(*session);
      tallies.push_back(
          {static_cast<double>(std::count(covered.begin(), covered.end(), true)), static_cast<double>(covered.size())});
    }
    section.add(name, "all", "share", pooledShare(tallies), coverageTarget());
  };
  add("components of the location", locationCoverage);
  add("amplitude", amplitudeCoverage);
}

void addProbability(std::vector<Figure>& figures, const Sessions& all, const Sessions& single) {
  std::vector<Forecast> forecasts;
  for (const Session* session : all)
    if (const auto forecast = forecastOf(*session)) forecasts.push_back(*forecast);
  const Sessions strong = fromStrength(single, 0.7);
  std::vector<double> set_sizes;
  for (const Session* session : strong)
    if (const auto set = credibleSet(*session)) set_sizes.push_back(static_cast<double>(set->size));
  const auto holds_truth = [](const Session& session) {
    const auto set = credibleSet(session);
    return set && set->holds_truth;
  };
  Section section(figures, "Probability of the first candidate, every shelf");
  section.add("Brier score", "all", "", brierScore(forecasts), valueAtMost(0.10));
  section.add("expected calibration error", "all", "", calibrationError(forecasts), valueAtMost(0.05));
  section.add("90 % set holds the truth", "rho 0.7 and more", "share", shareOf(strong, holds_truth), atLeast(0.90));
  section.add("classes in the 90 % set, mean", "rho 0.7 and more", "", bootstrap(set_sizes, meanOf), valueAtMost(1.5));
}

void addSets(std::vector<Figure>& figures, const Sessions& pairs, const Sessions& single) {
  Section section(figures, "Sets of effects, by class");
  const auto add = [&](const std::string& group, const Sessions& some, bool has_target) {
    const SetCounts counts = countSets(some);
    const auto target = [&](double value) { return has_target ? std::optional(atLeast(value)) : std::nullopt; };
    section.add("true effects selected (recall)", group, "share", pooledShare(counts.recalled), target(0.95));
    section.add("selected effects true (precision)", group, "share", pooledShare(counts.precise), target(0.95));
    section.add("set exact", group, "share", wilson(counts.exact, some.size()), target(0.85));
  };
  add("two or three at once", pairs, true);
  const auto holds = [](std::size_t count) {
    return [count](const Session& session) { return session.effects.size() == count; };
  };
  add("two at once", where(pairs, holds(2)), false);
  add("three at once", where(pairs, holds(3)), false);
  add("two or three, each of rho 0.7 and more",
      where(pairs,
            [](const Session& session) {
              return std::all_of(session.effects.begin(), session.effects.end(),
                                 [](const TrueEffect& e) { return e.rho >= 0.7 - 1e-6; });
            }),
      false);
  add("one effect", single, false);
}

void addSignals(std::vector<Figure>& figures, const Sessions& signals) {
  Section section(figures, "Effects of the signal, found in findings or selected");
  for (const std::string& id : firstIds(signals))
    section.add("found", id, "share", shareOf(ofFirstId(signals, id), isFound));
  section.add("found", "all", "share", shareOf(signals, isFound));
}

}  // namespace blind
