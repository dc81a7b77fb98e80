#include "acquisition/session/plan.h"
