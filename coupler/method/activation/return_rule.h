// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/activation/virial_stress.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Chooses the particle cells that become finite elements again: no bond of their particles has broken, and their stress has
/// stayed below a fraction of sigma* for a set time. No cell is given back that would be enclosed by particle region.
class ReturnRule
{
public:
  /// @param settings, @param mesh, @param packing and @param cells are kept by reference
  ReturnRule(const Case &settings, const fem::Mesh &mesh, const dem::Packing &packing, VirialStress &cells, MPI_Comm comm);

  bool off() const;
  /// Whether the cells should be looked at in the step that ends at @p time [s]: a few times in the set time.
  bool due(double time) const { return !off() && time >= next_look; }
  /// Cells to give back now, sorted, the same list on every rank. Collective.
  std::vector<int> cells_to_return(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem, double time);

private:
  std::vector<char> damaged_cells(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem);

  const Case &settings;
  const fem::Mesh &mesh;
  const dem::Packing &packing;
  MPI_Comm comm;
  VirialStress &cells;
  std::vector<double> loaded_until; // by cell: last time at which it had to stay a particle cell [s]
  double next_look = 0.;
};

/// Displacements [m] and velocities [m/s] of all nodes.
struct NodalState
{
  Eigen::Matrix3Xd displacement, velocity;
};

/// The state of the finite elements with nodes that had no mass filled in from the particles in @p cells: mass-weighted least
/// squares of the particles' displacements and velocities about their interpolation. Nodes that moved with the finite elements
/// so far, and components that a boundary holds (no inverse mass), keep what they have. Collective; the finite elements already
/// have the weights with which the nodes move again. @param moved mass of the nodes before that [kg]
NodalState recover_nodes(const fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const std::vector<int> &cells,
                         const Eigen::Matrix3Xd &moved, MPI_Comm comm);
} // namespace kerf
