#include "calib/correctors/multiquadric/hmq_r2.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "calib/core/declare.h"
#include "calib/core/file_io.h"
#include "calib/correctors/multiquadric/hmq_system.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kM2PerCm2 = 1e-4;
/// The setting's range, as powers of ten of cm2.
constexpr double kLowestPower = 1.0;
constexpr double kHighestPower = 3.0;
constexpr int kGridValues = 9;
constexpr int kRefinements = 8;
/// Above this many places each trial's matrix (50 MB and more) stands alone in memory.
constexpr std::size_t kMostSideBySide = 2500;

/// Three digits, as the decimal text of the note reads back: what is said is what was used.
double roundedR2_cm2(double power) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", std::pow(10.0, power));
  return std::clamp(std::strtod(text, nullptr), 10.0, 1000.0);
}

/// Tries values of R squared and remembers the best; where a system cannot be solved the residual counts as infinite.
class R2Search {
 public:
  R2Search(const std::string& name, const Places& places, const Eigen::MatrixXd& values, const RunControl& control)
      : name_(name), places_(places), values_(values), control_(control) {}

  Result<double> best_cm2(double* rms) {
    std::array<Result<double>, kGridValues> grid;
    const auto body = [&](std::size_t i) { grid[i] = residual(gridPower(i)); };
    if (places_.size() > kMostSideBySide)
      serialFor(kGridValues, body);
    else
      control_.parallel_for(kGridValues, body);
    for (std::size_t i = 0; i < kGridValues; ++i) FT_TRY_VOID(remember(gridPower(i), grid[i]));
    if (!std::isfinite(best_rms_)) return tl::unexpected(grid[0].error());
    FT_TRY_VOID(refine());
    *rms = best_rms_;
    return roundedR2_cm2(best_power_);
  }

 private:
  static double gridPower(std::size_t i) {
    return kLowestPower + (kHighestPower - kLowestPower) * static_cast<double>(i) / (kGridValues - 1);
  }

  Result<double> residual(double power) const {
    return leaveOneOutRms(name_, places_, values_, kM2PerCm2 * roundedR2_cm2(power), control_);
  }

  /// Places too close together for one R squared may do for a smaller one; every other error ends the search.
  Result<double> remember(double power, const Result<double>& tried) {
    if (!tried && tried.error().code != ErrorCode::kDegenerate) return tl::unexpected(tried.error());
    const double rms = tried.value_or(HUGE_VAL);
    if (rms < best_rms_) {
      best_rms_ = rms;
      best_power_ = power;
    }
    return rms;
  }

  Result<void> refine() {
    constexpr double kStep = (kHighestPower - kLowestPower) / (kGridValues - 1);
    const double golden = (std::sqrt(5.0) - 1.0) / 2.0;
    double low = std::max(best_power_ - kStep, kLowestPower);
    double high = std::min(best_power_ + kStep, kHighestPower);
    std::array<double, 2> power = {high - golden * (high - low), low + golden * (high - low)};
    std::array<double, 2> rms = {HUGE_VAL, HUGE_VAL};
    std::array<bool, 2> known = {false, false};
    for (int step = 0; step < kRefinements; ++step) {
      for (std::size_t side = 0; side < 2; ++side) {
        if (known[side]) continue;
        FT_TRY(const auto tried, remember(power[side], residual(power[side])));
        rms[side] = tried;
        known[side] = true;
      }
      control_.progress(0.5 + 0.5 * (step + 1) / kRefinements);
      const bool left = rms[0] <= rms[1];
      if (left) {
        high = power[1];
        power = {high - golden * (high - low), power[0]};
        rms[1] = rms[0];
      } else {
        low = power[0];
        power = {power[1], low + golden * (high - low)};
        rms[0] = rms[1];
      }
      known = {!left, left};
    }
    return {};
  }

  const std::string& name_;
  const Places& places_;
  const Eigen::MatrixXd& values_;
  const RunControl& control_;
  double best_power_ = 0.0;
  double best_rms_ = HUGE_VAL;
};

}  // namespace

Result<double> leaveOneOutRms(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                              double r2_m2, const RunControl& control) {
  FT_TRY(auto system,
         MultiquadricSystem::factorise(name, places.p_tracked_m, places.node, places.index, r2_m2, control));
  FT_TRY(const auto alpha, system.solve(values));
  const Eigen::VectorXd inverse_diagonal = std::move(system).takeInverseDiagonal();
  const Eigen::ArrayXd squares = alpha.rowwise().squaredNorm().array() / inverse_diagonal.array().square();
  return std::sqrt(squares.mean());
}

Result<ChosenR2> chooseR2(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                          const Settings& settings, std::string (*residual_text)(double rms),
                          const RunControl& control) {
  const SettingValue& setting = settings.at("r2_cm2");
  if (std::holds_alternative<double>(setting)) return ChosenR2{kM2PerCm2 * std::get<double>(setting), {}};
  if (places.size() < 3)
    return fail(ErrorCode::kTooFewNodes,
                name + " needs 3 places to choose R squared by leaving each out, got " + std::to_string(places.size()));
  double rms = 0.0;
  FT_TRY(const auto best_cm2, R2Search(name, places, values, control).best_cm2(&rms));
  std::string note =
      "R squared = " + formatNumber(best_cm2) + " cm2, chosen by leave-one-out (RMS " + residual_text(rms) + ")";
  if (best_cm2 <= 10.0 || best_cm2 >= 1000.0)
    note += best_cm2 <= 10.0 ? ", the lower end of its range" : ", the upper end of its range";
  return ChosenR2{kM2PerCm2 * best_cm2, note + "."};
}

double multiquadricMatrices(std::size_t n_places) {
  constexpr double kHeldOut = 2.0;  // The inverse, and the system of a fold that has to be fitted anew.
  return n_places > kMostSideBySide ? kHeldOut : kGridValues;
}

Setting r2Setting() {
  return declare::autoNumber("r2_cm2", "R squared", {10.0, 1000.0, "cm2"}, 100.0,
                             "Smoothness of the multiquadric: larger is smoother; auto takes what predicts left-out "
                             "places best. The survey gives 10 to 1000 without a unit; read as cm2.");
}

}  // namespace fieldtrue::correctors
