// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>

namespace kerf::dem
{
/// Elastic moduli of a bonded packing whose particles, rotations included, are in equilibrium.
struct Moduli
{
  /// Stress = stiffness * strain [Pa]; 2D: (xx, yy, xy), 3D: (xx, yy, zz, yz, xz, xy), strains with twice the shear components.
  Eigen::MatrixXd stiffness;
  double young = 0.;      ///< of the isotropic tensor closest to stiffness, plane strain in 2D [Pa]
  double poisson = 0.;    ///< of the same [-]
  double anisotropy = 0.; ///< relative deviation of stiffness from the fit [-]
  /// Young's modulus along each axis and Poisson's ratio from it to the other axes (mean) by the compliance [Pa], [-]. In 2D
  /// they are those of the isotropic material that has the compliance of the axis in plane strain.
  Eigen::Vector3d axis_young = Eigen::Vector3d::Zero(), axis_poisson = Eigen::Vector3d::Zero();
};
} // namespace kerf::dem
