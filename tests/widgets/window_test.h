#pragma once

#include <QApplication>

#include "tests/support/test_main.h"
#include "widgets/views/host/gl_format.h"

namespace fieldtrue::testing {

/// Runs a test that shows windows and sends keys to them: skipped where there is no display.
template <class Test>
int runWindowTest(int argc, char** argv) {
  if (qEnvironmentVariableIsEmpty("DISPLAY")) return skipProgram("there is no display; run it under xvfb-run");
  widgets::setDefaultGlFormat();
  QApplication application(argc, argv);
  QApplication::setApplicationName(QStringLiteral("fieldtrue-test"));
  Test test;
  return runTest(test, argc, argv);
}

}  // namespace fieldtrue::testing

#define FIELDTRUE_WINDOW_TEST(Test) FIELDTRUE_TEST_PROGRAM(::fieldtrue::testing::runWindowTest<Test>)
