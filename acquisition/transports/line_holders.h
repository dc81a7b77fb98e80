#pragma once

#include <string>
#include <vector>

namespace fieldtrue::acquisition {

/// Other programs that have a line open, as far as this user may see them: "minicom (process 4711)".
std::vector<std::string> holdersOf(const std::string& path);
/// "minicom (process 4711)", as messages name a program.
std::string processName(long pid);
/// What this user lacks to open a line, and what to do: the group that may, or that it takes effect at the next login.
std::string permissionAdvice(const std::string& path);

}  // namespace fieldtrue::acquisition
