#include <QTest>

#include "tests/blind/figures.h"
#include "tests/blind/judgement.h"
#include "tests/support/test_main.h"

using namespace blind;

namespace {

NamedCause cause(const std::string& effect, double probability = 0.0) {
  NamedCause named;
  named.effect = effect;
  named.probability = probability;
  return named;
}

Session answeredSession(const std::string& shelf, const std::string& effect, const std::string& verdict,
                        const std::vector<std::string>& selected = {}) {
  Session session;
  session.shelf = shelf;
  if (!effect.empty()) {
    session.effects.emplace_back();
    session.effects.back().id = effect;
  }
  session.rho = 1.4;
  session.rho_level = 1.4;
  session.order = "random";
  session.answer.is_answered = true;
  session.answer.verdict = verdict;
  for (const std::string& id : selected) session.answer.selected.push_back(cause(id));
  return session;
}

/// The figure of these words; its count is 0 where there is none.
Interval figureOf(const Scoreboard& board, const std::string& section, const std::string& name,
                  const std::string& group) {
  for (const Figure& figure : board.figures)
    if (figure.section.rfind(section, 0) == 0 && figure.name == name && figure.group == group) return figure.interval;
  return {0.0, 0.0, 0.0, 0};
}

}  // namespace

class BlindJudgementTest : public QObject {
  Q_OBJECT
 private slots:
  void probabilityOfAClassIsThatOfItsMembers();
  void onlyEffectsAreNamed();
  void stopsAtWhatAnAnswerExplains();
  void unforeseenKindsByHand();
  void explainedWithoutReserveByHand();
  void controlsAreHeldToWhatIsWanted();
};

void BlindJudgementTest::probabilityOfAClassIsThatOfItsMembers() {
  Session session;
  session.classes = {{"global_gain", "grid_scale"}, {"coil_gain"}};
  session.answer.is_answered = true;
  for (const auto& [id, probability] :
       {std::pair("grid_scale", 0.45), std::pair("global_gain", 0.4), std::pair("coil_gain", 0.15)}) {
    NamedCause cause;
    cause.effect = id;
    cause.probability = probability;
    session.answer.candidates.push_back(cause);
  }
  QCOMPARE(firstProbability(session), 0.85);
  session.classes.clear();
  QCOMPARE(firstProbability(session), 0.45);
}

void BlindJudgementTest::onlyEffectsAreNamed() {
  Session session = answeredSession("single", "coil_gain", "explained", {"unnamed_scattered", "coil_gain"});
  session.answer.candidates = {cause("unnamed_smooth", 0.6), cause("coil_gain", 0.3), cause("none", 0.1)};
  QCOMPARE(firstNamed(session), std::string("coil_gain"));
  QCOMPARE(firstSelected(session), std::string("coil_gain"));
  QCOMPARE(selectedClasses(session), std::set<std::string>{"coil_gain"});
  // The probability is that of what heads the list, which is not the truth.
  QCOMPARE(forecastOf(session)->probability, 0.6);
  QVERIFY(!forecastOf(session)->is_right);
  session.shelf = "unforeseen";
  session.effects.front().id = "new:kind";
  QVERIFY(forecastOf(session)->is_right);
  session.answer.is_answered = false;
  QCOMPARE(forecastOf(session)->probability, 1.0);
  QVERIFY(!forecastOf(session)->is_right);
  QCOMPARE(firstNamed(session), std::string());
}

void BlindJudgementTest::stopsAtWhatAnAnswerExplains() {
  for (const char* verdict : {"no_gap", "unexplained"}) {
    const Session session = answeredSession("none", "", verdict, {"compact_metal"});
    QVERIFY(namedCauses(session).empty());
    QVERIFY(!namesCause(session) && !namesMetal(session));
  }
  const Session explained = answeredSession("none", "", "partly_explained", {"mains_interference"});
  QCOMPARE(namedCauses(explained).size(), std::size_t(1));
  QVERIFY(!namesCause(explained));
}

void BlindJudgementTest::unforeseenKindsByHand() {
  std::vector<Session> sessions;
  // Kind a is abstained from in all of ten, kind b in two of ten; of the rest a body of metal is named.
  for (int at = 0; at < 10; ++at) {
    sessions.push_back(answeredSession("unforeseen", "new:a", "unexplained"));
    sessions.push_back(at < 2 ? answeredSession("unforeseen", "new:b", "partly_explained", {"closed_loop"})
                              : answeredSession("unforeseen", "new:b", "explained", {"metal_plane"}));
  }
  sessions[1].answer.selected.clear();
  sessions.push_back(answeredSession("single", "coil_gain", "unexplained"));
  sessions.push_back(answeredSession("single", "coil_gain", "explained", {"coil_gain"}));
  const Scoreboard board = scoreboardOf(sessions);
  const std::string section = "Unforeseen";
  const Interval called = figureOf(board, section, "called unexplained or partly explained", "rho 1.4");
  QCOMPARE(called.value, 0.6);
  QCOMPARE(called.count, std::size_t(20));
  // Two kinds drawn with replacement: both a, or both b, in a quarter of the draws each.
  QCOMPARE(called.low, 0.2);
  QCOMPARE(called.high, 1.0);
  QCOMPARE(figureOf(board, section, "a body of metal named", "rho 1.4").value, 0.45);
  QCOMPARE(figureOf(board, section, "so called from rho 1.4 up, by kind", "new:b").value, 0.2);
  QCOMPARE(figureOf(board, section, "a body of metal named from rho 1.4 up, by kind", "new:b").value, 0.9);
  QCOMPARE(figureOf(board, section, "true causes of the catalogue so called", "rho 1.4").value, 0.5);
  QCOMPARE(board.confusion.counts.at("outside the catalogue").at("unexplained"), std::size_t(10));
}

