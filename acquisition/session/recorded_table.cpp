#include "acquisition/session/recorded_table.h"

#include "acquisition/session/session_store.h"
#include "calib/tables/table_io.h"

namespace fieldtrue::acquisition {

Result<CalibrationTable> recordedTable(const QString& path) {
  if (!path.endsWith(QStringLiteral(".fieldtrue"), Qt::CaseInsensitive)) {
    FT_TRY(auto read, readNodeTable(path.toStdString()));
    return std::move(read.table);
  }
  FT_TRY(const auto session, SessionStore::open(path));
  FT_TRY(auto table, session.nodeTable());
  if (table.nodes.empty()) return fail(ErrorCode::kTooFewNodes, path.toStdString() + " holds no recorded place yet.");
  return table;
}

}  // namespace fieldtrue::acquisition
