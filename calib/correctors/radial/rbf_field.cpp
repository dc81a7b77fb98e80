#include "calib/correctors/radial/rbf_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/core/json_reader.h"
#include "calib/correctors/multiquadric/hmq_kernel.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kBlock = 256;

constexpr std::array<std::pair<RadialKernel, const char*>, 6> kKernelNames = {
    {{RadialKernel::kMultiquadric, "multiquadric"},
     {RadialKernel::kInverseMultiquadric, "inverse_multiquadric"},
     {RadialKernel::kCubic, "cubic"},
     {RadialKernel::kThinPlate, "thin_plate"},
     {RadialKernel::kMatern32, "matern_3_2"},
     {RadialKernel::kMatern52, "matern_5_2"}}};

/// Coordinates of places in a frame, one array each.
struct LocalArrays {
  std::vector<double> x, y, z;

  LocalArrays(const FieldFrame& frame, std::span<const Eigen::Vector3d> p_m) {
    for (const Eigen::Vector3d& place_m : p_m) {
      const Eigen::Vector3d u = frame.local(place_m);
      x.push_back(u.x());
      y.push_back(u.y());
      z.push_back(u.z());
    }
  }
};

}  // namespace

std::string toText(RadialKernel kernel) {
  for (const auto& [known, name] : kKernelNames)
    if (known == kernel) return name;
  return {};
}

std::optional<RadialKernel> radialKernelFrom(const std::string& text) {
  for (const auto& [known, name] : kKernelNames)
    if (name == text) return known;
  return std::nullopt;
}

FieldFrame FieldFrame::around(std::span<const Eigen::Vector3d> p_m, int dimension, double unit_m) {
  FT_CHECK(!p_m.empty() && dimension >= 2 && unit_m > 0.0);
  FieldFrame frame;
  frame.dimension = dimension;
  for (const Eigen::Vector3d& place_m : p_m) frame.center_m += place_m / static_cast<double>(p_m.size());
  frame.per_m.setConstant(1.0 / unit_m);
  if (dimension == 2) {
    frame.axes = pointSpread(p_m).axes;
    frame.per_m.z() = 0.0;
  }
  return frame;
}

Eigen::MatrixXd FieldFrame::tail(std::span<const Eigen::Vector3d> p_m) const {
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(p_m.size()), 1 + dimension);
  for (std::size_t i = 0; i < p_m.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    matrix(row, 0) = 1.0;
    matrix.row(row).tail(dimension) = local(p_m[i]).head(dimension).transpose();
  }
  return matrix;
}

nlohmann::json FieldFrame::toJson() const {
  return {{"center_m", jsonOf(center_m)},
          {"axes", jsonOf(Eigen::MatrixXd(axes))},
          {"per_m", jsonOf(per_m)},
          {"dimension", dimension}};
}

FieldFrame FieldFrame::fromJson(const JsonReader& json) {
  FieldFrame frame;
  frame.center_m = json["center_m"].vector3();
  frame.axes = json["axes"].matrix3();
  frame.per_m = json["per_m"].vector3();
  frame.dimension = static_cast<int>(json["dimension"].integer(2, 3));
  if (!(frame.per_m.head(frame.dimension).minCoeff() > 0.0) || frame.per_m.z() < 0.0)
    json["per_m"].refuse("a number above 0 for each axis of the field");
  return frame;
}

double rmsSpread_m(std::span<const Eigen::Vector3d> p_m) {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place_m : p_m) center_m += place_m / static_cast<double>(p_m.size());
  double squares_m2 = 0.0;
  for (const Eigen::Vector3d& place_m : p_m) squares_m2 += (place_m - center_m).squaredNorm();
  const double spread_m = std::sqrt(squares_m2 / static_cast<double>(p_m.size()));
  return spread_m > 0.0 ? spread_m : 1.0;
}

RadialField::RadialField(RadialKernel kernel, double c2, const FieldFrame& frame,
                         std::span<const Eigen::Vector3d> centers_m, const RadialSolution& solution)
    : kernel_(kernel), c2_(c2), frame_(frame), centers_m_(centers_m.begin(), centers_m.end()) {
  FT_CHECK(solution.coefficients.rows() == static_cast<Eigen::Index>(centers_m.size()));
  FT_CHECK(solution.coefficients.cols() == 3 && solution.tail.cols() == 3);
  FT_CHECK(solution.tail.rows() == 1 + frame.dimension);
  LocalArrays local(frame, centers_m);
  x_ = std::move(local.x);
  y_ = std::move(local.y);
  z_ = std::move(local.z);
  coefficients_ = solution.coefficients;
  tail_.setZero();
  tail_.topRows(solution.tail.rows()) = solution.tail;
}

RadialArrays RadialField::arrays(std::size_t start, std::size_t count) const {
  return {x_.data() + start, y_.data() + start, z_.data() + start, count};
}

Eigen::Vector3d RadialField::value(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d u = frame_.local(p_m);
  Eigen::Vector3d sum = tail_.row(0).transpose() + tail_.bottomRows<3>().transpose() * u;
  std::array<double, kBlock> weights;
  for (std::size_t start = 0; start < x_.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, x_.size() - start);
    squaredDistances(arrays(start, count), u.data(), weights.data());
    radialValues(kernel_, c2_, weights.data(), count, weights.data());
    for (Eigen::Index k = 0; k < 3; ++k)
      sum[k] += dotProduct(coefficients_.col(k).data() + start, weights.data(), count);
  }
  return sum;
}

