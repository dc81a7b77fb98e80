#include "calib/effects/registry.h"
