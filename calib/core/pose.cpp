#include "calib/core/pose.h"
