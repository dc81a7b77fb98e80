#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A compact metal body that is in the room only from a time on, or only until then: a chair, a tool, a trolley.
///
/// While it is there it answers as `compact_metal` does; at other times it does nothing. Only a recording in which the
/// places were not all visited on one side of the change, and whose times are stated, can show it.
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (the body)
Effect metalMovedEffect();

}  // namespace fieldtrue
