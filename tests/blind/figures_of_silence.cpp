#include "tests/blind/controls.h"
#include "tests/blind/judgement.h"
#include "tests/blind/section.h"

namespace blind {
namespace {

std::set<std::string> controlNames(const Sessions& controls) {
  std::set<std::string> names;
  for (const Session* session : controls) names.insert(session->control);
  return names;
}

Sessions ofControl(const Sessions& controls, const std::string& name) {
  return where(controls, [&](const Session& session) { return session.control == name; });
}

/// Whether it was put to places that no table held, where its scene can be.
bool isForetold(const Session& session) {
  return session.answer.left_inside.has_value() || session.answer.cannot_be_simulated;
}

/// What else is said of kinds that no cause of the catalogue is: that all is explained, by what takes away less than
/// half at unseen places, or that there is no gap.
/// @param share of sessions that pass a test, with its interval
template <class Share>
void addOtherAnswers(Section& section, const Sessions& some, const Share& share) {
  if (!where(some, isForetold).empty()) {
    section.addByStrength("called explained, and more than half is left", "share", some, share(explainsInVain));
    section.addByStrength(
        "so called without reserve, and more than half is left", "share", some,
        share([](const Session& session) { return explainsSurely(session) && explainsInVain(session); }));
  }
  section.addByStrength("called no_gap", "share", some, share(isSilent));
}

bool isAsWanted(const Session& session) {
  if (!session.answer.is_answered) return false;
  const Wanted wanted = wantedOf(session.control).value_or(Wanted::kNoCause);
  if (wanted == Wanted::kNoGap) return isSilent(session);
  return wanted == Wanted::kNoCause ? !namesCause(session) : !namesOtherCause(session);
}

}  // namespace

void addDetection(std::vector<Figure>& figures, const Sessions& none, const Sessions& single,
                  const Sessions& controls) {
  Section section(figures, "Detection");
  const Target target = surelyAtMost(0.01, 0.03);
  const Test is_alarm = [](const Session& session) { return !isSilent(session); };
  section.add("false alarms without an effect", "all", "share", shareOf(none, is_alarm), target);
  for (const bool is_position_only : {false, true}) {
    section.add(
        "false alarms without an effect", is_position_only ? "positions only" : "poses", "share",
        shareOf(where(none, [=](const Session& session) { return session.is_position_only == is_position_only; }),
                is_alarm));
  }
  for (const std::string& name : controlNames(controls))
    if (isEffectFreeFamily(name))
      section.add("false alarms without an effect", name, "share",
                  shareOf(ofControl(controls, name), [](const Session& session) { return !isAsWanted(session); }),
                  target);
  section.addShares("effects of the catalogue missed (no_gap)", single, orUnanswered(isSilent));
}

void addAbstention(std::vector<Figure>& figures, const Sessions& single, const Sessions& off) {
  Section section(figures, "Outside the catalogue");
  section.addShares("called unexplained or partly explained", off, isAbstention);
  section.add("called unexplained or partly explained", "rho 1.4 and more", "share",
              shareOf(fromStrength(off, 1.4), isAbstention), atLeast(0.90));
  for (const std::string& id : firstIds(off))
    section.add("so called from rho 1.4 up, by kind", id, "share",
                shareOf(fromStrength(ofFirstId(off, id), 1.4), isAbstention));
  addOtherAnswers(section, off,
                  [](const Test& test) { return [test](const Sessions& some) { return shareOf(some, test); }; });
  section.addShares("in the catalogue, but so called", single, orUnanswered(isAbstention),
                    {std::nullopt, atMost(0.10), atMost(0.05), atMost(0.05)});
}

void addUnforeseen(std::vector<Figure>& figures, const Sessions& single, const Sessions& unforeseen) {
  if (unforeseen.empty()) return;
  Section section(figures, "Unforeseen kinds, intervals by resampling kinds");
  const auto by_kind = [](const Test& test) {
    return [test](const Sessions& some) { return shareByKind(some, test); };
  };
  const Test names_metal = orUnanswered(namesMetal);
  section.addByStrength("called unexplained or partly explained", "share", unforeseen, by_kind(isAbstention),
                        {std::nullopt, std::nullopt, atLeast(0.85), atLeast(0.90)});
  section.addByStrength("a body of metal named", "share", unforeseen, by_kind(names_metal),
                        {std::nullopt, atMost(0.25), atMost(0.15), atMost(0.10)});
  addOtherAnswers(section, unforeseen, by_kind);
  const Sessions unnamed = where(
      unforeseen, [](const Session& session) { return !session.effects.front().id.starts_with("unforeseen:near:"); });
  section.addByStrength("the same, kinds that no text of the project comes near", "share", unnamed,
                        by_kind(isAbstention));
  for (const std::string& kind : firstIds(unforeseen)) {
    const Sessions strong = fromStrength(ofFirstId(unforeseen, kind), 1.4);
    section.add("so called from rho 1.4 up, by kind", kind, "share", shareOf(strong, isAbstention));
    section.add("a body of metal named from rho 1.4 up, by kind", kind, "share", shareOf(strong, names_metal));
  }
  section.addShares("true causes of the catalogue so called", single, orUnanswered(isAbstention));
}

void addRefusals(std::vector<Figure>& figures, const Sessions& single) {
  Section section(figures, "True causes refused: a gap is seen, and called unexplained or partly explained");
  for (const std::string& id : firstIds(single))
    section.addShares(id, ofFirstId(single, id), orUnanswered(isAbstention));
  section.addByStrength("width of the interval of what is left, median", "", single,
                        [](const Sessions& some) { return medianOf(some, leftWidth); });
  section.addShares("no interval of what is left can be told",
                    where(single, [](const Session& session) { return !namedCauses(session).empty(); }),
                    [](const Session& session) { return !leftWidth(session); });
}

void addControls(std::vector<Figure>& figures, const Sessions& controls) {
  Section section(figures, "Negative controls");
  const Test is_passed = [](const Session& session) { return session.answer.is_answered && !namesCause(session); };
  for (const std::string& name : controlNames(controls)) {
    const Sessions of_name = ofControl(controls, name);
    const bool has_target = name == "residuals_permuted" || name == "other_truth";
    section.add("answered as wanted", name, "share", shareOf(of_name, isAsWanted));
    section.add("a cause named", name, "share", shareOf(of_name, orUnanswered(namesCause)),
                has_target ? std::optional(atMost(0.05)) : std::nullopt);
    section.add("no cause named", name, "share", shareOf(of_name, is_passed));
    section.add("called unexplained", name, "share",
                shareOf(of_name, [](const Session& session) { return session.answer.verdict == "unexplained"; }));
    section.add("called no_gap", name, "share", shareOf(of_name, isSilent));
  }
  section.add("answered as wanted", "all", "share", shareOf(controls, isAsWanted));
  section.add("no cause named", "all", "share", shareOf(controls, is_passed));
}

}  // namespace blind
