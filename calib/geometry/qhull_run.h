#pragma once

#include <Eigen/Core>
#include <cstdio>
#include <memory>
#include <span>
#include <vector>

struct qhT;

namespace fieldtrue {

/// Qhull's tolerances are those of coordinates near 1: the points are moved to their middle and scaled alike.
/// @return x y z of one point after the other; empty when all are at one point
std::vector<double> centeredAndScaled(std::span<const Eigen::Vector3d> points_m);

/// One run of Qhull; its messages go nowhere.
class QhullRun {
 public:
  /// @param coordinates x y z of one point after the other; Qhull may change and refers to them
  QhullRun(std::vector<double>& coordinates, const char* command);
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;
  ~QhullRun();

  bool succeeded() const { return succeeded_; }
  /// For Qhull's own functions and loops.
  qhT* get() const { return qhull_.get(); }

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, CloseFile> silence_;
  std::unique_ptr<qhT> qhull_;
  bool succeeded_ = false;
};

}  // namespace fieldtrue
