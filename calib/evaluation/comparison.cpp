#include "calib/evaluation/comparison.h"
