#pragma once

#include <functional>

#include "acquisition/session/acquisition_controller.h"

namespace fieldtrue::acquisition {

/// The exception barrier of the acquisition thread: runs a call there, and what it throws ends as the controller's
/// `failed`. A take under way is given up. Timers and the device's signals come through it by themselves; who calls
/// slots from an event loop calls them through it.
void guarded(AcquisitionController& controller, const std::function<void()>& call);

}  // namespace fieldtrue::acquisition
