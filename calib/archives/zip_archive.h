#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calib/core/error.h"

namespace fieldtrue {

struct ZipMember {
  std::string name;
  std::string content;
  bool packed = true;  ///< False: can be read in the file without unpacking it.
};

/// Writes an archive atomically; the same members make the same file. @error kIo
Result<void> writeZip(const std::filesystem::path& path, const std::vector<ZipMember>& members);

/// Every member by its name, its check sum tested.
/// @param most_bytes of all members unpacked together
/// @error kIo where the file cannot be opened; kBadInput for what is no archive, a damaged member, too much in it: one
///        sentence that names the file
Result<std::map<std::string, std::string>> readZip(const std::filesystem::path& path, std::uint64_t most_bytes);

}  // namespace fieldtrue
