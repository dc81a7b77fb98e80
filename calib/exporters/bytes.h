#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/error.h"

/// Numbers as bytes, least significant first whatever the machine's own order, and gzip.
namespace fieldtrue::exporters {

void appendDouble(std::string& bytes, double value);
void appendFloat(std::string& bytes, float value);
void appendInt32(std::string& bytes, std::int32_t value);
/// @param at of the first byte; the bytes must be there
double doubleAt(std::string_view bytes, std::size_t at);
float floatAt(std::string_view bytes, std::size_t at);
std::int32_t int32At(std::string_view bytes, std::size_t at);

/// @source RFC 1952
std::string gzipped(const std::string& bytes);
/// The inverse of gzipped, or of zlib's own wrapping. @error kBadInput for damaged data
Result<std::string> inflated(std::string_view bytes);

}  // namespace fieldtrue::exporters
