// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"
#include "dem_side/geometry/cell_list.h"
#include "dem_side/packing/stored_bonds.h"

#include <algorithm>
#include <cmath>

namespace kerf::dem
{
namespace
{
double length(const Eigen::Vector3d &v)
{
  return std::sqrt(v[0] * v[0] + v[1] * v[1] +
                   v[2] * v[2]); // not by Eigen's norm(), whose order of summation depends on the machine
}
} // namespace

double remove_unconnected_particles(Packing &packing)
{
  const int n = packing.size();
  const StoredBonds bonds_of(packing);
  std::vector<int> held(n), unheld;
  std::vector<char> removed(n, 0);
  for (int i = 0; i < n; ++i)
    if ((held[i] = bonds_of.count(i)) < 2)
      unheld.push_back(i);
  while (!unheld.empty())
  {
    const int i = unheld.back();
    unheld.pop_back();
    if (removed[i])
      continue;
    removed[i] = 1;
    for (const int j : bonds_of.partners_of(i))
      if (!removed[j] && --held[j] < 2)
        unheld.push_back(j);
  }

  std::vector<int> body(n, -1), members, stack;
  for (int seed = 0; seed < n; ++seed)
  {
    if (removed[seed] || body[seed] >= 0)
      continue;
    body[seed] = static_cast<int>(members.size());
    members.push_back(0);
    for (stack = {seed}; !stack.empty();)
    {
      const int i = stack.back();
      stack.pop_back();
      ++members[body[seed]];
      for (const int j : bonds_of.partners_of(i))
        if (!removed[j] && body[j] < 0)
        {
          body[j] = body[seed];
          stack.push_back(j);
        }
    }
  }
  const int main_body = static_cast<int>(std::max_element(members.begin(), members.end()) - members.begin());

  std::vector<int> new_index(n, -1);
  int kept = 0;
  for (int i = 0; i < n; ++i)
    if (!removed[i] && body[i] == main_body)
    {
      new_index[i] = kept;
      packing.positions.col(kept) = Eigen::Vector3d(packing.positions.col(i));
      packing.radii[kept] = packing.radii[i];
      ++kept;
    }
  packing.positions.conservativeResize(3, kept);
  packing.radii.conservativeResize(kept);
  std::vector<std::array<int, 2>> bonds;
  for (const auto &[i, j] : packing.bonds)
    if (new_index[i] >= 0 && new_index[j] >= 0)
      bonds.push_back({new_index[i], new_index[j]});
  packing.bonds = std::move(bonds);
  return n ? double(n - kept) / n : 0.;
}

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
    // Free radius at x, and the direction away from the particle or wall that limits it.
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
