// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/solid_region.h"

#include <algorithm>

namespace kerf::dem
{
std::pair<Eigen::Vector3d, Eigen::Vector3d> filled_box(const Packing &packing)
{
  const Eigen::Vector3d extent = packing.upper - packing.lower;
  if (packing.volume_filled == 0. ||
      packing.volume_filled > (1. - 1e-6) * box_volume(packing.dim, packing.lower, packing.upper))
    return {packing.lower, packing.upper};

  // Grid cells of about two diameters; those at the surface are partly empty.
  const double longest = extent.maxCoeff(); // in two dimensions the third is 0
  const double size = longest / std::max(1., std::floor(longest / (2. * packing.mean_diameter)));
  std::array<int, 3> n = {1, 1, 1};
  for (int c = 0; c < packing.dim; ++c)
    n[c] = std::max(1, static_cast<int>(extent[c] / size + 1e-9));
  const auto index = [&n](int x, int y, int z) { return (z * n[1] + y) * n[0] + x; };
  std::vector<double> solid(n[0] * n[1] * n[2], 0.);
  for (int i = 0; i < packing.size(); ++i)
  {
    std::array<int, 3> cell = {0, 0, 0};
    for (int c = 0; c < packing.dim; ++c)
      cell[c] = std::clamp(static_cast<int>((packing.positions(c, i) - packing.lower[c]) / size), 0, n[c] - 1);
    solid[index(cell[0], cell[1], cell[2])] += packing.volume(i);
  }
  const double full = 0.65 * packing.solid_fraction() * std::pow(size, packing.dim);

  // Edge of the largest full cube whose last cell is this one: one more than the smallest of those before it.
  std::vector<int> edge(solid.size(), 0);
  int largest = 0;
  std::array<int, 3> last = {0, 0, 0};
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x)
      {
        if (solid[index(x, y, z)] < full)
          continue;
        int smallest = 1 << 20;
        for (int k = 1; k < (packing.dim == 2 ? 4 : 8); ++k)
        {
          const int u = x - (k & 1), v = y - (k >> 1 & 1), w = z - (k >> 2 & 1);
          smallest = std::min(smallest, u < 0 || v < 0 || w < 0 ? 0 : edge[index(u, v, w)]);
        }
        edge[index(x, y, z)] = smallest + 1;
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
