// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/nodal_space.h"

#include <deal.II/numerics/rtree.h>

namespace kerf::fem
{
/// Finds the cell of a point of the reference configuration on the replicated mesh. Nothing here is collective.
template <int dim>
class PointLocator
{
public:
  explicit PointLocator(const NodalSpace<dim> &space);

  /// Points farther than about 1e-9 of a cell outside the mesh get cell = -1.
  std::vector<Interpolation> locate(const Eigen::Matrix3Xd &points) const;

private:
  using Box = dealii::BoundingBox<dim>;

  const NodalSpace<dim> &space;
  Eigen::Vector3d lower; ///< corner of the box around the mesh [m]
  dealii::RTree<std::pair<Box, int>> tree;
};
} // namespace kerf::fem
