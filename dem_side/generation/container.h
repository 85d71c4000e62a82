// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/geometry/closed_surface.h"
#include "dem_side/packing/packing.h"

#include <memory>

namespace kerf::dem
{
/// The space that a packing fills: a box with flat sides or the inside of a closed surface.
class Container
{
public:
  /// @param reach largest distance to the walls that can be computed [m], more than a particle's largest radius
  Container(const PackingSettings &settings, double reach);

  int dim() const { return m_dim; }
  bool is_box() const { return !m_surface; }
  const Eigen::Vector3d &lower() const { return m_lower; } ///< bounding box [m]
  const Eigen::Vector3d &upper() const { return m_upper; }
  bool is_periodic(int axis) const { return m_periodic[axis]; } ///< no walls normal to this axis
  double volume() const;                                        ///< [m^3] (2D: [m^2])
  std::vector<double> shape() const { return m_surface ? m_surface->moments() : std::vector<double>(); }
  double area() const; ///< of the walls [m^2] (2D: [m])
  bool contains(const Eigen::Vector3d &x) const;

  /// A wall close to a particle.
  struct Wall
  {
    double distance;        ///< of the particle's centre [m], negative outside
    Eigen::Vector3d inward; ///< unit vector
  };
  /// Walls closer to @p x than @p within [m] (at most the reach), the nearest first. Of the neighbouring facets of a curved
  /// wall only the nearest is listed: walls whose normals differ by less than 25 degrees count as one.
  const std::vector<Wall> &walls(const Eigen::Vector3d &x, double within) const;

private:
  int m_dim;
  Eigen::Vector3d m_lower, m_upper;
  std::array<bool, 3> m_periodic;
  std::unique_ptr<ClosedSurface> m_surface;
  mutable std::vector<Wall> m_walls;
};
} // namespace kerf::dem
