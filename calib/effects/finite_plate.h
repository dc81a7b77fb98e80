#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A flat rectangular metal plate with edges: a table top, a cabinet's side, a floor plate, a sheet of foil.
///
/// As a conductor it carries currents in its plane, which keep out the field normal to it; as a ferromagnet it is
/// magnetised in its plane. Ideal, either is complete. With conductivity and thickness given, the currents' modes
/// answer as far as the tracker's carrier or sampling delay lets them, through the sheet impedance (gamma / 2 sigma)
/// coth(gamma d / 2), gamma^2 = s mu sigma, which is 1/(sigma d) for a thin sheet; and a permeable plate is besides
/// magnetised with chi_t = (mu_r tanh(x)/x - 1) d, x = gamma d / 2.
/// @source meshed sheet: calib/field/sheet_mesh.h; sheet impedance: Wait 1962, Electromagnetic Waves in Stratified
/// Media, chapter 2; thin conducting sheet: Saslow 1992, Am. J. Phys. 60 693
Effect finitePlateEffect();

}  // namespace fieldtrue
