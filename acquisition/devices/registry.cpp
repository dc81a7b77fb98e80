#include "acquisition/devices/registry.h"
