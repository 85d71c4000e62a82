// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace kerf::dem
{
/// Equal cells along three axes. Flat sets (2D) have one layer of cells.
struct Grid
{
  Eigen::Vector3d lower = Eigen::Vector3d::Zero(); ///< corner of the first cell [m]
  double cell_size = 0.;                           ///< of the cubic cells [m]
  std::array<int, 3> n_cells{{1, 1, 1}};

  int size() const { return n_cells[0] * n_cells[1] * n_cells[2]; }
  int index(int x, int y, int z) const { return (z * n_cells[1] + y) * n_cells[0] + x; }
  int index(const std::array<int, 3> &cell) const { return index(cell[0], cell[1], cell[2]); }
  /// Cell of a point along one axis. Points outside of the grid belong to the cell at its end.
  int cell_at(double x, int axis) const
  {
    return std::clamp(static_cast<int>(std::floor((x - lower[axis]) / cell_size)), 0, n_cells[axis] - 1);
  }
  std::array<int, 3> cell_at(const Eigen::Vector3d &x) const
  {
    return {{cell_at(x[0], 0), cell_at(x[1], 1), cell_at(x[2], 2)}};
  }
};

/// Items sorted by cell; within a cell they keep their order.
struct CellSort
{
  std::vector<int> first; ///< items of cell c are order[first[c]] to order[first[c + 1] - 1]
  std::vector<int> order;

  CellSort() = default;
  /// @param cell_of the cell of each item, below @p n_cells
  CellSort(const std::vector<int> &cell_of, std::size_t n_cells) : first(n_cells + 1, 0), order(cell_of.size())
  {
    for (const int cell : cell_of)
      ++first[cell + 1];
    for (std::size_t c = 1; c < first.size(); ++c)
      first[c] += first[c - 1];
    std::vector<int> next(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < cell_of.size(); ++i)
      order[next[cell_of[i]]++] = static_cast<int>(i);
  }
};
} // namespace kerf::dem
