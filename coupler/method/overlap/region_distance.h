// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/geometry/grid.h"
#include "fem_side/fem_side.h"

#include <Eigen/Core>
#include <array>
#include <vector>

namespace kerf
{
/// Distance phi of fixed points from a growing set of cells. An added cell can only reduce distances: phi = min(phi, distance
/// to the cell). The update is exact and local. Points farther away than @p reach keep phi = reach. In a periodic mesh the
/// images of a cell belong to the set. Theory (4.1).
class RegionDistance
{
public:
  /// @param points kept by reference; @param reach largest distance of interest [m]
  RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach);

  void add_cell(int cell);
  /// Removes all cells.
  void clear() { phi.setConstant(reach); }
  const Eigen::VectorXd &values() const { return phi; }
  auto point(int i) const { return points.col(i); }
  /// Calls visit(i, shift) for every point i within reach of an image of the cell, and for some points farther away. The shift
  /// moves the cell to the image.
  template <typename Visit>
  void for_each_near(int cell, const Visit &visit) const
  {
    for (const Eigen::Vector3d &shift : images)
    {
      std::array<int, 3> first, last;
      if (!bins_around(cell, shift, first, last))
        continue;
      for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
          for (int x = first[0]; x <= last[0]; ++x)
          {
            const int bin = bins.index(x, y, z);
            for (int k = sorted.first[bin]; k < sorted.first[bin + 1]; ++k)
              visit(sorted.order[k], shift);
          }
    }
  }

private:
  /// First and last bin along each axis within reach of an image of a cell. Returns false when there is none.
  bool bins_around(int cell, const Eigen::Vector3d &shift, std::array<int, 3> &first, std::array<int, 3> &last) const;

  const fem::Mesh &mesh;
  const Eigen::Matrix3Xd &points;
  double reach;
  Eigen::VectorXd phi;

  std::vector<Eigen::Vector3d> images; // shifts from a cell to its images within reach of the points

  // Points are sorted into bins of the size of the reach, so that a cell visits only points nearby.
  Eigen::Vector3d end = Eigen::Vector3d::Zero(); // upper corner of the box around the points
  dem::Grid bins;
  dem::CellSort sorted;
};
} // namespace kerf
