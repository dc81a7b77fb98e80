#pragma once

#include <string>

namespace fieldtrue::acquisition {

/// Status texts of samples that carry no error code of the tracker's own.
inline constexpr const char* kStatusMissing = "missing";      ///< The tracker sent a mark of a missing reading.
inline constexpr const char* kStatusUnplugged = "unplugged";  ///< The sensor is gone, and the tracker says so.
/// The numbers cannot be a pose: bytes were changed on the line.
inline constexpr const char* kStatusDamaged = "damaged";
inline constexpr const char* kStatusFlipped = "flipped";  ///< Mirrored through the transmitter: wrong hemisphere.

/// Meaning in words of a status every tracker can have; the status itself where it is none of them.
std::string commonStatusMeaning(const std::string& status);
/// The same of an error letter whose meanings only the maker's manual lists.
std::string manualErrorMeaning(const std::string& letter);

}  // namespace fieldtrue::acquisition
