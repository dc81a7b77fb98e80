#include "acquisition/session/acquisition_controller.h"
