#include "calib/simulation/simulator.h"
