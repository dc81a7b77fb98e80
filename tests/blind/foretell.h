#pragma once

#include <span>
#include <string>

namespace blind {

/// Puts the scene that each diagnosis left behind to the test of places that no table held: the program simulates them
/// without noise, nothing is fitted again, and what it foretells is compared with what the generator sealed. Beside it
/// stands what an alignment alone foretells, from the same rows: the start that the shrinkage counts from.
///
/// `foretell --in DIR [--cli PATH] [--jobs J]` writes DIR/foretold.json: mean squares inside the box of the places and
/// outside it, position and rotation, at the start and after. A scene that cannot be simulated there is written with
/// its trouble.
/// @return 0 done, 1 the folder does not allow it (one line on stderr), 2 wrong usage
int runForetell(std::span<const std::string> words);

}  // namespace blind
