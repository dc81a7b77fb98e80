#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// A correction that knows what the error is made of. Metal near a tracker adds to each transmitter coil's field one
/// that has neither divergence nor curl where the sensor goes, so its potential obeys Laplace's equation there and can
/// be made by sources outside. The tracker solves the sum for a pose as if the transmitter were alone. So the model is
/// the field itself, a few dipoles outside the measured box, each answering the transmitter's field there through a
/// symmetric tensor (reciprocity), and not the displacement: it is put through the tracker's own solution, and a
/// tracked position is corrected by finding the place that would be tracked there.
///
/// Where the sources stand, how many there are and how strong they may be is decided by the marginal likelihood, given
/// the tolerance of the jig and the noise of each place. A rigid motion of the truth is fitted with them, since the
/// alignment was found from disturbed positions. Trackers that are not dipole trackers get a poor model and, by the
/// same likelihood, few sources; choose by held-out error.
/// @source Jackson 1999, Classical Electrodynamics, sections 5.4 and 1.8 (harmonic potentials from exterior sources);
/// Raab, Blood, Steiner, Jones 1979 (dipole tracker, induced dipoles); Tipping and Faul 2003 (choice of the sources)
PositionMethod harmonicFieldPosition();

}  // namespace fieldtrue
