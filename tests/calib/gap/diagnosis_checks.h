#pragma once

#include <QTest>
#include <algorithm>
#include <string>

#include "calib/gap/diagnosis.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"

namespace fieldtrue::testing {

/// A recording with one effect that the scene beside it does not have.
struct Withheld {
  simulation::Scene believed;
  std::vector<PlannedPlace> plan;
  CalibrationTable table;
};

inline Withheld withheldFrom(const std::string& effect, const std::string& parameters, const GapPlan& plan = {},
                             const simulation::Scene& believed = gapScene()) {
  Withheld made{believed, gapPlan(plan), {}};
  simulation::Scene actual = believed;
  actual.effects.push_back({effect, nlohmann::json::parse(parameters)});
  made.table = recordedIn(actual, made.plan);
  return made;
}

/// The gap is explained, by that effect or by one that this grid cannot tell from it.
inline Match names(const gap::GapReport& report, const std::string& effect) {
  QByteArray seen(gap::idOf(report.verdict).data());
  bool is_named = false;
  for (const gap::SelectedEffect& selected : report.selected) {
    seen += " " + QByteArray::fromStdString(selected.effect) + " (";
    for (const std::string& other : selected.equivalents) seen += QByteArray::fromStdString(other) + " ";
    seen += ")";
    is_named = is_named || std::count(selected.equivalents.begin(), selected.equivalents.end(), effect) > 0;
  }
  const bool is_alone = report.selected.size() == 1;
  const bool is_explained = report.verdict == gap::GapVerdict::kExplained;
  return {is_named && is_alone && is_explained, "seen " + seen + ", wanted " + QByteArray::fromStdString(effect)};
}

/// Whether a finding holds these words.
inline bool isTold(const gap::GapReport& report, const std::string& words) {
  return std::any_of(report.findings.begin(), report.findings.end(),
                     [&](const recording::GapFinding& f) { return f.text.find(words) != std::string::npos; });
}

/// The scene with what was found added makes recordings in which it finds no gap.
inline Match isSettled(const gap::GapReport& report, const Withheld& made) {
  const simulation::Scene updated = gap::updatedScene(made.believed, {}, report);
  const auto again = gap::diagnose(recordedIn(updated, made.plan, 7), nullptr, &updated);
  if (!again) return {false, QByteArray::fromStdString(again.error().message)};
  return {again->verdict == gap::GapVerdict::kNoGap, QByteArray::fromStdString(again->text)};
}

}  // namespace fieldtrue::testing
