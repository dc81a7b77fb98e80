#include "calib/correctors/multiquadric/hmq_position.h"

#include <algorithm>
#include <array>

#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {

HmqPosition::HmqPosition(MultiquadricField field, HmqPrecision precision, std::string note)
    : field_(std::move(field)), note_(std::move(note)) {
  if (precision == HmqPrecision::kSingle) single_.emplace(field_);
}

void HmqPosition::values(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const {
  if (single_)
    single_->value3(p_m, f);
  else
    field_.value3(p_m, f);
}

Eigen::Vector3d HmqPosition::displacement_m(const Eigen::Vector3d& p_tracked_m) const {
  Eigen::Vector3d p_true_m;
  values(std::span(&p_tracked_m, 1), std::span(&p_true_m, 1));
  return p_true_m - p_tracked_m;
}

void HmqPosition::correct(std::span<const Eigen::Vector3d> p_tracked_m,
                          std::span<Eigen::Vector3d> p_corrected_m) const {
  FT_CHECK(p_tracked_m.size() == p_corrected_m.size());
  constexpr std::size_t kBlock = 256;
  std::array<Eigen::Vector3d, kBlock> p_true_m;
  for (std::size_t start = 0; start < p_tracked_m.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, p_tracked_m.size() - start);
    values(p_tracked_m.subspan(start, count), std::span(p_true_m).first(count));
    // p + (f - p) and not f: the same bits as displacement_m gives.
    for (std::size_t i = 0; i < count; ++i)
      p_corrected_m[start + i] = p_tracked_m[start + i] + (p_true_m[i] - p_tracked_m[start + i]);
  }
}

nlohmann::json HmqPosition::parameters() const {
  nlohmann::json json = field_.toJson();
  json["note"] = note_;
  if (single_) json["precision"] = "single";
  return json;
}

std::unique_ptr<HmqPosition> HmqPosition::fromJson(const JsonReader& parameters) {
  std::string precision = "double";
  parameters.oneOf("precision", precision, {"double", "single"});
  return std::make_unique<HmqPosition>(MultiquadricField::fromJson(parameters, 3),
                                       precision == "single" ? HmqPrecision::kSingle : HmqPrecision::kDouble,
                                       parameters["note"].text());
}

}  // namespace fieldtrue::correctors
