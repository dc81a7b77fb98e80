#pragma once

#include <QCoreApplication>

class QObject;

namespace fieldtrue::testing {

/// Exit status that ctest reads as "skipped" (SKIP_RETURN_CODE).
constexpr int kSkippedStatus = 77;

/// Runs a QTest object with the usual arguments of QTest.
/// @return 1 when anything failed, else 77 when anything was skipped (a line "SKIPPED what: why" each on stderr), else
/// 0
int runTest(QObject& test, int argc, char** argv);

/// Says why none of a program's tests can run here.
/// @return the exit status for main
int skipProgram(const char* why);

/// What main would be in a program of one test.
using TestProgram = int (*)(int argc, char** argv);

/// Enters a test into its program, under the stem of its source file ("pose_test").
/// @return true
bool enterTest(const char* source_file, TestProgram test);

/// Runs a test that needs no window.
template <class Test>
int runCoreTest(int argc, char** argv) {
  QCoreApplication application(argc, argv);
  Test test;
  return runTest(test, argc, argv);
}

}  // namespace fieldtrue::testing

/// At the end of a test's source file: enters it into the program of its folder.
#define FIELDTRUE_TEST_PROGRAM(run) FIELDTRUE_ENTER_TEST(run, __COUNTER__)
// Names of their own, for files that are compiled together; the second step puts the number in.
#define FIELDTRUE_ENTER_TEST(run, number) FIELDTRUE_ENTER_NUMBERED_TEST(run, number)
#define FIELDTRUE_ENTER_NUMBERED_TEST(run, number)                                                  \
  namespace {                                                                                       \
  [[maybe_unused]] const bool is_entered_##number = ::fieldtrue::testing::enterTest(__FILE__, run); \
  }

/// The same for a test class that needs no window.
#define FIELDTRUE_TEST(Test) FIELDTRUE_TEST_PROGRAM(::fieldtrue::testing::runCoreTest<Test>)
