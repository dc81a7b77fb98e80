#include "calib/core/settings.h"
