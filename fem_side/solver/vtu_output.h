// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

#include <string>
#include <utility>

namespace kerf::fem
{
/// Contents of a VTU file besides the mesh. Cell data have one entry for every cell of the mesh; entries of cells that this
/// rank does not own are ignored.
struct VtuContent
{
  const NodalVector &displacement; ///< slaves up to date [m]
  const NodalVector &velocity;     ///< slaves up to date [m/s]
  std::vector<bool> written;       ///< per mesh cell
  std::vector<std::pair<std::string, Eigen::VectorXd>> cell_data;
  Eigen::Matrix<double, 6, Eigen::Dynamic> smooth_stress; ///< at the nodes, xx, yy, zz, yz, xz, xy [Pa]
};

/// One file for all ranks, nodes at their reference positions. Collective.
template <int dim>
void write_vtu_file(const NodalSpace<dim> &space, const std::string &path, const VtuContent &content);
} // namespace kerf::fem
