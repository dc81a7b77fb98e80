#include "calib/core/memory_limit.h"

#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <mutex>
#include <utility>

namespace fieldtrue {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;
/// Of what is available: the rest is for everything else that grows meanwhile.
constexpr double kShare = 0.8;
/// So little is never worth asking the system for.
constexpr double kAlwaysGiven_bytes = kMiB;

namespace fs = std::filesystem;

std::optional<double> smaller(std::optional<double> a, std::optional<double> b) {
  if (!a || !b) return a ? a : b;
  return std::min(*a, *b);
}

/// The number behind a word at the start of a line: "MemAvailable:  123 kB".
std::optional<double> numberAfter(const fs::path& file, const std::string& wanted) {
  std::ifstream in(file);
  std::string line;
  while (std::getline(in, line)) {
    if (!line.starts_with(wanted + ' ') && !line.starts_with(wanted + ':')) continue;
    return std::strtod(line.c_str() + wanted.size() + 1, nullptr);
  }
  return std::nullopt;
}

std::optional<double> numberIn(const fs::path& file) {
  std::ifstream in(file);
  double number = 0.0;
  return in >> number ? std::optional(number) : std::nullopt;  // "max" is no number: no limit.
}

/// What one control group leaves: pages of files that nobody uses are counted as used, but given up at need.
std::optional<double> leftByGroup(const fs::path& folder, const char* limit, const char* used, const char* unused) {
  const auto limit_bytes = numberIn(folder / limit);
  const auto used_bytes = numberIn(folder / used);
  if (!limit_bytes || !used_bytes) return std::nullopt;
  return std::max(0.0, *limit_bytes - *used_bytes + numberAfter(folder / "memory.stat", unused).value_or(0.0));
}

/// What a group and all above it leave. Inside a container the group's own path may not be there, but its top is.
std::optional<double> leftByGroups(const fs::path& top, fs::path group, const char* limit, const char* used,
                                   const char* unused) {
  std::optional<double> left_bytes;
  for (group = group.relative_path();; group = group.parent_path()) {
    left_bytes = smaller(left_bytes, leftByGroup(top / group, limit, used, unused));
    if (group.empty()) return left_bytes;
  }
}

std::optional<double> leftByControlGroups(const fs::path& root) {
  std::ifstream in(root / "proc/self/cgroup");
  std::optional<double> left_bytes;
  std::string line;
  while (std::getline(in, line)) {
    const std::size_t second = line.find(':', line.find(':') + 1);
    if (second == std::string::npos) continue;
    const std::string group = line.substr(second + 1);
    if (line.starts_with("0::"))
      left_bytes = smaller(
          left_bytes, leftByGroups(root / "sys/fs/cgroup", group, "memory.max", "memory.current", "inactive_file"));
    else if (line.find(":memory:") != std::string::npos)
      left_bytes = smaller(left_bytes, leftByGroups(root / "sys/fs/cgroup/memory", group, "memory.limit_in_bytes",
                                                    "memory.usage_in_bytes", "total_inactive_file"));
  }
  return left_bytes;
}

std::string textInMiB(double bytes) { return std::to_string(std::llround(std::ceil(bytes / kMiB))) + " MiB"; }

Result<void> checkWithin(const std::string& what, double bytes, double available_bytes) {
  if (bytes <= kShare * available_bytes) return {};
  return fail(ErrorCode::kUnsupported, what + " needs about " + textInMiB(bytes) + " of memory, and 80 % of the " +
                                           textInMiB(available_bytes) +
                                           " that are available is less; use fewer places or another method, or close "
                                           "other programs");
}

/// What is booked in this process.
struct Ledger {
  std::mutex mutex;
  std::condition_variable_any changed;
  double booked_bytes = 0.0;
  double available_bytes = 0.0;  ///< As the system told when nothing was booked: later on bookings show in it or not.
};

Ledger& ledger() {
  static Ledger the_ledger;
  return the_ledger;
}

double availableOrAll_bytes() { return availableMemory_bytes().value_or(std::numeric_limits<double>::infinity()); }

}  // namespace

std::optional<double> availableMemory_bytes(const fs::path& root) {
  if (const char* given = std::getenv("FIELDTRUE_MEMORY_MIB")) {
    char* end = nullptr;
    const double mib = std::strtod(given, &end);
    if (end != given && mib >= 0.0) return mib * kMiB;
  }
  auto free_bytes = numberAfter(root / "proc/meminfo", "MemAvailable");
  if (free_bytes) *free_bytes *= 1024.0;
  return smaller(free_bytes, leftByControlGroups(root));
}

void keepFreedMemory() {
#if defined(__GLIBC__)
  constexpr int kKept_bytes = 128 * 1024 * 1024;
  mallopt(M_MMAP_THRESHOLD, kKept_bytes / 4);
  mallopt(M_TRIM_THRESHOLD, kKept_bytes);
#endif
}

Result<void> checkMemory(const std::string& what, double bytes) {
  if (bytes <= kAlwaysGiven_bytes) return {};
  return checkWithin(what, bytes, availableOrAll_bytes());
}

Result<MemoryBooking> MemoryBooking::book(const std::string& what, double bytes, std::stop_token stop) {
  if (bytes <= kAlwaysGiven_bytes) return MemoryBooking();
  Ledger& all = ledger();
  std::unique_lock lock(all.mutex);
  const auto has_room = [&] {
    if (all.booked_bytes <= 0.0) all.available_bytes = availableOrAll_bytes();
    return all.booked_bytes <= 0.0 || all.booked_bytes + bytes <= kShare * all.available_bytes;
  };
  if (!all.changed.wait(lock, std::move(stop), has_room))
    return fail(ErrorCode::kCancelled, "Stopped on request while waiting for memory");
  FT_TRY_VOID(checkWithin(what, bytes, all.available_bytes));
  all.booked_bytes += bytes;
  return MemoryBooking(bytes);
}

MemoryBooking::MemoryBooking(MemoryBooking&& other) noexcept : bytes_(std::exchange(other.bytes_, 0.0)) {}

MemoryBooking& MemoryBooking::operator=(MemoryBooking&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  return *this;
}

MemoryBooking::~MemoryBooking() {
  if (bytes_ <= 0.0) return;
  Ledger& all = ledger();
  {
    const std::lock_guard lock(all.mutex);
    all.booked_bytes -= bytes_;
  }
  all.changed.notify_all();
}

}  // namespace fieldtrue
