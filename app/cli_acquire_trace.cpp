#include "app/cli_acquire_trace.h"

#include <QFileInfo>
#include <QStorageInfo>

#include "acquisition/devices/trace_file.h"

namespace fieldtrue::cli {

std::string noRoomFor(const std::string& trace) {
  // Bytes, and a row of numbers for each chunk of them that is kept.
  constexpr auto kMostOfFile = 2 * static_cast<qint64>(acquisition::LineTrace::kMostBytes);
  const qint64 free = QStorageInfo(QFileInfo(QString::fromStdString(trace)).path()).bytesAvailable();
  if (free < 0 || free >= kMostOfFile) return {};
  return "--trace " + trace + ": its disk has " + std::to_string(free >> 20) + " MiB free, and a trace may need " +
         std::to_string(kMostOfFile >> 20) + "; free some space, or write it elsewhere";
}

std::string noTraceOf(const acquisition::TrackerDevice& device, const std::string& address, const std::string& trace) {
  if (trace.empty()) return {};
  if (!device.trace()) return "--trace writes what goes over a tracker's line, and " + address + " has none";
  const QFileInfo folder(QFileInfo(QString::fromStdString(trace)).path());
  if (!folder.isDir()) return "--trace " + trace + ": its folder does not exist";
  if (!folder.isWritable()) return "--trace " + trace + ": its folder cannot be written to";
  if (QFileInfo(QString::fromStdString(trace)).isDir()) return "--trace " + trace + ": it is a folder";
  return noRoomFor(trace);
}

}  // namespace fieldtrue::cli
