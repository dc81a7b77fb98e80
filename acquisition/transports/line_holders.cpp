#include "acquisition/transports/line_holders.h"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace fieldtrue::acquisition {
namespace {

namespace fs = std::filesystem;

bool hasOpen(const fs::path& process, const struct stat& line) {
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(process / "fd", unreadable)) {
    struct stat file {};
    // Through the link: every name of the line is found.
    if (::stat(entry.path().c_str(), &file) != 0 || !S_ISCHR(file.st_mode)) continue;
    if (file.st_rdev == line.st_rdev) return true;
  }
  return false;
}

/// The group that may read and write the line; the one that owns lines on Debian where it cannot be told.
std::string groupOf(const std::string& path) {
  constexpr mode_t kReadWrite = S_IRGRP | S_IWGRP;
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0 || (file.st_mode & kReadWrite) != kReadWrite) return "dialout";
  const group* owner = ::getgrgid(file.st_gid);
  return owner ? owner->gr_name : std::to_string(file.st_gid);
}

/// Whether the user is entered in the group, though this login does not know yet.
bool isEntered(const std::string& group_name) {
  const passwd* user = ::getpwuid(::geteuid());
  const group* entry = ::getgrnam(group_name.c_str());
  if (!user || !entry) return false;
  for (char** member = entry->gr_mem; *member; ++member) {
    if (std::string(*member) == user->pw_name) return true;
  }
  return false;
}

}  // namespace

std::string processName(long pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/comm");
  std::string name;
  return std::getline(in, name) ? name + " (process " + std::to_string(pid) + ")" : "process " + std::to_string(pid);
}

std::vector<std::string> holdersOf(const std::string& path) {
  struct stat line {};
  std::vector<long> pids;
  if (::stat(path.c_str(), &line) != 0 || !S_ISCHR(line.st_mode)) return {};
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator("/proc", unreadable)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    const long pid = std::strtol(name.c_str(), nullptr, 10);
    if (pid != ::getpid() && hasOpen(entry.path(), line)) pids.push_back(pid);
  }
  std::sort(pids.begin(), pids.end());
  std::vector<std::string> names;
  for (const long pid : pids) names.push_back(processName(pid));
  return names;
}

std::string permissionAdvice(const std::string& path) {
  const std::string name = groupOf(path);
  if (isEntered(name)) {
    return "may not be opened by this login: the user is in the group " + name + " already; log out and in again";
  }
  return "may not be opened by this user: add the user to the group " + name + " (sudo usermod -aG " + name +
         " $USER) and log in again";
}

}  // namespace fieldtrue::acquisition
