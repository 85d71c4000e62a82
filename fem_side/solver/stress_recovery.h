// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf::fem
{
/// Continuous stress for pictures [Pa], 6 x n_nodes in the order of CellStress, the same on every rank (Zienkiewicz & Zhu
/// 1992). A linear function is fitted to the stresses at the centres of the weighted cells around a node, where bilinear
/// elements are most accurate; the result is its value at the node. If these cells do not determine a slope, as at boundaries,
/// their neighbours are added, so that linear stresses are exact up to the boundary. Zero where no cell has weight. Collective.
Eigen::Matrix<double, 6, Eigen::Dynamic> recover_stress(const Mesh &mesh, const CellStress &stress, MPI_Comm comm);
} // namespace kerf::fem
