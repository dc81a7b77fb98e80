#include <cmath>

#include "tests/blind/judgement.h"
#include "tests/blind/section.h"

namespace blind {

void addShrinkage(std::vector<Figure>& figures, const Sessions& single, const Sessions& pairs) {
  Section section(figures, "Shrinkage by the selected effects, median");
  const auto over_oracle = [](const Sessions& some) { return medianOf(some, relativeShrinkage); };
  const LevelTargets targets = {atLeast(0.9), atLeast(0.9), atLeast(0.9), atLeast(0.9)};
  section.addByStrength("one effect, over the oracle's", "", single, over_oracle, targets, atLeast(0.9));
  section.addByStrength("one effect named right, over the oracle's", "", where(single, isFirstRight), over_oracle);
  section.add("two or three at once, over the oracle's", "all", "", over_oracle(pairs));
  section.addByStrength("one effect, itself", "", single,
                        [](const Sessions& some) { return medianOf(some, shrinkage); });
}

void addForetold(std::vector<Figure>& figures, const Sessions& single) {
  // A session without an answer has nothing to foretell with, and counts all the same.
  if (where(single, [](const Session& session) { return session.answer.left_inside.has_value(); }).empty()) return;
  Section section(figures, "At places that no table held, nothing fitted again");
  for (const bool is_inside : {true, false})
    section.addByStrength(
        is_inside ? "excess taken away in the hull, median" : "outside it, median", "", single,
        [is_inside](const Sessions& some) {
          return medianOf(some, [is_inside](const Session& session) { return foretoldShrinkage(session, is_inside); });
        });
  const Sessions stated =
      where(single, orUnanswered([](const Session& session) { return leftIsCovered(session).has_value(); }));
  const std::optional<Target> covered = coverageTarget();
  section.addShares(
      "the interval of what is left holds it", stated,
      [](const Session& session) { return leftIsCovered(session).value_or(false); },
      {covered, covered, covered, covered}, covered);
  section.addShares("what is left is stated within 0.1", stated,
                    [](const Session& session) {
                      const auto off = leftStatedOff(session);
                      return off && std::abs(*off) <= 0.1;
                    },
                    {std::nullopt, std::nullopt, atLeast(0.9), atLeast(0.9)});
  section.addShares("called explained without reserve", single, explainsSurely);
  section.addShares("of these, more than 0.15 is left", where(single, explainsSurely), leavesAPart);
}

}  // namespace blind
