// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

namespace kerf::fem
{
/// Nodal window: reads and adds values of chosen nodes, whichever rank owns them. All members are collective.
template <int dim>
class NodalWindow
{
public:
  /// Every rank chooses nodes for itself, perhaps none. A node may be chosen more than once.
  NodalWindow(const NodalSpace<dim> &space, const std::vector<int> &nodes);

  int n_nodes() const { return static_cast<int>(positions.size()); }
  /// Nodal values in the order of the nodes, 3 x n_nodes().
  /// @param owned the part of a nodal vector that this rank owns
  void read(const double *owned, Eigen::Matrix3Xd &values) const;
  /// The transpose of read(): adds to the owned values.
  void add(const Eigen::Matrix3Xd &values, double *owned) const;

private:
  NodalExchange exchange;             ///< copies: the chosen nodes owned by other ranks
  std::vector<int> positions;         ///< first component of each chosen node among owned values, then copies
  mutable std::vector<double> copies; ///< of the chosen nodes owned by other ranks
};
} // namespace kerf::fem
