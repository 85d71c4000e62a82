// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

namespace kerf::dem
{
/// Elastic moduli of a bonded packing with relaxed particles and free rotations.
struct Moduli
{
  /// Stress = stiffness * strain [Pa]; 2D: (xx, yy, xy), 3D: (xx, yy, zz, yz, xz, xy), strains with twice the shear components.
  Eigen::MatrixXd stiffness;
  double young = 0.;      ///< of the isotropic tensor closest to stiffness, plane strain in 2D [Pa]
  double poisson = 0.;    ///< of the same [-]
  double anisotropy = 0.; ///< relative deviation of stiffness from the fit [-]
  /// Young's modulus along each axis and Poisson's ratio from it to the other axes (mean) by the compliance; in 2D those of the
  /// isotropic material in plane strain that has the compliance of the axis. [Pa], [-]
  Eigen::Vector3d axis_young = Eigen::Vector3d::Zero(), axis_poisson = Eigen::Vector3d::Zero();
};

/// Moduli by a static solve of the bond network (2D: sparse Cholesky, 3D: conjugate gradients): the outer skin of the sample
/// follows a uniform strain, the inside relaxes, stress (bond virial over Laguerre cells) and strain (least-squares
/// displacement gradient) are taken well inside. Throws std::runtime_error when the packing is too small.
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
