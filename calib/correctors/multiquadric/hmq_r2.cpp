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
constexpr double kLowest_cm2 = 10.0;
constexpr double kHighest_cm2 = 1000.0;
constexpr std::size_t kValues = 9;
constexpr int kRounds = 3;
/// Above this many places each trial's matrix (50 MB and more) stands alone in memory.
constexpr std::size_t kMostSideBySide = 2500;

/// Three digits, as the decimal text of the note reads back: what is said is what was used.
double roundedR2_cm2(double power) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", std::pow(10.0, power));
  return std::clamp(std::strtod(text, nullptr), kLowest_cm2, kHighest_cm2);
}

/// RMS over places of the leave-one-out residual's length.
Result<double> leaveOneOutRms(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                              double r2_m2, const RunControl& control) {
  FT_TRY(auto system, MultiquadricSystem::factorise(name, places, r2_m2, control));
  FT_TRY(const auto alpha, system.solve(values));
  const Eigen::ArrayXd inverse_diagonal = std::move(system).takeInverse().diagonal();
  return std::sqrt((alpha.rowwise().squaredNorm().array() / inverse_diagonal.square()).mean());
}

struct TriedR2 {
  double r2_cm2 = 0.0;
  double rms = HUGE_VAL;
};

Result<TriedR2> bestR2(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                       const RunControl& control) {
  TriedR2 best;
  double low = std::log10(kLowest_cm2);
  double high = std::log10(kHighest_cm2);
  for (int round = 0; round < kRounds; ++round) {
    const double step = (high - low) / (kValues - 1);
    std::array<TriedR2, kValues> tried;
    std::array<std::optional<Error>, kValues> errors;
    const auto attempt = [&](std::size_t i) {
      tried[i].r2_cm2 = roundedR2_cm2(low + step * static_cast<double>(i));
      const auto rms = leaveOneOutRms(name, places, values, kM2PerCm2 * tried[i].r2_cm2, control);
      if (rms)
        tried[i].rms = *rms;
      else
        errors[i] = rms.error();
    };
    if (places.size() > kMostSideBySide)
      serialFor(kValues, attempt);
    else
      control.parallel_for(kValues, attempt);
    // Places too close together for one R squared may do for a smaller one; every other error ends the search.
    for (const auto& error : errors)
      if (error && error->code != ErrorCode::kDegenerate) return tl::unexpected(*error);
    for (const TriedR2& one : tried)
      if (one.rms < best.rms) best = one;
    if (!std::isfinite(best.rms)) return tl::unexpected(*errors[0]);
    control.progress(static_cast<double>(round + 1) / kRounds);
    const double power = std::log10(best.r2_cm2);
    low = std::max(power - step, std::log10(kLowest_cm2));
    high = std::min(power + step, std::log10(kHighest_cm2));
  }
  return best;
}

}  // namespace

Result<ChosenR2> chooseR2(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                          const Settings& settings, std::string (*residual_text)(double rms),
                          const RunControl& control) {
  const SettingValue& setting = settings.at("r2_cm2");
  if (std::holds_alternative<double>(setting)) return ChosenR2{kM2PerCm2 * std::get<double>(setting), {}};
  if (places.size() < 3)
    return fail(ErrorCode::kTooFewNodes,
                name + " needs 3 places to choose R squared by leaving each out, got " + std::to_string(places.size()));
  FT_TRY(const auto best, bestR2(name, places, values, control));
  std::string note = "R squared = " + formatNumber(best.r2_cm2) + " cm2, chosen by leave-one-out (RMS " +
                     residual_text(best.rms) + ")";
  if (best.r2_cm2 <= kLowest_cm2) note += ", the lower end of its range";
  if (best.r2_cm2 >= kHighest_cm2) note += ", the upper end of its range";
  return ChosenR2{kM2PerCm2 * best.r2_cm2, note + "."};
}

double multiquadricMatrices(std::size_t n_places) {
  constexpr double kHeldOut = 2.0;  // The inverse, and the system of a fold that has to be fitted anew.
  return n_places > kMostSideBySide ? kHeldOut : kValues;
}

Setting r2Setting() {
  return declare::autoNumber("r2_cm2", "R squared", {kLowest_cm2, kHighest_cm2, "cm2"}, 100.0,
                             "Smoothness of the multiquadric: larger is smoother; auto takes what predicts left-out "
                             "places best. The survey gives 10 to 1000 without a unit; read as cm2.");
}

}  // namespace fieldtrue::correctors
