// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_patch.h"

#include <array>
#include <vector>

namespace kerf::fem
{
/// A cell by the numbers of its nodes.
template <int dim>
struct NumberedCell
{
  int node[q1::n_nodes<dim>];
  q1::NodalValues<dim> X; ///< [m]
};

/// Groups of 2^dim of the @p cells that form patches, in the order of their first cells. No cell is in two patches. A patch
/// needs a node with exactly one cell on each side, and cells that agree in their numbering and in all positions.
template <int dim>
std::vector<std::array<int, Patch<dim>::n_cells>> find_patches(const std::vector<NumberedCell<dim>> &cells, int n_nodes);
} // namespace kerf::fem
