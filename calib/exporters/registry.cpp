// To add an exporter:
// 1. Write `calib/exporters/<id>.cpp` with one function that returns its row, declared in rows.h.
// 2. State unit, frame, handedness, direction (measured to true), fit method, n, date and software in the file.
// 3. Write with writeFileAtomically, numbers with formatNumber (no locale).
// 4. Add the row below, in the order menus shall show it.
// 5. Add to tests/calib/exporters/<id>_test.cpp a reading back by something other than the exporter. The contract test
//    (written, not empty, same bytes twice, error on a folder that is not there) runs over every row by itself.
#include "calib/exporters/registry.h"

#include <vector>

#include "calib/exporters/exporter.h"
#include "calib/exporters/rows.h"

namespace fieldtrue::exporters {

std::span<const Exporter> exporters() {
  static const std::vector<Exporter> rows = {ftcalExporter(), csvExporter()};
  return rows;
}

Result<const Exporter*> findExporter(std::string_view id) {
  std::string known;
  for (const Exporter& exporter : exporters()) {
    if (exporter.id == id) return &exporter;
    known += (known.empty() ? "" : ", ") + exporter.id;
  }
  return fail(ErrorCode::kBadInput, "No export format is called '" + std::string(id) + "'; there are: " + known);
}

}  // namespace fieldtrue::exporters
