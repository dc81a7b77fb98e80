#include "calib/correctors/hmq.h"

#include <algorithm>
#include <array>

#include "calib/correctors/fit_checks.h"
#include "calib/correctors/hmq_field.h"
#include "calib/correctors/json_values.h"
#include "calib/correctors/shared_settings.h"

namespace fieldtrue {
namespace {

class HmqPosition : public PositionModel {
 public:
  HmqPosition(MultiquadricField field, std::string note) : field_(std::move(field)), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    Eigen::Vector3d p_true_m;
    field_.value3(std::span(&p_tracked_m, 1), std::span(&p_true_m, 1));
    return p_true_m - p_tracked_m;
  }

  void correct(std::span<const Eigen::Vector3d> p_tracked_m, std::span<Eigen::Vector3d> p_corrected_m) const override {
    FT_CHECK(p_tracked_m.size() == p_corrected_m.size());
    constexpr std::size_t kBlock = 256;
    std::array<Eigen::Vector3d, kBlock> p_true_m;
    for (std::size_t start = 0; start < p_tracked_m.size(); start += kBlock) {
      const std::size_t count = std::min(kBlock, p_tracked_m.size() - start);
      field_.value3(p_tracked_m.subspan(start, count), std::span(p_true_m).first(count));
      // p + (f - p) and not f: the same bits as displacement_m gives.
      for (std::size_t i = 0; i < count; ++i)
        p_corrected_m[start + i] = p_tracked_m[start + i] + (p_true_m[i] - p_tracked_m[start + i]);
    }
  }

  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override { return field_.gradient3(p_tracked_m); }
  std::string note() const override { return note_; }

  nlohmann::json parameters() const override {
    nlohmann::json json = field_.toJson();
    json["note"] = note_;
    return json;
  }

 private:
  MultiquadricField field_;
  std::string note_;
};

Result<std::unique_ptr<PositionModel>> fitHmq(const FitData& data, const Settings& settings,
                                              const RunControl& control) {
  const std::string name = "Hardy's multiquadric";
  if (auto checked = checkPositions(data, name); !checked) return tl::unexpected(checked.error());
  // An interpolator cannot pass through two values at one place.
  const Places places = mergePlaces(data);
  if (data.dimension < 2)
    return fail(ErrorCode::kDegenerate, name + " needs places that span a plane or a volume, and these " +
                                            std::to_string(places.size()) + " lie " +
                                            (data.dimension == 1 ? "on one line" : "at one point"));
  Eigen::MatrixXd p_true_m(static_cast<Eigen::Index>(places.size()), 3);
  for (std::size_t i = 0; i < places.size(); ++i)
    p_true_m.row(static_cast<Eigen::Index>(i)) = places.p_true_m[i].transpose();
  const double r2_m2 = 1e-4 * numberSetting(settings, "r2_cm2");
  auto field = MultiquadricField::fit(name, places.p_tracked_m, places.node, p_true_m, r2_m2, control);
  if (!field) return tl::unexpected(field.error());
  return std::make_unique<HmqPosition>(*std::move(field), planeNote(data, "nothing is claimed off it"));
}

Result<std::unique_ptr<PositionModel>> loadHmq(const nlohmann::json& parameters) {
  return guarded<std::unique_ptr<PositionModel>>("parameters of hmq", [&]() -> Result<std::unique_ptr<PositionModel>> {
    return std::make_unique<HmqPosition>(MultiquadricField::fromJson(parameters, 3),
                                         parameters.at("note").get<std::string>());
  });
}

}  // namespace

PositionMethod hmqPosition() {
  return {"hmq",
          "Hardy's multiquadric",
          "Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18",
          {r2Setting()},
          fitHmq,
          loadHmq};
}

}  // namespace fieldtrue
