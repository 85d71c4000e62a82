// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/activation/activation_settings.h"
#include "coupler/method/activation/virial_stress.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Chooses the particle cells that become finite elements again: no bond of their particles has broken, and their stress has
/// stayed below a fraction of sigma* for a set time. No cell is given back that would be enclosed by particle region. Theory
/// (7.16).
class ReturnRule
{
public:
  /// @p settings, @p mesh, @p packing and @p cells are kept by reference. @param poisson ratio of the rock
  ReturnRule(const ActivationSettings &settings, double poisson, const fem::Mesh &mesh, const dem::Packing &packing,
             VirialStress &cells, MPI_Comm comm);

  bool off() const;
  /// Whether the cells should be looked at in the step that ends at @p time [s]: a few times in the set time.
  bool due(double time) const { return !off() && time >= next_look; }
  /// Cells to give back now, sorted, the same list on every rank. Collective.
  std::vector<int> cells_to_return(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem, double time);

private:
  std::vector<char> damaged_cells(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem);

  const ActivationSettings &settings;
  double poisson; // of the rock
  const fem::Mesh &mesh;
  const dem::Packing &packing;
  MPI_Comm comm;
  VirialStress &cells;
  std::vector<double> loaded_until; // by cell: last time at which it had to stay a particle cell [s]
  double next_look = 0.;
};
} // namespace kerf
