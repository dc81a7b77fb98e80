#include "calib/core/geometry.h"
