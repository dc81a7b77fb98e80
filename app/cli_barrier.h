#pragma once

namespace fieldtrue::cli {

/// What stands when a command was ended by an exception: every file is written beside its place and moved there whole.
inline constexpr const char* kNoHalfFile = "no file was left half written";

}  // namespace fieldtrue::cli
