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
/// Selects the particle cells that return to the continuum. No bond of their particles has broken, and their stress has stayed
/// below a fraction of sigma* for the return time. A cell that the particle region would enclose does not return. Theory
/// (7.16).
class ReturnRule
{
public:
  /// @p settings, @p mesh, @p packing and @p cells are kept by reference. @param poisson Poisson's ratio of the rock
  ReturnRule(const ActivationSettings &settings, double poisson, const fem::Mesh &mesh, const dem::Packing &packing,
             VirialStress &cells, MPI_Comm comm);

  bool off() const;
  /// Whether the rule is to be checked at @p time [s]. It is checked twice in the return time.
  bool due(double time) const { return !off() && time >= next_look; }
  /// Cells to return now, sorted, the same on every rank. @param time present time [s]. @param below_tool cells that stay,
  /// since they would be converted again. Collective.
  std::vector<int> cells_to_return(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem, double time,
                                   const std::vector<int> &below_tool = {});

private:
  std::vector<char> damaged_cells(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem);

  const ActivationSettings &settings;
  double poisson; // Poisson's ratio of the rock
  const fem::Mesh &mesh;
  const dem::Packing &packing;
  MPI_Comm comm;
  VirialStress &cells;
  std::vector<double> loaded_until; // by cell: last time at which it was continuum or its stress was too large [s]
  double next_look = 0.;
};
} // namespace kerf
