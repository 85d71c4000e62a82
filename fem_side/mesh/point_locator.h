// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

#include <array>
#include <memory>
#include <unordered_map>

namespace kerf::fem
{
/// Finds the cell of a point of the reference configuration on the replicated mesh. Nothing here is collective.
template <int dim>
class PointLocator
{
public:
  explicit PointLocator(const NodalSpace<dim> &space);
  ~PointLocator();

  /// Points farther than about 1e-9 of a cell outside the mesh get cell = -1.
  std::vector<Interpolation> locate(const Eigen::Matrix3Xd &points) const;

private:
  using Point = std::array<double, 3>;
  struct Hash
  {
    std::size_t operator()(const Point &point) const
    {
      std::size_t hash = 0;
      for (const double x : point)
        hash = 1000003u * hash ^ std::hash<double>()(x);
      return hash;
    }
  };

  Interpolation find(const Eigen::Vector3d &point) const;

  const NodalSpace<dim> &space;
  Eigen::Vector3d lower; ///< corner of the box around the mesh [m]
  struct Tree;
  std::unique_ptr<const Tree> tree; ///< of the boxes around the cells
  /// Results of earlier searches: at every conversion the same stored particles are located again.
  mutable std::unordered_map<Point, Interpolation, Hash> known;
};
} // namespace kerf::fem
