#include "calib/core/table_io.h"
