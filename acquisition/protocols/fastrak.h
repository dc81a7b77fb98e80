#pragma once

/// The protocol of the Polhemus 3SPACE Fastrak (manual OPM00PI002 rev. G) as pure functions: bytes to records, commands
/// to bytes, and both the other way for the emulator. No input or output happens here.
#include "acquisition/protocols/fastrak_commands.h"
#include "acquisition/protocols/fastrak_items.h"
#include "acquisition/protocols/fastrak_parser.h"
#include "acquisition/protocols/fastrak_status.h"
