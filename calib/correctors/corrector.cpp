#include "calib/correctors/corrector.h"
