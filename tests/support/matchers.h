#pragma once

#include <QByteArray>
#include <QTest>
#include <string>

#include "calib/core/error.h"
#include "calib/core/pose.h"

namespace fieldtrue::testing {

/// The outcome of a comparison with a text that shows both sides and their difference.
struct Match {
  bool ok = false;
  QByteArray text;
  explicit operator bool() const { return ok; }
};

/// Positions within a tolerance of each other [m].
Match near(const Eigen::Vector3d& seen_m, const Eigen::Vector3d& expected_m, double tolerance_m);
/// Numbers within an absolute tolerance of each other.
Match near(double seen, double expected, double tolerance);
/// Rotations within an angle of each other [rad]; q and -q are the same.
Match near(const Eigen::Quaterniond& seen, const Eigen::Quaterniond& expected, double tolerance_rad);
Match near(const Pose& seen, const Pose& expected, double tolerance_m, double tolerance_rad);
/// Every entry within an absolute tolerance.
Match nearMatrix(const Eigen::MatrixXd& seen, const Eigen::MatrixXd& expected, double tolerance);
/// Matrices, entry by entry.
template <class Seen, class Expected>
requires(Seen::SizeAtCompileTime != 3) Match
    near(const Eigen::MatrixBase<Seen>& seen, const Eigen::MatrixBase<Expected>& expected, double tolerance) {
  return nearMatrix(seen, expected, tolerance);
}

/// Bit for bit: no tolerance, zero signs included.
Match sameBits(double seen, double expected);
Match sameBits(const Pose& seen, const Pose& expected);

/// The message of an error holds every one of the fragments.
Match holdsAll(const std::string& message, const QList<QByteArray>& fragments);

/// The Match of a Result that must hold a value; its text is the error.
template <class T>
Match succeeded(const Result<T>& result) {
  return {result.has_value(), result ? QByteArray("succeeded") : QByteArray::fromStdString(result.error().message)};
}

}  // namespace fieldtrue::testing

/// QVERIFY2 on a Match: prints what was seen, what was expected and the difference.
#define FT_VERIFY_MATCH(match_expression)                            \
  do {                                                               \
    const ::fieldtrue::testing::Match ft_match = (match_expression); \
    QVERIFY2(ft_match.ok, ft_match.text.constData());                \
  } while (false)

/// Verifies that a Result holds a value; prints its error when not.
#define FT_VERIFY_OK(result) FT_VERIFY_MATCH(::fieldtrue::testing::succeeded(result))
