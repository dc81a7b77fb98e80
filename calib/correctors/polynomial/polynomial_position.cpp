#include "calib/correctors/polynomial/polynomial_position.h"

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/polynomial/polynomial_hold_out.h"

namespace fieldtrue::correctors {
namespace {

class PolynomialPosition : public PositionModel {
 public:
  explicit PolynomialPosition(ChosenPolynomial polynomial) : polynomial_(std::move(polynomial)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return polynomial_.field.value(p_tracked_m);
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return Eigen::Matrix3d::Identity() + polynomial_.field.gradient(p_tracked_m);
  }
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return polynomial_.field.standardError(p_tracked_m);
  }
  int coefficients() const override { return polynomial_.field.terms(); }
  std::string note() const override { return polynomial_.note(); }
  nlohmann::json parameters() const override { return polynomial_.toJson(); }

 private:
  ChosenPolynomial polynomial_;
};

class PolynomialPositionHoldOut : public HoldOutFits<PositionModel> {
 public:
  PolynomialPositionHoldOut(PolynomialHoldOut fits, std::string degree_note)
      : fits_(std::move(fits)), degree_note_(std::move(degree_note)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    // d = R q + t - p with q = p + d' of the data: R d' + (R - I) p + t.
    const Eigen::Matrix3d R = fold_from_data.orientation.toRotationMatrix();
    const ValueChange change{R, R - Eigen::Matrix3d::Identity(), fold_from_data.position_m};
    return fits_.without(rows, change).map([this](PolynomialField field) -> std::unique_ptr<PositionModel> {
      return std::make_unique<PolynomialPosition>(ChosenPolynomial{std::move(field), degree_note_});
    });
  }

 private:
  PolynomialHoldOut fits_;
  std::string degree_note_;
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

std::vector<Eigen::Vector3d> displacements_m(const FitData& data) {
  // Section 3.4 fits v = p - q and subtracts it; here d = q - p is fitted and added.
  std::vector<Eigen::Vector3d> d_m(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) d_m[i] = data.p_true_m[i] - data.p_tracked_m[i];
  return d_m;
}

Result<std::unique_ptr<PositionModel>> fitPolynomialPosition(const FitData& data, const PolynomialDegree& degree,
                                                             const std::string& name) {
  FT_TRY_VOID(checkPositions(data, name));
  const std::vector<Eigen::Vector3d> d_m = displacements_m(data);
  const PolynomialProblem problem{
      name, data.p_tracked_m, d_m, degree.degree, data.dimension, mergePlaces(data).size(), fewestLevels(data)};
  return PolynomialField::fit(problem).map([&](PolynomialField field) -> std::unique_ptr<PositionModel> {
    return std::make_unique<PolynomialPosition>(ChosenPolynomial{std::move(field), degree.note});
  });
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutPolynomialPosition(const FitData& data,
                                                                              const PolynomialDegree& degree,
                                                                              const std::string& name) {
  FT_TRY_VOID(checkPositions(data, name));
  const std::vector<Eigen::Vector3d> d_m = displacements_m(data);
  Places places = mergePlaces(data);
  const PolynomialProblem problem{name,          data.p_tracked_m,  d_m, degree.degree, data.dimension,
                                  places.size(), fewestLevels(data)};
  return PolynomialHoldOut::make(problem, std::move(places))
      .map([&](PolynomialHoldOut fits) -> std::unique_ptr<HoldOutFits<PositionModel>> {
        return std::make_unique<PolynomialPositionHoldOut>(std::move(fits), degree.note);
      });
}

std::unique_ptr<PositionModel> readPolynomialPosition(const JsonReader& parameters) {
  return std::make_unique<PolynomialPosition>(ChosenPolynomial::fromJson(parameters));
}

}  // namespace fieldtrue::correctors
