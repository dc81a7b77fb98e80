#include "acquisition/devices/tracker_device.h"
