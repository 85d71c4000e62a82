// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"

#include <algorithm>

namespace kerf::dem
{
double remove_loose_particles(Packing &packing)
{
  const int n = packing.size();
  std::vector<std::vector<int>> partners(n);
  for (const auto &[i, j] : packing.bonds)
  {
    partners[i].push_back(j);
    partners[j].push_back(i);
  }
  std::vector<int> held(n), loose;
  std::vector<char> removed(n, 0);
  for (int i = 0; i < n; ++i)
    if ((held[i] = static_cast<int>(partners[i].size())) < 2)
      loose.push_back(i);
  while (!loose.empty())
  {
    const int i = loose.back();
    loose.pop_back();
    if (removed[i])
      continue;
    removed[i] = 1;
    for (const int j : partners[i])
      if (!removed[j] && --held[j] < 2)
        loose.push_back(j);
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
      for (const int j : partners[i])
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
} // namespace kerf::dem
