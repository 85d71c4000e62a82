// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

namespace kerf::fem
{
/// A displacement component with prescribed motion.
struct PrescribedDof
{
  int dof = 0;                                  ///< local position among the owned components
  int component = 0;                            ///< 0 x, 1 y, 2 z
  const BoundaryCondition *condition = nullptr; ///< velocity boundary; null: held
};

/// Prescribed components of the nodes this rank owns. Where boundaries meet, fixed takes precedence over velocity,
/// velocity over roller, and the first velocity boundary of the list over later ones. The conditions must outlive the result.
/// Throws std::invalid_argument with one line on a condition that selects no face or occurs twice, and on rollers that are not
/// parallel to the axes.
template <int dim>
std::vector<PrescribedDof> prescribed_dofs(const NodalSpace<dim> &space, const std::vector<BoundaryCondition> &conditions);
} // namespace kerf::fem
