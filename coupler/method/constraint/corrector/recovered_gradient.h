// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Gradients of a field at the nodes: the mean over the cells around a node of the gradients at their centres. Cells whose
/// nodes do not all have mass do not count, as such nodes rest. Theory (6.6).
class RecoveredGradient
{
public:
  /// What a node around gives: the gradient is sum_b u_b (x) share_b.
  struct Entry
  {
    int node = -1; ///< of the mesh
    Eigen::Vector3d share;
  };

  explicit RecoveredGradient(const fem::FemSide &fem);

  /// @param node_mass by node [kg]
  void set_masses(const Eigen::VectorXd &node_mass);
  std::vector<Entry> at(int node) const;
  /// The cells over which the mean of a node is taken.
  std::vector<int> counting_around(int node) const;
  /// Those that say how a cell turns: itself, or, if it does not count, those around the nodes that carry a point of it.
  std::vector<int> turning(int cell, const std::vector<int> &carriers) const;
  const fem::Interpolation &centre_of(int cell) const { return centre[cell]; }
  /// The number of the last call of set_masses() that changed the gradient at one of the nodes.
  int last_change(const fem::Interpolation &place) const;
  /// All nodes that can have an entry, whatever the masses.
  std::vector<int> nodes_around(int node) const;

private:
  std::vector<fem::Interpolation> centre; // of each cell
  std::vector<std::vector<int>> cells_of_node;
  std::vector<char> counts; // by cell
  std::vector<int> changed; // by node
  int n_calls = 0;
};
} // namespace kerf
