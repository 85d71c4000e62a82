// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"
#include "fem_side/fem_side.h"

#include <Eigen/Core>
#include <vector>

namespace kerf
{
/// Fluctuations of the particles of a random packing about a smooth field, as linear functions C_i of the strain of the field:
///   K C + W^T lambda = -K (eps x),   W C = 0,   W = N^T m,
/// for each unit strain eps of the stored packing with its free surfaces. The constraint W C = 0 keeps the mean around every
/// node, so C contains only motions that the cells cannot represent. The static solution takes minutes for some 1e5 spheres.
/// Theory (6.1).
class Fluctuations
{
public:
  /// @param k_n, k_t stiffnesses of the bonds [N/m]. Throws UnstableRun when the solution does not converge.
  Fluctuations(const dem::Packing &packing, double k_n, double k_t, const fem::FemSide &fem);

  /// Component of the displacement [m] or rotation [rad] of particle @p i for a unit strain. Rotations follow the displacements
  /// in @p component. See StrainComponents for @p strain.
  double of(int i, int component, int strain) const { return fluctuation(per_particle * i + component, strain); }
  /// Cell and shape functions of particle @p i in the mesh.
  const fem::Interpolation &place(int i) const { return places[i]; }

private:
  template <int dim>
  void solve(const dem::Packing &packing, double k_n, double k_t, int n_nodes);

  int per_particle;
  std::vector<fem::Interpolation> places;
  Eigen::MatrixXf fluctuation; // one row for each degree of freedom
};
} // namespace kerf
