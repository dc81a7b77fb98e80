#include "calib/correctors/polynomial_position.h"

#include "calib/correctors/fit_checks.h"
#include "calib/correctors/json_values.h"

namespace fieldtrue {
namespace {

class PolynomialPosition : public PositionModel {
 public:
  explicit PolynomialPosition(PolynomialField field) : field_(std::move(field)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return field_.value(p_tracked_m);
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return Eigen::Matrix3d::Identity() + field_.gradient(p_tracked_m);
  }
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return field_.standardError(p_tracked_m);
  }
  std::string note() const override { return polynomialNote(field_); }
  nlohmann::json parameters() const override { return field_.toJson(); }

 private:
  PolynomialField field_;
};

}  // namespace

std::string polynomialNote(const PolynomialField& field) {
  constexpr double kPoorPivotRatio = 1e-3;
  std::string note;
  if (field.dimension() == 2) note = "The places lie in one plane: fitted in the plane, and nothing is claimed off it.";
  if (field.pivotRatio() < kPoorPivotRatio)
    note += std::string(note.empty() ? "" : " ") +
            "The highest terms are poorly determined by these places; a lower degree or more levels would be safer.";
  return note;
}

Result<std::unique_ptr<PositionModel>> fitPolynomialPosition(const FitData& data, int degree, const std::string& name) {
  if (auto checked = checkPositions(data, name); !checked) return tl::unexpected(checked.error());
  // Section 3.4 fits v = p - q and subtracts it; here d = q - p is fitted and added.
  std::vector<Eigen::Vector3d> displacements_m(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) displacements_m[i] = data.p_true_m[i] - data.p_tracked_m[i];
  const PolynomialProblem problem{name,   data.p_tracked_m, displacements_m,
                                  degree, data.dimension,   mergePlaces(data).size()};
  return PolynomialField::fit(problem).map([](PolynomialField field) -> std::unique_ptr<PositionModel> {
    return std::make_unique<PolynomialPosition>(std::move(field));
  });
}

Result<std::unique_ptr<PositionModel>> loadPolynomialPosition(const nlohmann::json& parameters,
                                                              const std::string& name) {
  return guarded<std::unique_ptr<PositionModel>>(
      "parameters of " + name, [&]() -> Result<std::unique_ptr<PositionModel>> {
        return std::make_unique<PolynomialPosition>(PolynomialField::fromJson(parameters));
      });
}

}  // namespace fieldtrue
