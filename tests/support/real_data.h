#pragma once

#include <QtGlobal>
#include <filesystem>
#include <optional>
#include <string>

namespace fieldtrue::testing {

/// A file among the real recordings, none when FIELDTRUE_REAL_DATA is not set.
/// @param relative e.g. "anser_duplo/nodes.csv"
inline std::optional<std::filesystem::path> realData(const std::string& relative) {
  const QByteArray folder = qgetenv("FIELDTRUE_REAL_DATA");
  if (folder.isEmpty()) return std::nullopt;
  return std::filesystem::path(folder.toStdString()) / relative;
}

}  // namespace fieldtrue::testing

/// Skips the test with a clear text when the real recordings are not at hand.
#define FT_REQUIRE_REAL_DATA()                                                                           \
  do {                                                                                                   \
    if (qEnvironmentVariableIsEmpty("FIELDTRUE_REAL_DATA")) {                                            \
      QSKIP("FIELDTRUE_REAL_DATA is not set: set it to the folder of real recordings to run this test"); \
    }                                                                                                    \
  } while (false)
