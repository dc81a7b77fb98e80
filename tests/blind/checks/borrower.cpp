#include <iostream>
#include <string>
#include <vector>

#include "calib/field/dipole_field.h"
#include "tests/blind/score.h"

/// What the blind program must not be: it uses the simulator under test.
int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  std::cout << fieldtrue::field::dipoleField({1.0, 0.0, 0.0}, 1.0) << "\n";
  return blind::runScore(words);
}
