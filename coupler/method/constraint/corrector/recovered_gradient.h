// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Gradients of a field recovered at the nodes: the mean of the gradients at the centres of the cells around a node. Cells with
/// a massless node are left out, since such a node does not move. Theory (6.6).
class RecoveredGradient
{
public:
  /// Contribution of a node to the gradient sum_b u_b (x) share_b.
  struct Entry
  {
    int node = -1; ///< mesh node
    Eigen::Vector3d share;
  };

  explicit RecoveredGradient(const fem::FemSide &fem);

  /// @param node_mass by node [kg]
  void set_masses(const Eigen::VectorXd &node_mass);
  std::vector<Entry> at(int node) const;
  /// The cells over which the gradient at a node is averaged.
  std::vector<int> counting_around(int node) const;
  /// The cells whose mean gradient gives F of a cell: the cell itself, or the cells around @p carriers if it is left out.
  /// @param carriers nodes that carry a point of the cell
  std::vector<int> turning(int cell, const std::vector<int> &carriers) const;
  const fem::Interpolation &centre_of(int cell) const { return centre[cell]; }
  /// Number of the last call of set_masses() that changed the gradient at a node of @p place.
  int last_change(const fem::Interpolation &place) const;
  /// All nodes that can contribute to the gradient at a node, for any masses.
  std::vector<int> nodes_around(int node) const;

private:
  std::vector<fem::Interpolation> centre; // centre of each cell
  std::vector<std::vector<int>> cells_of_node;
  std::vector<char> counts; // by cell
  std::vector<int> changed; // by node
  int n_calls = 0;
};
} // namespace kerf
