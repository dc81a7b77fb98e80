#include "app/cli_acquire_trace.h"

#include <sys/resource.h>

#include <QFileInfo>
#include <QStorageInfo>
#include <algorithm>
#include <limits>

#include "acquisition/devices/trace_file.h"

namespace fieldtrue::cli {

namespace {

/// Bytes that a file may have: what is free on its disk, and what the system lets this program write. -1 = not known
qint64 roomFor(const QString& file) {
  const qint64 free = QStorageInfo(QFileInfo(file).path()).bytesAvailable();
  rlimit limit{};
  const bool is_limited = getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  const auto most = static_cast<qint64>(
      std::min<rlim_t>(is_limited ? limit.rlim_cur : RLIM_INFINITY, std::numeric_limits<qint64>::max()));
  return free < 0 ? (is_limited ? most : free) : std::min(free, most);
}

}  // namespace

std::string noPlaceFor(const std::string& trace) {
  const QFileInfo folder(QFileInfo(QString::fromStdString(trace)).path());
  if (!folder.isDir()) return "--trace " + trace + ": its folder does not exist";
  if (!folder.isWritable()) return "--trace " + trace + ": its folder cannot be written to";
  if (QFileInfo(QString::fromStdString(trace)).isDir()) return "--trace " + trace + ": it is a folder";
  // Bytes, and a row of numbers for each chunk of them that is kept.
  constexpr auto kMostOfFile = 2 * static_cast<qint64>(acquisition::LineTrace::kMostBytes);
  const qint64 free = roomFor(QString::fromStdString(trace));
  if (free < 0 || free >= kMostOfFile) return {};
  return "--trace " + trace + ": its disk has room for " + std::to_string(free >> 20) + " MiB, and a trace may need " +
         std::to_string(kMostOfFile >> 20) + "; free some space, or write it elsewhere";
}

std::string noTraceOf(const acquisition::TrackerDevice& device, const std::string& address, const std::string& trace) {
  if (trace.empty()) return {};
  if (!device.trace()) return "--trace writes what goes over a tracker's line, and " + address + " has none";
  return noPlaceFor(trace);
}

}  // namespace fieldtrue::cli
