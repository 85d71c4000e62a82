// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"
#include "fem_side/fem_side.h"

#include <Eigen/Core>
#include <vector>

namespace kerf
{
/// How the particles of a random packing fluctuate about a smooth field, by the strain of the field: C_i of
///   K C + W^T lambda = -K (eps x),   W C = 0,   W = N^T m,
/// for each unit strain eps of the bonded packing as it lies in the store, with its free surfaces. The mean around every node
/// stays that of the field, so only what the cells cannot resolve is left. A static solve, minutes for some 1e5 spheres. Theory
/// (6.1).
class Fluctuations
{
public:
  /// @p k_n @p k_t of the bonds [N/m]
  Fluctuations(const dem::Packing &packing, double k_n, double k_t, const fem::FemSide &fem);

  /// Displacement [m] or, after those, rotation [rad] of particle @p i for a unit strain, see StrainComponents.
  double of(int i, int component, int strain) const { return fluctuation(per_particle * i + component, strain); }
  /// Of the particles in the mesh.
  const fem::Interpolation &place(int i) const { return places[i]; }

private:
  template <int dim>
  void solve(const dem::Packing &packing, double k_n, double k_t, int n_nodes);

  int per_particle;
  std::vector<fem::Interpolation> places;
  Eigen::MatrixXf fluctuation; // a row a degree of freedom
};
} // namespace kerf
