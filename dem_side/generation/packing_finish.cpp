// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"
#include "dem_side/geometry/cell_list.h"

namespace kerf::dem
{
namespace
{
double length(const Eigen::Vector3d &v)
{
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); // not Eigen's norm(): its order depends on the machine
}
} // namespace

void remove_overlaps(Packing &packing, double allowed)
{
  double factor = 1.;
  CellList(packing.positions, 2. * packing.radii.maxCoeff(), packing.periodic)
    .for_each_pair(
      [&](int i, int j)
      {
        const double sum = packing.radii[i] + packing.radii[j];
        factor = std::min(factor, (length(packing.branch(i, j)) + allowed) / sum);
      });
  packing.radii *= factor;
}

void hold_rattlers(Packing &packing, const Container &container, double largest_radius)
{
  bond_by_gap(packing, 0.02);
  std::vector<int> holds(packing.size(), 0);
  for (const auto &[i, j] : packing.bonds)
  {
    ++holds[i];
    ++holds[j];
  }
  std::vector<std::vector<int>> cage(packing.size());
  const double sight = 4. * largest_radius;
  CellList(packing.positions, sight, packing.periodic)
    .for_each_pair(
      [&](int i, int j)
      {
        if (length(packing.branch(i, j)) >= sight)
          return;
        if (holds[i] < 2)
          cage[i].push_back(j);
        if (holds[j] < 2)
          cage[j].push_back(i);
      });

  for (int i = 0; i < packing.size(); ++i)
  {
    if (holds[i] >= 2)
      continue;
    Eigen::Vector3d x = packing.positions.col(i);
    // Free radius at x and the direction away from what limits it.
    const auto free_radius = [&](Eigen::Vector3d &away)
    {
      double free = 1e300;
      for (const int j : cage[i])
      {
        const Eigen::Vector3d from = packing.displacement(j, x);
        const double d = length(from);
        if (d - packing.radii[j] < free)
        {
          free = d - packing.radii[j];
          away = from / d;
        }
      }
      for (const Container::Wall &wall : container.walls(x, std::min(free, largest_radius)))
        if (wall.distance < free)
        {
          free = wall.distance;
          away = wall.inward;
        }
      return free;
    };
    Eigen::Vector3d away = Eigen::Vector3d::Zero(), best = x;
    double best_free = 0.;
    for (double step = 0.1 * largest_radius; step > 1e-4 * largest_radius; step *= 0.98)
    {
      const double free = free_radius(away);
      if (free > best_free)
      {
        best_free = free;
        best = x;
      }
      x += step * away;
    }
    packing.positions.col(i) = packing.wrapped(best);
    packing.radii[i] = std::max(packing.radii[i], std::min(best_free, largest_radius));
  }
}
} // namespace kerf::dem
