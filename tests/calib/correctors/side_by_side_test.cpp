#include <QtTest>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

Eigen::Vector3d parabolic_m(const Eigen::Vector3d& p_m) {
  return {0.02 * p_m.x() * p_m.y(), -0.03 * p_m.z() * p_m.z(), 0.01 * std::sin(3.0 * p_m.x())};
}

}  // namespace

/// Fits that run side by side give what they give alone: the linear algebra below them is shared by all threads.
class SideBySideTest : public QObject {
  Q_OBJECT
 private slots:
  void manyFitsAtOnceGiveTheSameBits_data() {
    QTest::addColumn<QString>("id");
    QTest::newRow("hmq") << "hmq";
    QTest::newRow("rbf") << "rbf";
    QTest::newRow("gaussian_process") << "gaussian_process";
    QTest::newRow("harmonic_field") << "harmonic_field";
  }
  void manyFitsAtOnceGiveTheSameBits() {
    QFETCH(QString, id);
    const FitData data = fitDataOf(shakenGrid({4, 3, 3}, 0.2, 0.02), parabolic_m);
    const nlohmann::json alone = fitPosition(id.toStdString(), data).value()->parameters();
    constexpr int kThreads = 4;
    const int repeats = id == "hmq" ? 2000 : 20;
    std::vector<int> n_different(kThreads, 0);
    std::vector<std::thread> threads;
    for (int k = 0; k < kThreads; ++k)
      threads.emplace_back([&, k] {
        for (int i = 0; i < repeats; ++i) {
          const auto model = fitPosition(id.toStdString(), data);
          if (!model || (*model)->parameters() != alone) ++n_different[std::size_t(k)];
        }
      });
    for (std::thread& thread : threads) thread.join();
    for (const int n : n_different) QCOMPARE(n, 0);
  }
};

FIELDTRUE_TEST(SideBySideTest)
#include "side_by_side_test.moc"
