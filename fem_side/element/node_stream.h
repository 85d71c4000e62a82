// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/simd.h"

#include <Eigen/Core>
#include <vector>

namespace kerf::fem
{
/// Nodal values of batches that are always processed in the same order. A node's displacement is read before the first batch
/// that has it. Its force is written back after the last one, and then its place goes to another node. So the values in use
/// stay in the cache, however large the mesh is. In two dimensions batches use the caller's vectors directly, because there a
/// node is a single load.
template <int dim>
class NodeStream
{
public:
  static constexpr bool direct = dim == 2;

  /// Nodes of a batch: numbers that plan() turns into places.
  struct Part
  {
    int *nodes;
    int count;
  };

  /// @p node_dofs: first component of each node in the caller's vectors.
  void plan(const std::vector<Part> &batches, const std::vector<int> &node_dofs);

  /// To be called before each batch, in their order.
  void read(const int batch, const double *u) const
  {
    if constexpr (!direct)
      for (int k = reads.begin[batch]; k < reads.begin[batch + 1]; ++k)
      {
        const double *from = u + reads.transfers[k].dof;
        double *to = values.data() + reads.transfers[k].place;
        // Whole vectors, as batches load them: shorter stores would not be forwarded.
        *reinterpret_cast<lanes::Quad *>(to) = lanes::Quad{from[0], from[1], from[2], 0.};
        *reinterpret_cast<lanes::Quad *>(to + node_width<dim>) = lanes::Quad{};
      }
  }
  /// To be called after each batch that adds forces: writes back the forces of nodes that no later batch has.
  void write(const int batch, double *f) const
  {
    if constexpr (!direct)
      for (int k = writes.begin[batch]; k < writes.begin[batch + 1]; ++k)
      {
        const double *from = forces(f) + writes.transfers[k].place;
        double *to = f + writes.transfers[k].dof;
        lanes::add(to, lanes::pair(from));
        to[2] += from[2];
      }
  }
  /// Arrays to which the places of a batch refer.
  const double *displacements(const double *u) const { return direct ? u : values.data(); }
  double *forces(double *f) const { return direct ? f : values.data() + node_width<dim>; }

private:
  struct Transfer
  {
    int dof, place;
  };
  struct Transfers
  {
    std::vector<Transfer> transfers;
    std::vector<int> begin; ///< of each batch, and the end
  };
  Transfers reads, writes;
  mutable std::vector<double, Eigen::aligned_allocator<double>> values; ///< see node_stride
};
} // namespace kerf::fem
