#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue {

/// Memory that may still be taken [bytes]: the smaller of MemAvailable and of what the control groups of this process
/// leave; none where the system tells neither. FIELDTRUE_MEMORY_MIB, where it is set, is taken instead.
/// @param root of the file system that is asked
std::optional<double> availableMemory_bytes(const std::filesystem::path& root = "/");

/// Lets the process keep up to 128 MiB that it has freed: matrices of hundreds of places are made and freed thousands
/// of times, and the system clears every page that it is asked for anew. Where the C library has no such setting,
/// nothing happens.
void keepFreedMemory();

/// @param what whose memory it is, as the subject of a sentence: "The Gaussian process on 9000 places"
/// @error kUnsupported where `bytes` is more than 80 % of what is available, with both figures
Result<void> checkMemory(const std::string& what, double bytes);

/// Memory that a dense computation is about to take, given back on destruction. Of computations that run side by side
/// one waits until the others leave it room, so that what is refused does not depend on the number of threads. Who
/// holds a booking must not ask for another one.
class MemoryBooking {
 public:
  /// @error as checkMemory; kCancelled when stopped while waiting
  static Result<MemoryBooking> book(const std::string& what, double bytes, std::stop_token stop);

  MemoryBooking() = default;
  MemoryBooking(MemoryBooking&& other) noexcept;
  MemoryBooking& operator=(MemoryBooking&& other) noexcept;
  MemoryBooking(const MemoryBooking&) = delete;
  MemoryBooking& operator=(const MemoryBooking&) = delete;
  ~MemoryBooking();

 private:
  explicit MemoryBooking(double bytes) : bytes_(bytes) {}
  double bytes_ = 0.0;
};

}  // namespace fieldtrue
