#pragma once

#include <string>

#include "tests/acquisition/protocols/fastrak_bytes.h"

namespace fieldtrue::testing {

/// A TRANSFORM of the device Probe, at half a second past 1,700,000,000 s: a quarter turn about z, 10, -20, 30.5 mm.
/// The floats are IEEE-754 and the CRC (bit by bit, ECMA-182) worked out by another program.
inline const std::string kIgtlQuarterTurn = bytes(
    "<00000000 3F800000 00000000 BF800000 00000000 00000000 00000000 00000000 3F800000 41200000 C1A00000 41F40000>");
inline const std::string kIgtlTransform =
    bytes(
        "<0001>TRANSFORM<000000>Probe<000000 00000000 00000000 00000000 6553F100 80000000 00000000 00000030 9C7663F5 "
        "F9CD7B70>") +
    kIgtlQuarterTurn;

}  // namespace fieldtrue::testing
