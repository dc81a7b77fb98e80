// The same as correct.c, baked, many at once.
//   c++ correct.cpp $(pkg-config --cflags --libs fieldtrue_runtime) -o correct && ./correct lab.ftcal.json < poses.txt
#include <cstdio>
#include <exception>
#include <fieldtrue_runtime.hpp>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: correct CALIBRATION < poses\n");
    return 2;
  }
  try {
    const fieldtrue_runtime::Calibration calibration = fieldtrue_runtime::Calibration(argv[1]).baked();
    std::vector<fieldtrue_runtime::Pose> poses;
    fieldtrue_runtime::Pose pose;
    double* p = pose.position_m;
    double* q = pose.orientation_wxyz;
    while (std::scanf("%lf %lf %lf %lf %lf %lf %lf", p, p + 1, p + 2, q, q + 1, q + 2, q + 3) == 7)
      poses.push_back(pose);
    const std::vector<fieldtrue_runtime::Pose> corrected = calibration.correct(poses);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      for (double x : corrected[i].position_m) std::printf("%.17g ", x);
      for (double x : corrected[i].orientation_wxyz) std::printf("%.17g ", x);
      std::printf("%s\n", calibration.isInside(poses[i]) ? "inside" : "outside");
    }
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
  }
}
