#pragma once

namespace fieldtrue {

/// Key in TableMetadata::other: a tracker, or a room of the simulated one, that the recording went on with.
inline constexpr const char* kOtherTracker = "also_recorded_with";

}  // namespace fieldtrue
