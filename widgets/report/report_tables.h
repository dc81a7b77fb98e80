#pragma once

#include <vector>

#include "widgets/report/html_writer.h"
#include "widgets/report/report_data.h"

namespace fieldtrue::widgets {

/// Scores of the position methods, "before" first, the best in bold, those worse than before marked.
void writePositionTable(HtmlWriter& html, const evaluation::Comparison& comparison);
/// The same for orientation; nothing when the table has none.
void writeOrientationTable(HtmlWriter& html, const evaluation::Comparison& comparison);
/// One row a place: the ten worst at once, the rest folded away.
void writePlaceTables(HtmlWriter& html, std::vector<PlaceSummary> places);

/// A list of names and values; lines without a value are left out.
class FactList {
 public:
  explicit FactList(HtmlWriter& html) : html_(html) { html_.open("dl"); }
  FactList(const FactList&) = delete;
  FactList& operator=(const FactList&) = delete;
  ~FactList() { html_.close(); }
  void add(const std::string& name, const std::string& value);

 private:
  HtmlWriter& html_;
};

}  // namespace fieldtrue::widgets
