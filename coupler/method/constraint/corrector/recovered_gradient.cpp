// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/corrector/recovered_gradient.h"

#include "coupler/base/mesh_geometry.h"

#include <algorithm>
#include <iterator>

namespace kerf
{
RecoveredGradient::RecoveredGradient(const fem::FemSide &fem)
{
  const fem::Mesh &mesh = fem.mesh();
  Eigen::Matrix3Xd points(3, mesh.n_cells());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    points.col(cell) = cell_centre(mesh, cell);
  centre = fem.locate(points);
  cells_of_node.resize(mesh.n_nodes());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int a = 0; a < centre[cell].n; ++a)
      cells_of_node[centre[cell].nodes[a]].push_back(cell);
  counts.assign(centre.size(), 1);
  changed.assign(mesh.n_nodes(), 0);
}

void RecoveredGradient::set_masses(const Eigen::VectorXd &node_mass)
{
  ++n_calls;
  for (std::size_t cell = 0; cell < centre.size(); ++cell)
  {
    const auto &nodes = centre[cell].nodes;
    const bool whole =
      std::all_of(nodes.begin(), nodes.begin() + centre[cell].n, [&](int node) { return node_mass[node] > 0.; });
    if (whole != static_cast<bool>(counts[cell]))
      std::for_each(nodes.begin(), nodes.begin() + centre[cell].n, [&](int node) { changed[node] = n_calls; });
    counts[cell] = whole;
  }
}

int RecoveredGradient::last_change(const fem::Interpolation &place) const
{
  int last = 0;
  for (int a = 0; a < place.n; ++a)
    last = std::max(last, changed[place.nodes[a]]);
  return last;
}

std::vector<int> RecoveredGradient::counting_around(int node) const
{
  std::vector<int> cells;
  std::copy_if(cells_of_node[node].begin(), cells_of_node[node].end(), std::back_inserter(cells),
               [this](int cell) { return counts[cell]; });
  return cells;
}

std::vector<int> RecoveredGradient::turning(int cell, const std::vector<int> &carriers) const
{
  if (counts[cell])
    return {cell};
  std::vector<int> cells;
  for (const int node : carriers)
    for (const int other : counting_around(node))
      if (std::find(cells.begin(), cells.end(), other) == cells.end())
        cells.push_back(other);
  return cells;
}

std::vector<RecoveredGradient::Entry> RecoveredGradient::at(int node) const
{
  std::vector<Entry> entries;
  const std::vector<int> cells = counting_around(node);
  for (const int cell : cells)
    for (int b = 0; b < centre[cell].n; ++b)
    {
      auto found =
        std::find_if(entries.begin(), entries.end(), [&](const Entry &entry) { return entry.node == centre[cell].nodes[b]; });
      if (found == entries.end())
        found = entries.insert(entries.end(), {centre[cell].nodes[b], Eigen::Vector3d::Zero()});
      found->share += centre[cell].dN.col(b) / cells.size();
    }
  return entries;
}

std::vector<int> RecoveredGradient::nodes_around(int node) const
{
  std::vector<int> nodes;
  for (const int cell : cells_of_node[node])
    nodes.insert(nodes.end(), centre[cell].nodes.begin(), centre[cell].nodes.begin() + centre[cell].n);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}
} // namespace kerf
