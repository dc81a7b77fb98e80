#include "acquisition/transports/line_errors.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "acquisition/transports/line_driver.h"
#include "acquisition/transports/line_holders.h"

namespace fieldtrue::acquisition {
namespace {

/// Who holds a lock on the file, from /proc/locks; empty when nobody is found.
std::string lockHolder(const struct stat& file) {
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::vector<std::string> word;
    for (std::string w; words >> w;) word.push_back(w);
    if (word.size() < 6 || word[1] == "->") continue;
    unsigned major_number = 0, minor_number = 0;
    unsigned long inode = 0;
    if (std::sscanf(word[5].c_str(), "%x:%x:%lu", &major_number, &minor_number, &inode) != 3) continue;
    if (inode != file.st_ino || makedev(major_number, minor_number) != file.st_dev) continue;
    const long pid = std::strtol(word[4].c_str(), nullptr, 10);
    if (pid > 0) return processName(pid);
  }
  return {};
}

std::string busyText(const std::string& path, std::string holder) {
  for (const std::string& program : holder.empty() ? holdersOf(path) : std::vector<std::string>()) {
    holder += (holder.empty() ? "" : " and ") + program;
  }
  return path + " is busy: " + (holder.empty() ? std::string("another program") : holder) +
         " has it open; close that program and try again";
}

}  // namespace

bool isPseudoTerminal(const std::string& path) {
  constexpr unsigned kFirstPtyMajor = 136, kLastPtyMajor = 143;
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0 || !S_ISCHR(file.st_mode)) return false;
  const unsigned number = major(file.st_rdev);
  return number >= kFirstPtyMajor && number <= kLastPtyMajor;
}

std::string resolvedPath(const std::string& path) {
  std::error_code error;
  const auto resolved = std::filesystem::canonical(path, error);
  return error ? path : resolved.string();
}

Error lineOpenError(const std::string& path, int system_error) {
  const auto says = [&path](const std::string& text) { return Error{ErrorCode::kDevice, path + " " + text}; };
  switch (system_error) {
    case ENOENT:
      return says("does not exist; check the cable and the name of the port");
    case EACCES:
    case EPERM:
      return says(permissionAdvice(path));
    case EBUSY:
      return {ErrorCode::kDevice, busyText(path, {})};
    case ENOTTY:
    case EINVAL:
    case EISDIR:
      return says("is not a serial line or terminal");
    case ENODEV:
    case ENXIO:
    case EIO:
      return says("has no device behind it; plug the adapter in again");
    default:
      return says(std::string("cannot be opened: ") + std::strerror(system_error));
  }
}

Result<void> lockLine(const std::string& path, int descriptor) {
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    struct stat file {};
    const bool known = ::fstat(descriptor, &file) == 0;
    return fail(ErrorCode::kDevice, busyText(path, known ? lockHolder(file) : std::string{}));
  }
  // An emulator keeps its own end of a pty open, so that the flag would outlive this process there.
  if (!isPseudoTerminal(path)) ::ioctl(descriptor, TIOCEXCL);
  return {};
}

}  // namespace fieldtrue::acquisition
