// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/solid_region.h"

#include "dem_side/geometry/grid.h"

#include <algorithm>

namespace kerf::dem
{
std::pair<Eigen::Vector3d, Eigen::Vector3d> filled_box(const Packing &packing)
{
  const Eigen::Vector3d extent = packing.upper - packing.lower;
  if (packing.volume_filled == 0. ||
      packing.volume_filled > (1. - 1e-6) * box_volume(packing.dim, packing.lower, packing.upper))
    return {packing.lower, packing.upper};

  // Grid cells of about two diameters. A cell counts as full above 0.65 of the mean; cells at the surface have less.
  const double longest = extent.maxCoeff(); // in two dimensions the third is 0
  const double size = longest / std::max(1., std::floor(longest / (2. * packing.mean_diameter)));
  Grid grid{packing.lower, size, {{1, 1, 1}}};
  std::array<int, 3> &n = grid.n_cells;
  for (int c = 0; c < packing.dim; ++c)
    n[c] = std::max(1, static_cast<int>(extent[c] / size + 1e-9));
  std::vector<double> solid(grid.size(), 0.);
  for (int i = 0; i < packing.size(); ++i)
    solid[grid.index(grid.cell_at(Eigen::Vector3d(packing.positions.col(i))))] += packing.volume(i);
  const double full = 0.65 * packing.solid_fraction() * std::pow(size, packing.dim);

  // Edge of the largest full cube that ends at a cell: one more than the smallest edge at the cells before it.
  std::vector<int> edge(solid.size(), 0);
  int largest = 0;
  std::array<int, 3> last = {0, 0, 0};
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x)
      {
        if (solid[grid.index(x, y, z)] < full)
          continue;
        int smallest = 1 << 20;
        for (int k = 1; k < (packing.dim == 2 ? 4 : 8); ++k)
        {
          const int u = x - (k & 1), v = y - (k >> 1 & 1), w = z - (k >> 2 & 1);
          smallest = std::min(smallest, u < 0 || v < 0 || w < 0 ? 0 : edge[grid.index(u, v, w)]);
        }
        edge[grid.index(x, y, z)] = smallest + 1;
        if (smallest + 1 > largest)
        {
          largest = smallest + 1;
          last = {x, y, z};
        }
      }
  Eigen::Vector3d lower = packing.lower, upper = packing.lower;
  for (int c = 0; c < packing.dim; ++c)
  {
    upper[c] = packing.lower[c] + (last[c] + 1) * size;
    lower[c] = upper[c] - largest * size;
  }
  return {lower, upper};
}
} // namespace kerf::dem
