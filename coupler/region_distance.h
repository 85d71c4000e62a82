// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace kerf
{
/// Mean of the corners of a cell [m].
Eigen::Vector3d cell_centre(const fem::Mesh &mesh, int cell);

/// Distance [m] of @p point from a mesh cell, zero inside (2D: convex quadrilateral).
double distance_to_cell(const fem::Mesh &mesh, int cell, const Eigen::Vector3d &point);

/// Distance [m] of @p point from a face of the boundary (2D: segment).
double distance_to_face(const fem::Mesh &mesh, const fem::BoundaryFace &face, const Eigen::Vector3d &point);

/// Distance of a fixed set of points from a growing set of cells. The set only grows, so a new cell can only lower
/// distances: phi = min(phi, distance to the new cell), exact and local. Points farther than @p reach keep phi = reach.
class RegionDistance
{
public:
  /// @param points kept by reference; @param reach largest distance of interest [m]
  RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach);

  void add_cell(int cell);
  /// Calls visit(i) for all points whose distance from the cell is at most the reach, and for some others.
  template <typename Visit>
  void for_each_near(int cell, const Visit &visit) const
  {
    const auto [first, last] = bins_around(cell);
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int x = first[0]; x <= last[0]; ++x)
        {
          const int bin = (z * n_bins[1] + y) * n_bins[0] + x;
          for (int k = bin_start[bin]; k < bin_start[bin + 1]; ++k)
            visit(bin_points[k]);
        }
  }
  const Eigen::VectorXd &values() const { return phi; }
  auto point(int i) const { return points.col(i); }

private:
  /// First and last bin along each axis that a cell and the reach around it touch.
  std::pair<Eigen::Vector3i, Eigen::Vector3i> bins_around(int cell) const;
  int bin_of(const Eigen::Vector3d &point, int axis) const;

  const fem::Mesh &mesh;
  const Eigen::Matrix3Xd &points;
  double reach;
  Eigen::VectorXd phi;

  // Points in square bins of the size of the reach, so that a cell meets only points near it.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double bin_size = 1.;
  std::array<int, 3> n_bins = {{1, 1, 1}};
  std::vector<int> bin_start, bin_points;
};
} // namespace kerf
