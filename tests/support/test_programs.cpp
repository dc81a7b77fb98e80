#include <cstdio>
#include <map>
#include <string>

#include "tests/support/test_main.h"

namespace fieldtrue::testing {
namespace {

std::map<std::string, TestProgram>& entered() {
  static std::map<std::string, TestProgram> tests;
  return tests;
}

}  // namespace

bool enterTest(const char* source_file, TestProgram test) {
  std::string name = source_file;
  name = name.substr(name.rfind('/') + 1);
  entered().emplace(name.substr(0, name.rfind('.')), test);
  return true;
}

}  // namespace fieldtrue::testing

int main(int argc, char** argv) {
  const auto& tests = fieldtrue::testing::entered();
  const auto test = argc > 1 ? tests.find(argv[1]) : tests.end();
  if (test != tests.end()) return test->second(argc - 1, argv + 1);
  std::fputs("The first argument names the test; what follows goes to QTest. This program has:\n", stderr);
  for (const auto& [name, run] : tests) std::fprintf(stderr, "  %s\n", name.c_str());
  return 1;
}
