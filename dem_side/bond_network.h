// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing.h"

namespace kerf::dem
{
/// Elastic moduli of a bonded packing with relaxed particles and free rotations.
struct Moduli
{
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero(); ///< 2D: stress (xx, yy, xy) = stiffness * strain (xx, yy, 2 xy) [Pa]
  double young = 0.;                                   ///< isotropic fit, plane strain in 2D [Pa]
  double poisson = 0.;                                 ///< [-]
  double anisotropy = 0.;                              ///< relative deviation of stiffness from the fit [-]
};

/// Moduli by a static solve of the bond network (sparse Cholesky): the outer skin of the sample follows a uniform strain, the
/// inside relaxes, stress (bond virial) and strain (least-squares displacement gradient) are taken well inside.
/// @param sample_size at most about this many particles from the middle of the packing are used.
Moduli relaxed_moduli(const Packing &packing, double k_n, double k_t, int sample_size = 20000);

/// Moduli of the affine (not relaxed) network, for comparison.
Moduli affine_moduli(const Packing &packing, double k_n, double k_t);

/// Finds k_n, k_t so that the relaxed moduli are @p young [Pa] and @p poisson (secant iteration on k_t/k_n, k_n scales E).
/// Throws std::runtime_error when poisson is out of reach for 0 <= k_t/k_n <= 2, naming the reachable range.
ElasticCalibration calibrate_elastic(const Packing &packing, double young, double poisson);

/// Largest angular frequency [rad/s] of the free network with translations and rotations (Lanczos iteration on M^-1 K, a safe
/// upper estimate). @param density of the particles [kg/m^3], i.e. rock density / solid fraction.
double largest_frequency(const Packing &packing, double k_n, double k_t, double density);
} // namespace kerf::dem
