#include "calib/core/exception_barrier.h"

#include <QTest>
#include <new>
#include <vector>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;

class ExceptionBarrierTest : public QObject {
  Q_OBJECT
 private slots:
  void letsValuesAndErrorsPass() {
    const Result<int> value = withBarrier("nothing was changed", [] { return 7; });
    QCOMPARE(value.value(), 7);
    const Result<int> error =
        withBarrier("nothing was changed", []() -> Result<int> { return fail(ErrorCode::kTooFewNodes, "too few"); });
    QVERIFY(error.error().code == ErrorCode::kTooFewNodes);
    QCOMPARE(error.error().message, std::string("too few"));
    int calls = 0;
    const Result<void> nothing = withBarrier("nothing was changed", [&] { ++calls; });
    QVERIFY(nothing.has_value() && calls == 1);
  }

  void memoryIsOneSentence() {
    for (const bool is_length : {false, true}) {
      const Result<void> thrown = withBarrier("nothing was changed", [&] {
        if (!is_length) throw std::bad_alloc();
        std::vector<double> huge;
        huge.reserve(huge.max_size() + 1);
      });
      QVERIFY(!thrown);
      FT_VERIFY_MATCH(testing::holdsAll(thrown.error().message, {"not enough memory", "; nothing was changed."}));
    }
  }

  void aFailedCheckIsOneSentence() {
    const Result<void> thrown = withBarrier("no file was left half written", [] { FT_CHECK(2 + 2 == 5); });
    QVERIFY(!thrown);
    FT_VERIFY_MATCH(testing::holdsAll(
        thrown.error().message,
        {"An internal check failed: 2 + 2 == 5 (exception_barrier_test.cpp:", "; no file was left half written."}));
    QVERIFY2(thrown.error().message.find("/tests/") == std::string::npos, "no path of the machine it was built on");
  }

  void everythingElseIsOneSentenceToo() {
    const Result<void> known = withBarrier("nothing was changed", [] { throw std::runtime_error("the lamp is out"); });
    FT_VERIFY_MATCH(testing::holdsAll(known.error().message, {"the lamp is out", "nothing was changed"}));
    const Result<void> unknown = withBarrier("nothing was changed", [] { throw 5; });
    FT_VERIFY_MATCH(testing::holdsAll(unknown.error().message, {"unforeseen", "nothing was changed"}));
  }
};

FIELDTRUE_TEST(ExceptionBarrierTest)
#include "exception_barrier_test.moc"
