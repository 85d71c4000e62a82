// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/find_patches.h"

#include <algorithm>

namespace kerf::fem
{
namespace
{
/// True if cells of the patch share nodes and positions where they meet.
template <int dim>
bool is_grid(const std::vector<NumberedCell<dim>> &cells, const std::array<int, Patch<dim>::n_cells> &patch)
{
  int node[Patch<dim>::n_nodes];
  const double *X[Patch<dim>::n_nodes] = {};
  for (int j = 0; j < Patch<dim>::n_cells; ++j)
  {
    const NumberedCell<dim> &cell = cells[patch[j]];
    for (int a = 0; a < q1::n_nodes<dim>; ++a)
    {
      const int k = Patch<dim>::node(j, a);
      const double *own = cell.X.col(a).data();
      if (!X[k])
      {
        node[k] = cell.node[a];
        X[k] = own;
      }
      else if (node[k] != cell.node[a] || !std::equal(own, own + dim, X[k])) // another place: the mesh is periodic
        return false;
    }
  }
  return true;
}
} // namespace

template <int dim>
std::vector<std::array<int, Patch<dim>::n_cells>> find_patches(const std::vector<NumberedCell<dim>> &cells, const int n_nodes)
{
  constexpr int n = q1::n_nodes<dim>, none = -1, several = -2;
  // Cell j of the patch around a node has it as its node n - 1 - j.
  std::array<int, n> nobody;
  nobody.fill(none);
  std::vector<std::array<int, n>> around(n_nodes, nobody);
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (int a = 0; a < n; ++a)
    {
      int &entry = around[cells[c].node[a]][n - 1 - a];
      entry = entry == none ? static_cast<int>(c) : several;
    }

  std::vector<std::array<int, n>> patches;
  std::vector<char> taken(cells.size(), 0);
  for (std::size_t c = 0; c < cells.size(); ++c)
    // The last node first: in structured meshes it gives all patches.
    for (int a = n - 1; a >= 0 && !taken[c]; --a)
    {
      const std::array<int, n> &patch = around[cells[c].node[a]];
      bool complete = true;
      for (const int cell : patch)
        complete = complete && cell >= 0 && !taken[cell];
      if (!complete || !is_grid<dim>(cells, patch))
        continue;
      for (const int cell : patch)
        taken[cell] = 1;
      patches.push_back(patch);
    }
  return patches;
}

template std::vector<std::array<int, 4>> find_patches(const std::vector<NumberedCell<2>> &, int);
template std::vector<std::array<int, 8>> find_patches(const std::vector<NumberedCell<3>> &, int);
} // namespace kerf::fem
