#include "calib/field/coupling.h"
