#pragma once

#include <Eigen/Dense>
#include <complex>
#include <cstdint>
#include <random>
#include <vector>

namespace blind {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Complex = std::complex<double>;
using Random = std::mt19937_64;

constexpr double kPi = 3.14159265358979323846;
/// Field unit of this program: mu0 / (4 pi) = 1, so an inductance in henry is 1e-7 times its value here.
constexpr double kHenryPerUnit = 1e-7;

/// Field matrix of a point dipole: B = G(p) m with mu0 / (4 pi) = 1.
/// @param p_m from the dipole to the field point [m]
/// @return (3 u u^T - I) / r^3 [m^-3]
Matrix3d dipoleField(const Vector3d& p_m);

/// Relative permeability that a solid conducting sphere appears to have at one frequency.
/// @param radius_m sphere radius [m]
/// @param relative_permeability of the material
/// @param conductivity_s_m of the material [S/m]
/// @param frequency_hz carrier [Hz]
/// @return complex apparent permeability, time factor exp(+i w t)
/// @source Landau and Lifshitz, Electrodynamics of Continuous Media (1984), section 59, problem 1
Complex apparentPermeability(double radius_m, double relative_permeability, double conductivity_s_m,
                             double frequency_hz);

/// Rotation turned by a small rotation vector given in the outer frame.
Quaterniond turned(const Vector3d& rotation_rad, const Quaterniond& q);

/// Rotation vector of a unit quaternion, angle at most pi [rad].
Vector3d rotationVector(const Quaterniond& q);

Matrix3d skew(const Vector3d& v);

/// Draws that are the same on every standard library, unlike the distributions of <random>.
double uniform(Random& random, double low, double high);
double logUniform(Random& random, double low, double high);
double normal(Random& random);
int uniformInt(Random& random, int low, int high);
Vector3d normalVector(Random& random);
Vector3d direction(Random& random);
Quaterniond rotation(Random& random);

}  // namespace blind
