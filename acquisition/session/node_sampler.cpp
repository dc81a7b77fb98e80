#include "acquisition/session/node_sampler.h"
