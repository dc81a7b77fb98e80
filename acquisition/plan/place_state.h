#pragma once

namespace fieldtrue::acquisition {

/// What is known of one planned place at this moment.
enum class PlaceState { kPlanned, kDone, kSkipped, kSuspicious };

}  // namespace fieldtrue::acquisition
