#include "calib/importers/registry.h"
