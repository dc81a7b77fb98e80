#include "widgets/report/report_region.h"

#include <algorithm>

#include "calib/core/number_text.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_data.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kMostListed = 20;

std::string pointText(const Eigen::Vector3d& point_m) {
  return "(" + fixedText(point_m.x(), 3) + ", " + fixedText(point_m.y(), 3) + ", " + fixedText(point_m.z(), 3) + ") m";
}

/// A list of lines, the first twenty, with how many there are besides.
void writeList(HtmlWriter& html, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  html.open("ul");
  for (std::size_t i = 0; i < std::min(kMostListed, lines.size()); ++i) html.element("li", lines[i]);
  if (lines.size() > kMostListed) html.element("li", "and " + std::to_string(lines.size() - kMostListed) + " more");
  html.close();
}

void writeCoverage(HtmlWriter& html, const evaluation::Coverage& coverage) {
  html.element("h3", "Coverage");
  html.element("p", coverage.text, {{"id", "coverage"}});
  std::vector<std::string> holes;
  for (const evaluation::Hole& hole : coverage.holes)
    holes.push_back("hole around " + pointText(hole.center_m) + ", " + fixedText(hole.radius_m, 3) +
                    " m from the nearest place");
  writeList(html, holes);
}

std::string cellText(const evaluation::FoldBackCell& cell, const PlaceNames& names) {
  return (cell.nodes.empty() ? "point around " : "cell between " + names.list(cell.nodes, 8) + " around ") +
         pointText(cell.center_m) + ", determinant " + significantText(cell.determinant) + ", condition " +
         significantText(cell.condition);
}

void writeFoldBack(HtmlWriter& html, const evaluation::FoldBack& fold_back, const PlaceNames& names) {
  html.element("h3", "Fold-back");
  html.element("p", fold_back.text, {{"id", "fold-back"}});
  std::vector<std::string> folded;
  for (const evaluation::FoldBackCell& cell : fold_back.cells)
    if (!cell.one_to_one || cell.is_near_fold) folded.push_back(cellText(cell, names));
  writeList(html, folded);
}

void writeDependence(HtmlWriter& html, const evaluation::Comparison& comparison) {
  if (!comparison.orientation_cover) return;
  html.element("h3", "How the sensor was held");
  html.element("p", comparison.orientation_cover->text, {{"id", "orientation-cover"}});
  if (const auto& dependence = comparison.position_dependence)
    html.element("p", dependence->text, {{"id", "position-dependence"}});
  if (const auto& dependence = comparison.orientation_dependence)
    html.element("p", dependence->text, {{"id", "orientation-dependence"}});
}

}  // namespace

void writeRegion(HtmlWriter& html, const evaluation::Comparison& comparison) {
  const std::string resampling = resamplingText(comparison);
  if (!comparison.coverage && !comparison.fold_back && !comparison.orientation_cover && resampling.empty()) return;
  html.element("h2", "Region and field");
  if (comparison.coverage) writeCoverage(html, *comparison.coverage);
  if (comparison.fold_back) writeFoldBack(html, *comparison.fold_back, comparison.names);
  writeDependence(html, comparison);
  if (!resampling.empty()) {
    html.element("h3", "Resampling");
    html.element("p", resampling, {{"id", "resampling"}});
  }
}

}  // namespace fieldtrue::widgets
