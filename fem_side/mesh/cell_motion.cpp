// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/fem_side.h"

#include <algorithm>

namespace kerf::fem
{
CellMotion cell_motion(const Mesh &mesh, int cell)
{
  CellMotion motion;
  const Eigen::Index n_corners = mesh.cells.rows();
  motion.share.setZero(n_corners, n_corners); // the masters of a cell's slaves are at most as many as its slaves
  const auto add = [&](Eigen::Index corner, int node, double share)
  {
    const auto place = std::find(motion.nodes.begin(), motion.nodes.end(), node) - motion.nodes.begin();
    if (place == static_cast<std::ptrdiff_t>(motion.nodes.size()))
      motion.nodes.push_back(node);
    motion.share(corner, place) += share;
  };
  for (Eigen::Index corner = 0; corner < n_corners; ++corner)
  {
    const int node = mesh.cells(corner, cell);
    const auto slave = std::lower_bound(mesh.slaves.begin(), mesh.slaves.end(), node,
                                        [](const SlaveNode &candidate, int number) { return candidate.node < number; });
    if (slave == mesh.slaves.end() || slave->node != node)
      add(corner, node, 1.);
    else
      for (std::size_t m = 0; m < slave->masters.size(); ++m)
        add(corner, slave->masters[m], slave->weights[m]);
  }
  motion.share.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(motion.nodes.size()));
  return motion;
}
} // namespace kerf::fem
