#include "calib/recording/autoregression.h"

#include <QTest>
#include <cmath>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

class AutoregressionTest : public QObject {
  Q_OBJECT
 private slots:
  /// First order: r_k = a^k / (1 - a^2); density 1 / (1 + a^2 - 2 a cos(2 pi f)).
  void ofFirstOrder() {
    const double a = 0.8;
    std::vector<double> r;
    for (int k = 0; k <= 5; ++k) r.push_back(std::pow(a, k) / (1.0 - a * a));
    const Autoregression found = fittedAutoregression(r, 1000.0);
    QCOMPARE(found.coefficients.size(), std::size_t{1});
    FT_VERIFY_MATCH(near(found.coefficients[0], a, 1e-12));
    FT_VERIFY_MATCH(near(found.variance, 1.0, 1e-12));
    FT_VERIFY_MATCH(near(found.powerAt(0.0), 25.0, 1e-9));
    FT_VERIFY_MATCH(near(found.powerAt(0.5), 1.0 / 3.24, 1e-9));
    FT_VERIFY_MATCH(near(found.powerAt(0.25), 1.0 / 1.64, 1e-9));
  }

  /// Second order, by Yule and Walker: rho_1 = a_1 / (1 - a_2), rho_2 = a_1 rho_1 + a_2,
  /// r_0 = 1 / (1 - a_1 rho_1 - a_2 rho_2).
  void ofSecondOrder() {
    const double a1 = 0.75;
    const double a2 = -0.5;
    std::vector<double> rho = {1.0, a1 / (1.0 - a2)};
    for (int k = 2; k <= 6; ++k) rho.push_back(a1 * rho[rho.size() - 1] + a2 * rho[rho.size() - 2]);
    const double r0 = 1.0 / (1.0 - a1 * rho[1] - a2 * rho[2]);
    for (double& r : rho) r *= r0;
    const Autoregression found = fittedAutoregression(rho, 1000.0);
    QCOMPARE(found.coefficients.size(), std::size_t{2});
    FT_VERIFY_MATCH(near(found.coefficients[0], a1, 1e-12));
    FT_VERIFY_MATCH(near(found.coefficients[1], a2, 1e-12));
    FT_VERIFY_MATCH(near(found.variance, 1.0, 1e-12));
    FT_VERIFY_MATCH(near(found.powerAt(0.0), 1.0 / (0.75 * 0.75), 1e-9));
  }

  /// A coefficient is taken only where it is worth ln(n) / 2 nats: n a^2 > ln(n) nearly.
  void asManyAsTheyAreWorth() {
    const std::vector<double> r = {1.0, 0.05, 0.0025};
    QCOMPARE(fittedAutoregression(r, 1000.0).coefficients.size(), std::size_t{0});   // 2.5 against 6.9
    QCOMPARE(fittedAutoregression(r, 10000.0).coefficients.size(), std::size_t{1});  // 25 against 9.2
  }
};

FIELDTRUE_TEST(AutoregressionTest)
#include "autoregression_test.moc"
