#include "calib/correctors/registry.h"
