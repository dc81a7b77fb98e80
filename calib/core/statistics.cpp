#include "calib/core/statistics.h"
