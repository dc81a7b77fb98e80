#include "calib/geometry/qhull_run.h"

#include <string>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace fieldtrue {

std::vector<double> centeredAndScaled(std::span<const Eigen::Vector3d> points_m) {
  Eigen::Vector3d low = points_m.front();
  Eigen::Vector3d high = points_m.front();
  for (const Eigen::Vector3d& p : points_m) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double extent_m = (high - low).maxCoeff();
  std::vector<double> coordinates;
  if (!(extent_m > 0.0)) return coordinates;
  coordinates.reserve(points_m.size() * 3);
  for (const Eigen::Vector3d& p : points_m) {
    const Eigen::Vector3d scaled = (p - (low + high) / 2.0) / extent_m;
    coordinates.insert(coordinates.end(), {scaled.x(), scaled.y(), scaled.z()});
  }
  return coordinates;
}

QhullRun::QhullRun(std::vector<double>& coordinates, const char* command)
    : silence_(std::fopen("/dev/null", "w")), qhull_(std::make_unique<qhT>()) {
  qh_zero(qhull_.get(), silence_.get());
  std::string command_text = command;
  succeeded_ = silence_ && qh_new_qhull(qhull_.get(), 3, static_cast<int>(coordinates.size() / 3), coordinates.data(),
                                        False, command_text.data(), nullptr, silence_.get()) == 0;
}

QhullRun::~QhullRun() {
  qhT* qh = qhull_.get();
  qh->NOerrexit = True;
  qh_freeqhull(qh, !qh_ALL);
  int blocks = 0;
  int bytes = 0;
  qh_memfreeshort(qh, &blocks, &bytes);
}

}  // namespace fieldtrue
