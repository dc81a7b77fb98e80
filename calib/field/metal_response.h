#pragma once

#include <complex>
#include <functional>
#include <optional>

#include "calib/field/effect.h"

namespace fieldtrue::field {

/// Permeability of free space [H/m].
inline constexpr double kMu0_h_per_m = 1.25663706212e-6;

/// What a metal is made of.
struct Metal {
  double conductivity_s_per_m = 3.5e7;
  double relative_permeability = 1.0;
};

/// How a linear answer depends on s = i w.
using SpectralResponse = std::function<std::complex<double>(std::complex<double> s)>;

/// The part of a linear answer that a tracker's receiver sees: of an AC tracker what is in phase with its carrier
/// (synchronous detection), of a pulsed DC tracker what is left of the answer to a step of the field at the sampling
/// delay.
/// @source AC: Raab et al. 1979; inverse Laplace transform: Abate and Valko 2004, Int. J. Numer. Meth. Eng. 60 979
/// (fixed Talbot)
double seenResponse(const SpectralResponse& response, const Excitation& excitation);

/// Answer to a step at time 0. @param time_s 0 gives the limit of high frequency
double stepResponse(const SpectralResponse& response, double time_s);

/// Depth at which a field at this frequency has fallen to 1/e [m].
double skinDepth_m(const Metal& metal, double frequency_hz);

/// Moment of a sphere per field and volume, chi(s): 3 (mu_r - 1)/(mu_r + 2) at s = 0, -3/2 at high frequency.
/// @source Wait 1951, Geophysics 16 666, eq. 12; as in Grant and West 1965
std::complex<double> sphereSusceptibility(double radius_m, const Metal& metal, std::complex<double> s);
/// What a tracker sees of it.
double sphereSusceptibility(double radius_m, const Metal& metal, const Excitation& excitation);

/// Reflection of a field of horizontal wave number k by a slab: 1 for a perfect conductor, -(mu_r - 1)/(mu_r + 1) for a
/// permeable half-space at rest.
/// @param thickness_m none = a half-space
/// @source Wait 1962, Electromagnetic Waves in Stratified Media, chapter 2 (quasi-static); thin sheet: Saslow 1992, Am.
/// J. Phys. 60 693
std::complex<double> slabReflection(double k_per_m, const Metal& metal, std::optional<double> thickness_m,
                                    std::complex<double> s);

/// A flat sheet.
struct MetalSheet {
  Metal metal;
  double thickness_m = 1e-3;
};

/// What a tracker sees of a mode of a sheet's currents, 1 without resistance: s/(s + rate Z/mu_0) with the sheet
/// impedance Z = (gamma/2 sigma) coth(gamma d/2), gamma^2 = s mu sigma, 1/(sigma d) where it is thin.
/// @param rate_per_m of calib/field/sheet_mesh.h
/// @source Wait 1962, Electromagnetic Waves in Stratified Media, chapter 2
double sheetCurrentShare(const MetalSheet& sheet, double rate_per_m, const Excitation& excitation);
/// What it sees of a mode of a sheet's magnetisation: chi_t rate/(1 + chi_t rate), chi_t = (mu_r tanh(x)/x - 1) d, x =
/// gamma d/2.
double sheetChargeShare(const MetalSheet& sheet, double rate_per_m, const Excitation& excitation);

/// Share of the current that a loop without resistance would carry which a tracker sees: (w L)^2 / (R^2 + (w L)^2) in
/// phase, exp(-t R / L) after a step.
/// @param rate_per_s R / L
double inductiveShare(double rate_per_s, const Excitation& excitation);

}  // namespace fieldtrue::field