Eigen::Matrix3d RadialField::gradient(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d u = frame_.local(p_m);
  Eigen::Matrix3d local_gradient = tail_.bottomRows<3>().transpose();
  std::array<double, kBlock> slopes;
  for (std::size_t start = 0; start < x_.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, x_.size() - start);
    squaredDistances(arrays(start, count), u.data(), slopes.data());
    radialSlopes(kernel_, c2_, slopes.data(), count, slopes.data());
    for (std::size_t j = 0; j < count; ++j) {
      const Eigen::Vector3d from_center = u - Eigen::Vector3d(x_[start + j], y_[start + j], z_[start + j]);
      local_gradient +=
          coefficients_.row(static_cast<Eigen::Index>(start + j)).transpose() * (slopes[j] * from_center).transpose();
    }
  }
  return local_gradient * frame_.per_m.asDiagonal() * frame_.axes.transpose();
}

Eigen::VectorXd RadialField::kernelValues(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d u = frame_.local(p_m);
  Eigen::VectorXd values(static_cast<Eigen::Index>(x_.size()));
  squaredDistances(arrays(0, x_.size()), u.data(), values.data());
  radialValues(kernel_, c2_, values.data(), x_.size(), values.data());
  return values;
}

Eigen::MatrixXd kernelMatrix(RadialKernel kernel, double c2, const FieldFrame& frame,
                             std::span<const Eigen::Vector3d> p_m) {
  const LocalArrays local(frame, p_m);
  const auto n = static_cast<Eigen::Index>(p_m.size());
  Eigen::MatrixXd matrix(n, n);
  for (std::size_t j = 0; j < p_m.size(); ++j) {
    const std::array<double, 3> u = {local.x[j], local.y[j], local.z[j]};
    const std::size_t count = p_m.size() - j;
    double* below = matrix.col(static_cast<Eigen::Index>(j)).data() + j;
    squaredDistances({local.x.data() + j, local.y.data() + j, local.z.data() + j, count}, u.data(), below);
    radialValues(kernel, c2, below, count, below);
  }
  return matrix;
}

nlohmann::json RadialField::toJson() const {
  nlohmann::json centers = nlohmann::json::array();
  for (const Eigen::Vector3d& center_m : centers_m_) centers.push_back(jsonOf(center_m));
  return {{"kernel", toText(kernel_)},
          {"shape_squared", c2_},
          {"frame", frame_.toJson()},
          {"centers_m", std::move(centers)},
          {"coefficients", jsonOf(Eigen::MatrixXd(coefficients_))},
          {"tail", jsonOf(Eigen::MatrixXd(tail_.topRows(1 + frame_.dimension)))}};
}

RadialField RadialField::fromJson(const JsonReader& json) {
  const auto kernel = radialKernelFrom(json["kernel"].text());
  if (!kernel) json["kernel"].refuse("the name of a kernel");
  const FieldFrame frame = FieldFrame::fromJson(json["frame"]);
  const Eigen::MatrixXd centers = json["centers_m"].matrix(3);
  const RadialSolution solution{json["coefficients"].matrix(3), json["tail"].matrix(3)};
  if (solution.coefficients.rows() != centers.rows() || solution.tail.rows() != 1 + frame.dimension)
    json.fail("needs as many coefficients as centres and a tail of the frame's dimension.");
  std::vector<Eigen::Vector3d> centers_m;
  for (Eigen::Index i = 0; i < centers.rows(); ++i) centers_m.emplace_back(centers.row(i).transpose());
  const double c2 = json["shape_squared"].number();
  if (!(c2 >= 0.0)) json["shape_squared"].refuse("0 or above");
  return RadialField(*kernel, c2, frame, centers_m, solution);
}

Eigen::VectorXd placeNoise_m2(const FitData& data, const Places& places) {
  Eigen::VectorXd own_m2 = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(places.size()));
  std::vector<double> stated_m2;
  for (std::size_t i = 0; i < places.size() && !data.noise_m2.empty(); ++i) {
    const auto n_rows = static_cast<double>(places.rows[i].size());
    double sum_m2 = 0.0;
    for (const std::size_t row : places.rows[i]) sum_m2 += data.noise_m2[row].trace() / 3.0;
    const double mean_m2 = sum_m2 / (n_rows * n_rows);
    if (!std::isfinite(mean_m2) || !(mean_m2 > 0.0)) continue;
    own_m2[static_cast<Eigen::Index>(i)] = mean_m2;
    stated_m2.push_back(mean_m2);
  }
  if (!stated_m2.empty()) {
    const auto middle = stated_m2.begin() + static_cast<std::ptrdiff_t>(stated_m2.size() / 2);
    std::nth_element(stated_m2.begin(), middle, stated_m2.end());
    for (double& variance_m2 : own_m2)
      if (variance_m2 == 0.0) variance_m2 = *middle;
  }
  return own_m2.array() + data.jig_sd_m * data.jig_sd_m;
}

}  // namespace fieldtrue::correctors
