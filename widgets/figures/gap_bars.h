#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/gap/report.h"

namespace fieldtrue::widgets {

/// One horizontal bar of a chart about the gap.
struct GapBar {
  std::string name;
  double value = 0.0;
  std::optional<double> low90, high90;  ///< Ends of the whisker.
  std::optional<double> floor;          ///< A tick: what noise alone gives.
  std::string text;                     ///< The value in words, right of the bar.
  std::string note;                     ///< Below the name: what it cannot be told from, or why it is doubted.
  bool muted = false;
};

struct GapBarChart {
  std::string id;     ///< "waterfall", "probability", "shrinkage", "range", "layer", "time", "origin".
  std::string title;  ///< With its unit.
  std::vector<GapBar> bars;
  bool is_of_shares = false;  ///< Then a whole bar is all of it.
  double maximum() const;     ///< Of values and whiskers, and of shares no less than 1; 1 when all are 0.
};

/// "Metal plane" for `metal_plane`, from the effect registry; the id itself where the registry has no such row.
std::string effectLabel(const std::string& id);

/// From the start by each effect added to the noise floor [mm].
GapBarChart waterfallChart(const gap::GapReport& report);
/// How probable each cause is, best first. @param most bars at most
GapBarChart probabilityChart(const gap::GapReport& report, std::size_t most = 6);
/// How much of the gap each cause alone takes away, in the order of probabilityChart.
GapBarChart shrinkageChart(const gap::GapReport& report, std::size_t most = 6);
GapBarChart rangeChart(const gap::GapReport& report);
GapBarChart timeChart(const gap::GapReport& report);
GapBarChart originChart(const gap::GapReport& report);
/// Those of the above that have bars.
std::vector<GapBarChart> gapCharts(const gap::GapReport& report);

/// What was found in a few words: "Explained: Metal plane".
std::string gapHeadline(const gap::GapReport& report);
/// "C4, pipe 3 falls from 31.0 to 12.0 +- 4.0 mm without: Metal plane."; empty when nothing is predicted.
std::string predictionText(const gap::GapReport& report);

}  // namespace fieldtrue::widgets
