// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/geometry/grid.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace kerf::dem
{
/// Points sorted into cells, to find close pairs in linear time. Flat sets (2D) get one layer of cells. Unlike those of a Grid,
/// the cells fit a whole number of times into a period.
class CellList
{
public:
  /// @param reach all pairs closer than this are visited [m], > 0
  /// @param periodic lengths of the periods [m], 0: not periodic; pairs across a period are visited like others
  CellList(const Eigen::Matrix3Xd &points, double reach, const Eigen::Vector3d &periodic = Eigen::Vector3d::Zero())
  {
    const int n = static_cast<int>(points.cols());
    if (n == 0)
      return;
    const Eigen::Vector3d lower = points.rowwise().minCoeff(), extent = points.rowwise().maxCoeff() - lower;
    // Not many more cells than points, so that a few distant points do not cost memory.
    const double size = std::max(reach, extent.maxCoeff() / (4. * std::sqrt(double(n)) + 4.));
    Eigen::Vector3d sizes = Eigen::Vector3d::Constant(size);
    for (int c = 0; c < 3; ++c)
    {
      n_cells[c] = static_cast<int>(extent[c] / size) + 1;
      if (periodic[c] <= 0.)
        continue;
      // With one or two cells a pair of cells would be met from both sides. Then all points are in one layer.
      const int whole = static_cast<int>(periodic[c] / size);
      repeats[c] = whole >= 3;
      n_cells[c] = repeats[c] ? whole : 1;
      sizes[c] = periodic[c] / n_cells[c];
    }

    std::vector<int> cell_of(n);
    for (int i = 0; i < n; ++i)
    {
      std::array<int, 3> cell;
      for (int c = 0; c < 3; ++c)
      {
        const int number = static_cast<int>((points(c, i) - lower[c]) / sizes[c]);
        cell[c] = repeats[c] ? number % n_cells[c] : std::min(number, n_cells[c] - 1);
      }
      cell_of[i] = index(cell[0], cell[1], cell[2]);
    }
    points_of = CellSort(cell_of, std::size_t(n_cells[0]) * n_cells[1] * n_cells[2]);
  }

  /// Point indices cell by cell. Neighbours in space are mostly neighbours in this order.
  const std::vector<int> &sorted() const { return points_of.order; }

  /// Calls visit(i, j) once with i < j for every pair in the same or in adjacent cells, in a fixed order.
  template <class Visitor>
  void for_each_pair(Visitor &&visit) const
  {
    const std::vector<int> &first = points_of.first, &order = points_of.order;
    for (int z = 0; z < n_cells[2]; ++z)
      for (int y = 0; y < n_cells[1]; ++y)
        for (int x = 0; x < n_cells[0]; ++x)
        {
          const int here = index(x, y, z);
          for (int a = first[here]; a < first[here + 1]; ++a)
            for (int b = a + 1; b < first[here + 1]; ++b)
              visit(order[a], order[b]);
          // Half of the 26 neighbours, so that each pair of cells is visited once.
          for (int k = 14; k < 27; ++k)
          {
            int u = x + k % 3 - 1, v = y + k / 3 % 3 - 1, w = z + k / 9 - 1;
            if (!exists(u, 0) || !exists(v, 1) || !exists(w, 2))
              continue;
            const int there = index(u, v, w);
            for (int a = first[here]; a < first[here + 1]; ++a)
              for (int b = first[there]; b < first[there + 1]; ++b)
                visit(std::min(order[a], order[b]), std::max(order[a], order[b]));
          }
        }
  }

private:
  int index(int x, int y, int z) const { return (z * n_cells[1] + y) * n_cells[0] + x; }

  /// A cell beyond the end of a periodic axis is the one at the other end.
  bool exists(int &cell, int axis) const
  {
    if (repeats[axis])
      cell = (cell + n_cells[axis]) % n_cells[axis];
    return cell >= 0 && cell < n_cells[axis];
  }

  std::array<int, 3> n_cells{{0, 0, 0}};
  std::array<bool, 3> repeats{{false, false, false}};
  CellSort points_of; ///< each cell
};
} // namespace kerf::dem
