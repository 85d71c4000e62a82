// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <Eigen/Core>
#include <array>
#include <vector>

namespace kerf
{
/// Distance of a fixed set of points from a growing set of cells. The set only grows, so a new cell can only lower
/// distances: phi = min(phi, distance to the new cell), exact and local. Points farther than @p reach keep phi = reach.
/// In a periodic mesh the images of a cell count like the cell. Theory (4.1).
class RegionDistance
{
public:
  /// @param points kept by reference; @param reach largest distance of interest [m]
  RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach);

  void add_cell(int cell);
  /// Back to no cells.
  void clear() { phi.setConstant(reach); }
  const Eigen::VectorXd &values() const { return phi; }
  auto point(int i) const { return points.col(i); }
  /// Calls visit(i, shift) for all points whose distance from the cell, moved by the shift to one of its images, is at most the
  /// reach, and for some others.
  template <typename Visit>
  void for_each_near(int cell, const Visit &visit) const
  {
    for (const Eigen::Vector3d &shift : images)
    {
      Eigen::Vector3i first, last;
      if (!bins_around(cell, shift, first, last))
        continue;
      for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
          for (int x = first[0]; x <= last[0]; ++x)
          {
            const int bin = (z * n_bins[1] + y) * n_bins[0] + x;
            for (int k = bin_start[bin]; k < bin_start[bin + 1]; ++k)
              visit(bin_points[k], shift);
          }
    }
  }

private:
  /// First and last bin along each axis that an image of a cell and the reach around it touch; false: none.
  bool bins_around(int cell, const Eigen::Vector3d &shift, Eigen::Vector3i &first, Eigen::Vector3i &last) const;
  int bin_of(const Eigen::Vector3d &point, int axis) const;

  const fem::Mesh &mesh;
  const Eigen::Matrix3Xd &points;
  double reach;
  Eigen::VectorXd phi;

  std::vector<Eigen::Vector3d> images; // shifts of a cell to its images within reach of the points, however many periods

  // Points in square bins of the size of the reach, so that a cell meets only points near it.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), end = Eigen::Vector3d::Zero(); // of the box around the points
  double bin_size = 1.;
  std::array<int, 3> n_bins = {{1, 1, 1}};
  std::vector<int> bin_start, bin_points;
};
} // namespace kerf
