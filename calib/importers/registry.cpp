// To add an importer:
// 1. Write calib/importers/<id>.cpp with its row: id, label, source, settings, whether it needs a truth file, and the
//    reading function. Declare the row in rows.h.
// 2. Put the row into the table below.
// 3. Add a test beside the others in tests/calib/importers; importer_contract_test checks the new row by itself.

#include "calib/importers/registry.h"

#include <algorithm>
#include <vector>

#include "calib/importers/fcsv.h"
#include "calib/importers/importer.h"
#include "calib/importers/rows.h"

namespace fieldtrue::importers {

std::span<const Importer> importers() {
  static const std::vector<Importer> table{nodesImporter(),        fcsvImporter(),    anserImporter(), plusImporter(),
                                           plusSequenceImporter(), columnsImporter(), trajImporter()};
  return table;
}

const Importer* recogniseRecording(const std::filesystem::path& path) {
  for (const Importer& row : importers()) {
    if (row.id == "columns") continue;
    if (row.needs_truth ? path.extension() == row.extension : row.read(path, {}, usualSettings(row)).has_value())
      return &row;
  }
  return nullptr;
}

Settings usualSettings(const Importer& importer) {
  Settings usual;
  for (const Setting& setting : importer.settings) usual[setting.key] = setting.default_value;
  return usual;
}

Result<const Importer*> findImporter(std::string_view id) {
  const std::span<const Importer> rows = importers();
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Importer& row) { return row.id == id; });
  if (found != rows.end()) return &*found;
  std::string known;
  for (const Importer& row : rows) known += (known.empty() ? "" : ", ") + row.id;
  return fail(ErrorCode::kBadInput, "There is no format '" + std::string(id) + "' to import; the formats are " + known);
}

}  // namespace fieldtrue::importers
