// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf::fem
{
/// Continuous stress for pictures [Pa], 6 x n_nodes in the order of CellStress, the same on every rank: at each node the value
/// of the linear function that fits the stresses at the centres of the weighted cells around it best, where bilinear elements
/// are most accurate (Zienkiewicz & Zhu 1992). Where these cells cannot tell a slope, at boundaries, their neighbours take
/// part; so stresses that vary linearly are exact up to the boundary. Zero where no cell has weight. Collective.
Eigen::Matrix<double, 6, Eigen::Dynamic> recover_stress(const Mesh &mesh, const CellStress &stress, MPI_Comm comm);
} // namespace kerf::fem
