// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

namespace kerf::fem
{
/// A displacement component whose motion is given.
struct PrescribedDof
{
  int dof = 0;                                  ///< local position among the owned components
  int component = 0;                            ///< 0 x, 1 y, 2 z
  const BoundaryCondition *condition = nullptr; ///< velocity boundary; null: held
};

/// Prescribed components of the nodes this rank owns. Where boundaries meet, fixed wins over velocity, velocity over roller,
/// and the first velocity boundary of the list over later ones. The conditions must outlive the result. Throws
/// std::runtime_error with one line on conditions that select no face or are given twice and on rollers that are not parallel
/// to the axes.
template <int dim>
std::vector<PrescribedDof> prescribed_dofs(const NodalSpace<dim> &space, const std::vector<BoundaryCondition> &conditions);
} // namespace kerf::fem
