#include "widgets/figures/gap_bars.h"

#include <algorithm>
#include <cmath>

#include "calib/core/number_text.h"
#include "calib/effects/registry.h"

namespace fieldtrue::widgets {
namespace {

std::string percent(double share) { return std::to_string(std::lround(100.0 * share)) + " %"; }

/// A figure below 0, as noise alone gives half of the time, is nothing.
std::string aboveNoise(double value, const std::optional<double>& low, const std::optional<double>& high,
                       const std::string& unit) {
  if (value <= 0.0)
    return high && *high > 0.0 ? "nothing (at most " + shortNumber(*high) + " " + unit + ")" : "nothing";
  std::string text = shortNumber(value) + " " + unit;
  if (low && high) text += " (" + shortNumber(std::max(0.0, *low)) + " to " + shortNumber(*high) + ")";
  return text;
}

std::string noteOf(const gap::GapCandidate& candidate) {
  std::string note;
  for (const std::string& id : candidate.equivalents) {
    if (id == candidate.effect) continue;
    note += (note.empty() ? "cannot be told from " : " or ") + effectLabel(id);
  }
  if (!candidate.is_plausible && !candidate.doubt.empty())
    note += (note.empty() ? "doubtful: " : "; doubtful: ") + candidate.doubt;
  return note;
}

auto namedAs(const gap::GapReport& report, const std::string& effect) {
  return std::find_if(report.selected.begin(), report.selected.end(),
                      [&](const gap::SelectedEffect& one) { return one.effect == effect; });
}

bool isNamed(const gap::GapReport& report, const std::string& effect) {
  return namedAs(report, effect) != report.selected.end();
}

/// Whether a cause is named, and another one before it.
bool isNamedBeside(const gap::GapReport& report, const std::string& effect) {
  return isNamed(report, effect) && namedAs(report, effect) != report.selected.begin();
}

GapBarChart binChart(const char* id, const std::string& title, const std::vector<gap::GapBin>& bins, const char* unit) {
  GapBarChart chart{id, title, {}};
  for (const gap::GapBin& bin : bins) {
    GapBar bar;
    bar.name = shortNumber(bin.low) + " to " + shortNumber(bin.high) + " " + unit;
    bar.value = bin.rms_mm;
    bar.floor = bin.floor_mm;
    bar.text = shortNumber(bin.rms_mm) + " mm";
    chart.bars.push_back(std::move(bar));
  }
  return chart;
}

}  // namespace

double GapBarChart::maximum() const {
  double most = is_of_shares ? 1.0 : 0.0;
  for (const GapBar& bar : bars) most = std::max({most, bar.value, bar.high90.value_or(0.0), bar.floor.value_or(0.0)});
  return most > 0.0 ? most : 1.0;
}

std::string effectLabel(const std::string& id) {
  if (id == "none") return "No effect";
  if (id == gap::kUnnamedSmooth) return "A smooth field without a name";
  if (id == gap::kUnnamedScattered) return "Scatter without a name";
  return effects::labelOf(id);
}

GapBarChart waterfallChart(const gap::GapReport& report) {
  const bool of_rotation = report.remaining.is_of_rotation;
  const std::string unit = of_rotation ? "degrees" : "mm";
  GapBarChart chart{"waterfall", "Error above noise as each cause is added (" + unit + ", 90 % range)", {}};
  for (const gap::GapStep& step : report.sequence) {
    const double excess = of_rotation ? step.excess_deg.value_or(0.0) : step.excess_mm;
    GapBar bar;
    bar.name = step.effect.empty() ? (report.against ? "As it was before" : "As simulated now")
                                   : "+ " + effectLabel(step.effect);
    bar.value = std::max(0.0, excess);
    bar.low90 = of_rotation ? step.low90_deg : step.low90_mm;
    bar.high90 = of_rotation ? step.high90_deg : step.high90_mm;
    bar.text = aboveNoise(excess, bar.low90, bar.high90, unit);
    chart.bars.push_back(std::move(bar));
  }
  if (chart.bars.empty()) return chart;
  GapBar floor;
  floor.name = "Noise floor";
  const double noise = of_rotation ? report.floor_orientation_deg.value_or(0.0) : report.floor_position_mm;
  floor.text = "0 " + unit + " (noise itself: " + shortNumber(noise) + " " + unit + ")";
  floor.muted = true;
  chart.bars.push_back(std::move(floor));
  return chart;
}

GapBarChart probabilityChart(const gap::GapReport& report, std::size_t most) {
  GapBarChart chart{"probability", "How probable each cause is", {}, true};
  for (const gap::GapCandidate& candidate : report.candidates) {
    if (chart.bars.size() == most) break;
    GapBar bar;
    bar.name = effectLabel(candidate.effect);
    bar.value = candidate.probability;
    // A cause that is added to the first need not be probable by itself.
    bar.text = isNamedBeside(report, candidate.effect) ? "beside the first" : percent(candidate.probability);
    bar.note = noteOf(candidate);
    bar.muted = !candidate.is_plausible;
    chart.bars.push_back(std::move(bar));
  }
  return chart;
}

GapBarChart shrinkageChart(const gap::GapReport& report, std::size_t most) {
  GapBarChart chart{"shrinkage",
                    report.remaining.is_of_rotation
                        ? "How much of the gap of rotation it takes away (places the fit did not see)"
                        : "How much of the gap it takes away (places the fit did not see)",
                    {},
                    true};
  const std::size_t shown = std::min(most, report.candidates.size());
  for (std::size_t i = 0; i < shown; ++i) {
    const gap::GapCandidate& candidate = report.candidates[i];
    if (candidate.effect == "none" || !std::isfinite(candidate.shrinkage.fraction)) continue;
    // What is shown with 0 % for its probability took nothing away, whatever it could.
    if (!isNamed(report, candidate.effect) && std::lround(100.0 * candidate.probability) == 0) continue;
    GapBar bar;
    bar.name = effectLabel(candidate.effect);
    bar.value = std::max(0.0, candidate.shrinkage.fraction);
    bar.low90 = candidate.shrinkage.low90;
    bar.high90 = candidate.shrinkage.high90;
    bar.text = percent(candidate.shrinkage.fraction);
    bar.muted = !candidate.is_plausible;
    chart.bars.push_back(std::move(bar));
  }
  return chart;
}

GapBarChart rangeChart(const gap::GapReport& report) {
  return binChart("range", "Gap by distance from the transmitter (mm; tick: noise)", report.by_range, "m");
}

GapBarChart timeChart(const gap::GapReport& report) {
  return binChart("time", "Gap by time (mm; tick: noise)", report.by_time, "s");
}

GapBarChart originChart(const gap::GapReport& report) {
  GapBarChart chart{"origin", "Where the gap comes from", {}, true};
  const auto add = [&chart](const char* name, double share) {
    GapBar bar;
    bar.name = name;
    bar.value = share;
    bar.text = percent(share);
    chart.bars.push_back(std::move(bar));
  };
  add("Room", report.origin.room);
  add("Transmitter", report.origin.transmitter);
  add("Sensor", report.origin.sensor);
  add("Jig or time", report.origin.jig_or_time);
  return chart;
}

std::vector<GapBarChart> gapCharts(const gap::GapReport& report) {
  std::vector<GapBarChart> charts = {waterfallChart(report), probabilityChart(report), shrinkageChart(report),
                                     originChart(report),    rangeChart(report),       timeChart(report)};
  std::erase_if(charts, [](const GapBarChart& chart) { return chart.bars.empty(); });
  return charts;
}

std::string gapHeadline(const gap::GapReport& report) {
  std::string names;
  for (const gap::SelectedEffect& effect : report.selected)
    names += (names.empty() ? ": " : ", ") + effectLabel(effect.effect);
  const bool is_change = report.against.has_value();
  switch (report.verdict) {
    case gap::GapVerdict::kNoGap:
      return is_change ? "Nothing changed since the earlier recording" : "The simulation matches the recording";
    case gap::GapVerdict::kExplained:
      return std::string(is_change ? "Changed, and explained" : "Explained") +
             (gap::isSurelyExplained(report) ? "" : " as far as these places can tell") + names;
    case gap::GapVerdict::kPartlyExplained:
      return (is_change ? "Changed, and partly explained" : "Partly explained") + names;
    case gap::GapVerdict::kUnexplained:
      if (!report.not_looked_for.empty())
        return is_change ? "Changed; no cause looked for" : "A gap; no cause looked for";
      return is_change ? "Changed, by no known effect" : "Not explained by any known effect";
  }
  return {};
}

std::string predictionText(const gap::GapReport& report) {
  if (report.predictions.empty()) return {};
  const gap::Prediction& p = report.predictions.front();
  return report.names.of(p.node) + " falls from " + shortNumber(p.now_mm) + " to " + shortNumber(p.then_mm) + " +- " +
         shortNumber(p.then_sd_mm) + " mm without: " + effectLabel(p.effect) + ".";
}

}  // namespace fieldtrue::widgets
