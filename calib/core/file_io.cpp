#include "calib/core/file_io.h"
