#include "app/cli_barrier.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace fieldtrue::cli {
namespace {

std::atomic<bool>& thrown() {
  static std::atomic<bool> thrown = false;
  return thrown;
}

}  // namespace

void rememberThrown() { thrown() = true; }

int endProgram(int status) {
  if (!thrown()) return status;
  std::cout.flush();
  std::cerr.flush();
  std::fflush(nullptr);
  std::_Exit(status);
}

}  // namespace fieldtrue::cli
