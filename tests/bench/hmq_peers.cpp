#include "tests/bench/hmq_peers.h"

#include <vtkNew.h>
#include <vtkPoints.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace fieldtrue::bench {

alglib::rbfmodel fitAlglib(const correctors::FitData& data) {
  const auto count = static_cast<alglib::ae_int_t>(data.size());
  alglib::real_2d_array xy;
  xy.setlength(count, 6);
  for (alglib::ae_int_t i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      xy[i][axis] = data.p_tracked_m[static_cast<std::size_t>(i)][axis];
      xy[i][3 + axis] = data.p_true_m[static_cast<std::size_t>(i)][axis];
    }
  }
  alglib::rbfmodel model;
  alglib::rbfcreate(3, 3, model);
  alglib::rbfsetpoints(model, xy);
  alglib::rbfsetalgomultiquadricmanual(model, kR_m, 0.0);
  alglib::rbfreport report;
  alglib::rbfbuildmodel(model, report);
  if (report.terminationtype <= 0) std::fprintf(stderr, "ALGLIB did not solve the problem\n");
  return model;
}

vtkSmartPointer<vtkThinPlateSplineTransform> fitVtk(const correctors::FitData& data) {
  vtkNew<vtkPoints> source;
  vtkNew<vtkPoints> target;
  source->SetDataTypeToDouble();
  target->SetDataTypeToDouble();
  for (std::size_t i = 0; i < data.size(); ++i) {
    source->InsertNextPoint(data.p_tracked_m[i].data());
    target->InsertNextPoint(data.p_true_m[i].data());
  }
  auto transform = vtkSmartPointer<vtkThinPlateSplineTransform>::New();
  transform->SetBasisToR();
  transform->SetSourceLandmarks(source);
  transform->SetTargetLandmarks(target);
  transform->Update();
  return transform;
}

PlainMultiquadric plainTerms(const correctors::FitData& data) {
  PlainMultiquadric plain;
  for (std::size_t i = 0; i < data.size(); ++i) plain.terms.push_back({data.p_tracked_m[i], data.p_true_m[i]});
  return plain;
}

namespace {

void writePoints(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points_m) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(points_m.data()),
            static_cast<std::streamsize>(points_m.size() * sizeof(Eigen::Vector3d)));
}

std::string outputOf(const std::string& command) {
  std::string text;
  FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return text;
  char buffer[512];
  while (const std::size_t count = std::fread(buffer, 1, sizeof buffer, pipe)) text.append(buffer, count);
  ::pclose(pipe);
  return text;
}

}  // namespace

std::optional<ScipyTimes> runScipy(const correctors::FitData& data, const std::vector<Eigen::Vector3d>& points_m) {
  std::string folder_name = (std::filesystem::temp_directory_path() / "fieldtrue-bench-XXXXXX").string();
  if (::mkdtemp(folder_name.data()) == nullptr) return std::nullopt;
  const std::filesystem::path folder(folder_name);
  writePoints(folder / "tracked.f64", data.p_tracked_m);
  writePoints(folder / "true.f64", data.p_true_m);
  writePoints(folder / "points.f64", points_m);
  std::optional<ScipyTimes> result;
  // The first python3 of the path may be one without Debian's packages.
  for (const char* python : {"python3", "/usr/bin/python3"}) {
    const std::string text = outputOf(std::string(python) + " '" FIELDTRUE_SCIPY_PEER "' '" + folder_name + "' " +
                                      std::to_string(kR_m) + " 2>/dev/null");
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) continue;
    result = ScipyTimes{json.at("scipy").get<std::string>(), json.at("times_s").get<std::map<std::string, double>>()};
    break;
  }
  std::filesystem::remove_all(folder);
  if (!result) std::fprintf(stderr, "SciPy is left out: no python3 here imports scipy (package python3-scipy)\n");
  return result;
}

}  // namespace fieldtrue::bench
