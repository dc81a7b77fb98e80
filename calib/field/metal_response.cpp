#include "calib/field/metal_response.h"

#include <cmath>

#include "calib/core/error.h"
#include "calib/core/units.h"

namespace fieldtrue::field {

namespace {

using Complex = std::complex<double>;

/// Stands for the limit of high frequency [1/s].
constexpr double kVeryFast_per_s = 1e18;

/// tanh without overflow; of an argument in the right half-plane.
Complex tanhOf(const Complex& z) {
  if (z.real() > 20.0) return 1.0;
  const Complex e = std::exp(-2.0 * z);
  return (1.0 - e) / (1.0 + e);
}

/// tanh(x)/x, x = gamma d/2: how evenly a field alike on both sides fills a sheet.
Complex evennessThrough(const MetalSheet& sheet, Complex s) {
  const Metal& metal = sheet.metal;
  const Complex x =
      0.5 * sheet.thickness_m * std::sqrt(s * kMu0_h_per_m * metal.relative_permeability * metal.conductivity_s_per_m);
  return std::abs(x) < 1e-4 ? Complex(1.0) : tanhOf(x) / x;
}

}  // namespace

double stepResponse(const SpectralResponse& response, double time_s) {
  FT_CHECK(time_s >= 0.0);
  if (time_s == 0.0) return response(kVeryFast_per_s).real();
  constexpr int kTerms = 24;
  const double r = 2.0 * kTerms / (5.0 * time_s);
  double sum = 0.5 * std::exp(r * time_s) * (response(r) / r).real();
  for (int k = 1; k < kTerms; ++k) {
    const double theta = k * kPi / kTerms;
    const double cotangent = 1.0 / std::tan(theta);
    const Complex s = r * theta * Complex(cotangent, 1.0);
    const double sigma = theta + (theta * cotangent - 1.0) * cotangent;
    sum += (std::exp(time_s * s) * response(s) / s * Complex(1.0, sigma)).real();
  }
  return r / kTerms * sum;
}

double seenResponse(const SpectralResponse& response, const Excitation& excitation) {
  if (excitation.is_pulsed_dc) return stepResponse(response, excitation.sampling_delay_s);
  return response(Complex(0.0, 2.0 * kPi * excitation.carrier_hz)).real();
}

double skinDepth_m(const Metal& metal, double frequency_hz) {
  return 1.0 / std::sqrt(kPi * frequency_hz * kMu0_h_per_m * metal.relative_permeability * metal.conductivity_s_per_m);
}

std::complex<double> sphereSusceptibility(double radius_m, const Metal& metal, std::complex<double> s) {
  const double mu_r = metal.relative_permeability;
  const Complex a2 = s * kMu0_h_per_m * mu_r * metal.conductivity_s_per_m * radius_m * radius_m;
  if (std::abs(a2) < 1e-2) {
    // alpha - tanh(alpha) cancels; the series of both over alpha^3.
    const Complex difference =
        1.0 / 3.0 + a2 * (-2.0 / 15.0 + a2 * (17.0 / 315.0 + a2 * (-62.0 / 2835.0 + a2 * 1382.0 / 155925.0)));
    const Complex other =
        1.0 + a2 * (-1.0 / 3.0 + a2 * (2.0 / 15.0 + a2 * (-17.0 / 315.0 + a2 * 62.0 / 2835.0))) - difference;
    return 1.5 * (2.0 * mu_r * difference - other) / (mu_r * difference + other);
  }
  const Complex a = std::sqrt(a2);
  const Complex T = tanhOf(a);
  const Complex difference = a - T;
  const Complex other = a2 * T - a + T;
  return 1.5 * (2.0 * mu_r * difference - other) / (mu_r * difference + other);
}

double sphereSusceptibility(double radius_m, const Metal& metal, const Excitation& excitation) {
  return seenResponse([&](Complex s) { return sphereSusceptibility(radius_m, metal, s); }, excitation);
}

std::complex<double> slabReflection(double k_per_m, const Metal& metal, std::optional<double> thickness_m,
                                    std::complex<double> s) {
  const double mu_k = metal.relative_permeability * k_per_m;
  const Complex u2 = k_per_m * k_per_m + s * kMu0_h_per_m * metal.relative_permeability * metal.conductivity_s_per_m;
  const Complex u = std::sqrt(u2);
  if (!thickness_m) return (u - mu_k) / (u + mu_k);
  const Complex T = tanhOf(u * *thickness_m);
  return (u2 - mu_k * mu_k) * T / (2.0 * mu_k * u + (u2 + mu_k * mu_k) * T);
}

double sheetCurrentShare(const MetalSheet& sheet, double rate_per_m, const Excitation& excitation) {
  const auto response = [&](Complex s) {
    const Complex sheet_ohm = 1.0 / (sheet.metal.conductivity_s_per_m * sheet.thickness_m * evennessThrough(sheet, s));
    return s / (s + rate_per_m * sheet_ohm / kMu0_h_per_m);
  };
  return seenResponse(response, excitation);
}

double sheetChargeShare(const MetalSheet& sheet, double rate_per_m, const Excitation& excitation) {
  const auto response = [&](Complex s) {
    const Complex magnetised =
        (sheet.metal.relative_permeability * evennessThrough(sheet, s) - 1.0) * sheet.thickness_m * rate_per_m;
    return magnetised / (1.0 + magnetised);
  };
  return seenResponse(response, excitation);
}

double inductiveShare(double rate_per_s, const Excitation& excitation) {
  if (excitation.is_pulsed_dc) return std::exp(-rate_per_s * excitation.sampling_delay_s);
  const double w = 2.0 * kPi * excitation.carrier_hz;
  return w * w / (w * w + rate_per_s * rate_per_s);
}

}  // namespace fieldtrue::field
