#include "acquisition/transports/transport.h"
