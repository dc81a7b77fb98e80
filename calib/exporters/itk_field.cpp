#include "calib/exporters/itk_field.h"

#include <charconv>

#include "calib/core/file_io.h"

namespace fieldtrue::exporters {
namespace {

constexpr double kMm = 1000.0;
constexpr double kSquare = 1e-6;  ///< How far axes may be from right angles.

/// Right-anterior-superior to left-posterior-superior; its own inverse.
Eigen::Vector3d flipped(const Eigen::Vector3d& v) { return {-v.x(), -v.y(), v.z()}; }

}  // namespace

ItkField ItkField::of(const LatticeField& field) {
  ItkField itk;
  itk.size = field.points.counts;
  itk.origin_mm = kMm * flipped(field.points.origin_m);
  itk.spacing_mm = kMm * field.points.pitch_m;
  for (int axis = 0; axis < 3; ++axis) itk.direction.col(axis) = flipped(field.points.axes.col(axis));
  itk.vectors_mm.reserve(field.displacement_m.size());
  for (const Eigen::Vector3d& d_m : field.displacement_m) itk.vectors_mm.emplace_back(kMm * flipped(d_m));
  return itk;
}

Result<LatticeField> ItkField::lattice() const {
  LatticeField field;
  field.points.counts = size;
  if (size[0] < 2 || size[1] < 2 || size[2] < 2 || vectors_mm.size() != field.points.size())
    return fail(ErrorCode::kBadInput, "its sizes " + std::to_string(size[0]) + " " + std::to_string(size[1]) + " " +
                                          std::to_string(size[2]) + " do not match the " +
                                          std::to_string(vectors_mm.size()) + " vectors it holds");
  if (!(spacing_mm.minCoeff() > 0.0) || !spacing_mm.allFinite())
    return fail(ErrorCode::kBadInput, "its spacing must be above 0 along every axis");
  if (!((direction.transpose() * direction - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kSquare))
    return fail(ErrorCode::kBadInput, "its axes are not at right angles");
  field.points.origin_m = flipped(origin_mm) / kMm;
  field.points.pitch_m = spacing_mm / kMm;
  for (int axis = 0; axis < 3; ++axis) field.points.axes.col(axis) = flipped(direction.col(axis));
  for (const Eigen::Vector3d& d_mm : vectors_mm) field.displacement_m.emplace_back(flipped(d_mm) / kMm);
  return field;
}

LatticeForm itkForm(double bytes_per_point) {
  LatticeForm form;
  form.unit = "millimetres";
  form.bytes_per_point = bytes_per_point;
  form.may_be_turned = true;
  return form;
}

Facts itkFacts(Facts facts) {
  facts.emplace_back("world", "LPS; the calibration's frame is taken as RAS: x and y change sign");
  facts.emplace_back("outside", "ITK leaves points outside the lattice where they are");
  return facts;
}

std::string threeNumbers(const Eigen::Vector3d& v, const char* between) {
  return formatNumber(v.x()) + between + formatNumber(v.y()) + between + formatNumber(v.z());
}

Result<std::vector<double>> numbersIn(const std::string& text) {
  constexpr const char* kBetween = " \t\r\n,()[]{}";
  std::vector<double> numbers;
  std::size_t at = text.find_first_not_of(kBetween);
  while (at != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    double number = 0.0;
    const auto read = std::from_chars(text.data() + at, text.data() + end, number);
    if (read.ec != std::errc() || read.ptr != text.data() + end)
      return fail(ErrorCode::kBadInput, "'" + text.substr(at, std::min<std::size_t>(end - at, 40)) + "' is no number");
    numbers.push_back(number);
    at = text.find_first_not_of(kBetween, end);
  }
  return numbers;
}

}  // namespace fieldtrue::exporters
