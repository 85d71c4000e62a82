// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"
#include "fem_side/q1_cell.h"

#include <deal.II/distributed/shared_tria.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/lac/la_parallel_vector.h>

#include <memory>
#include <vector>

namespace kerf::fem
{
/// Nodal vectors: dim consecutive components a node; the nodes this rank owns first, then copies (ghosts) of other nodes of
/// its cells.
using NodalVector = dealii::LinearAlgebra::distributed::Vector<double>;
using Partitioner = dealii::Utilities::MPI::Partitioner;

/// The mesh, its distribution over ranks and the numbering of nodal vectors.
template <int dim>
class NodalSpace
{
public:
  static constexpr int n = q1::n_nodes<dim>;

  /// Collective.
  NodalSpace(MPI_Comm comm, const MeshSettings &settings);

  MPI_Comm comm;
  std::unique_ptr<dealii::parallel::shared::Triangulation<dim>> triangulation;
  dealii::FESystem<dim> element;
  dealii::DoFHandler<dim> dof_handler;
  std::shared_ptr<const Partitioner> partitioner;

  Mesh mesh;
  std::vector<int> owned_cells;
  std::vector<std::array<int, n>> owned_cell_dofs; ///< local position of the first component of each node
  std::vector<int> owned_nodes;                    ///< node number of every owned node, in local order; images included

  /// Global number of the first component of a node.
  dealii::types::global_dof_index first_dof(const int node) const { return first_dofs[node]; }
  /// Local position of the first component of a node that this rank owns or has a copy of.
  int local_dof(const int node) const { return partitioner->global_to_local(first_dofs[node]); }
  bool owns(const int node) const { return partitioner->in_local_range(first_dofs[node]); }
  /// For output, which looks at each node's own numbers: gives the nodes across periodic axes the values of their masters.
  void copy_to_images(NodalVector &vector) const;
  /// Number of nodal components this rank owns.
  int n_owned_dofs() const { return static_cast<int>(dim * owned_nodes.size()); }

  /// Reference positions of the nodes of a cell [m].
  q1::NodalValues<dim> cell_nodes(const int cell) const
  {
    q1::NodalValues<dim> X;
    for (int a = 0; a < n; ++a)
      X.col(a) = mesh.nodes.col(mesh.cells(a, cell)).template head<dim>();
    return X;
  }

private:
  void fill_mesh();
  void number_nodes();

  std::vector<dealii::types::global_dof_index> first_dofs; ///< of the master of each node
  std::vector<dealii::types::global_dof_index> own_dofs; ///< of the node itself, without a part in the model if it has a master
};
/// Reference positions of the nodes of a boundary face [m].
template <int dim>
q1::NodalValues<dim - 1, dim> face_positions(const Mesh &mesh, const BoundaryFace &face)
{
  q1::NodalValues<dim - 1, dim> X;
  for (int a = 0; a < X.cols(); ++a)
    X.col(a) = mesh.nodes.col(face.nodes[a]).template head<dim>();
  return X;
}
} // namespace kerf::fem
