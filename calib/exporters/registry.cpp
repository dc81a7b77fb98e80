#include "calib/exporters/registry.h"
