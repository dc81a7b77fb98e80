#include "calib/simulation/scene.h"
