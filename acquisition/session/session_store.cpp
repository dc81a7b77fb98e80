#include "acquisition/session/session_store.h"
