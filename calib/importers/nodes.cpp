#include "calib/importers/rows.h"
#include "calib/tables/table_io.h"

namespace fieldtrue::importers {
namespace {

Result<Import> importNodes(const std::filesystem::path& path, const std::optional<std::filesystem::path>& truth,
                           const Settings&) {
  FT_TRY(auto reading, readNodeTable(path));
  if (truth)
    return fail(ErrorCode::kBadInput,
                path.filename().string() + " holds the true positions itself; leave the truth file out");
  return Import{std::move(reading.table), {}, std::move(reading.notes)};
}

}  // namespace

/// The program's own node tables, so that they become sessions as any other recording does.
Importer nodesImporter() {
  return {.id = "nodes",
          .label = "Fieldtrue node table (.nodes.csv)",
          .source = "fieldtrue-cli tables, simulate, import",
          .read = importNodes};
}

}  // namespace fieldtrue::importers
