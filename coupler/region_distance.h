// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <Eigen/Core>
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
/// In a periodic mesh the images of a cell count like the cell.
class RegionDistance
{
public:
  /// @param points kept by reference; @param reach largest distance of interest [m]
  RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach);

  void add_cell(int cell);
  const Eigen::VectorXd &values() const { return phi; }

private:
  void add_image(int cell, const Eigen::Vector3d &shift);
  int bin_of(const Eigen::Vector3d &point, int axis) const;

  const fem::Mesh &mesh;
  const Eigen::Matrix3Xd &points;
  double reach;
  Eigen::VectorXd phi;

  // Points in square bins of the size of the reach, so that a cell meets only points near it.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), end = Eigen::Vector3d::Zero(); // of the box around the points
  double bin_size = 1.;
  std::array<int, 3> n_bins = {{1, 1, 1}};
  std::vector<int> bin_start, bin_points;
};
} // namespace kerf