/// Of five causes called explained the interval of two ends where the word does and is not wide; one of these leaves
/// 0.3.
void BlindJudgementTest::explainedWithoutReserveByHand() {
  std::vector<Session> sessions;
  const auto add = [&](std::optional<double> low90, std::optional<double> high90, double left) {
    sessions.push_back(answeredSession("single", "coil_gain", "explained", {"coil_gain"}));
    sessions.back().answer.remaining_low90 = low90;
    sessions.back().answer.remaining_high90 = high90;
    sessions.back().answer.left_inside = left;
  };
  add(-0.1, 0.15, 0.1);
  add(0.05, 0.1, 0.3);
  add(0.1, 0.2, 0.3);
  add(-0.3, 0.1, 0.05);
  add({}, {}, 0.05);
  sessions.push_back(answeredSession("single", "coil_gain", "partly_explained", {"coil_gain"}));
  sessions.back().answer.remaining_low90 = sessions.back().answer.remaining_high90 = 0.1;
  sessions.push_back(answeredSession("off", "off:a", "explained", {"coil_gain"}));
  sessions.back().answer.remaining_low90 = 0.1;
  sessions.back().answer.remaining_high90 = 0.9;
  sessions.back().answer.left_inside = 0.6;
  sessions.push_back(sessions.back());
  sessions.back().answer.remaining_high90 = 0.1;
  const Scoreboard board = scoreboardOf(sessions);
  const auto share = [&](const std::string& section, const std::string& name) {
    return figureOf(board, section, name, "all");
  };
  const std::string foretold = "At places that no table held";
  QCOMPARE(share(foretold, "called explained without reserve").value, 2.0 / 6.0);
  QCOMPARE(share(foretold, "called explained without reserve").count, std::size_t(6));
  QCOMPARE(share(foretold, "of these, more than 0.15 is left").value, 0.5);
  QCOMPARE(share("Outside", "called explained, and more than half is left").value, 1.0);
  QCOMPARE(share("Outside", "so called without reserve, and more than half is left").value, 0.5);
}

void BlindJudgementTest::controlsAreHeldToWhatIsWanted() {
  const auto control = [](const char* name, Session session) {
    session.control = name;
    return session;
  };
  const std::vector<Session> sessions = {
      control("red_noise", answeredSession("none", "", "unexplained")),
      control("red_noise", answeredSession("none", "", "no_gap")),
      control("tolerance_half", answeredSession("none", "", "unexplained")),
      control("tolerance_half", answeredSession("none", "", "explained", {"range_noise"})),
      control("tolerance_half", answeredSession("none", "", "explained", {"jig_tilt"})),
      control("drift_reversed", answeredSession("single", "gain_drift", "explained", {"gain_drift"})),
      control("drift_reversed", answeredSession("single", "gain_drift", "explained", {"compact_metal"})),
      control("other_truth", answeredSession("single", "gain_drift", "explained", {"gain_drift"})),
      control("floor_+20%", answeredSession("none", "", "unexplained"))};
  const Scoreboard board = scoreboardOf(sessions);
  QCOMPARE(figureOf(board, "Detection", "false alarms without an effect", "red_noise").value, 0.5);
  QCOMPARE(figureOf(board, "Detection", "false alarms without an effect", "tolerance_half").value, 1.0 / 3.0);
  QCOMPARE(figureOf(board, "Detection", "false alarms without an effect", "floor_+20%").count, std::size_t(0));
  QCOMPARE(figureOf(board, "Negative", "answered as wanted", "drift_reversed").value, 0.5);
  QCOMPARE(figureOf(board, "Negative", "answered as wanted", "other_truth").value, 0.0);
  QCOMPARE(figureOf(board, "Negative", "answered as wanted", "floor_+20%").value, 0.0);
  QCOMPARE(figureOf(board, "Negative", "a cause named", "other_truth").value, 1.0);
}

FIELDTRUE_TEST(BlindJudgementTest)
#include "blind_judgement_test.moc"
