// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/q1_cell.h"
#include "fem_side/fem_side.h"

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
  std::vector<int> owned_nodes;                    ///< node number of every owned node, in local order

  /// Brings copies of other ranks' nodes and all slaves up to date. Collective.
  void update_copies(NodalVector &values) const;
  /// The transpose: what slaves and copies have collected goes to masters and owners; both are zero afterwards. Collective.
  void sum_up(NodalVector &values) const;
  /// Values of slaves from those of their masters in a full set of nodal values, 3 x n_nodes.
  void interpolate_slaves(Eigen::Matrix3Xd &values) const;
  bool is_slave(const int node) const { return slave_of[node] >= 0; }
  /// The masters of a slave. Only of slaves.
  const SlaveNode &slave(const int node) const { return mesh.slaves[slave_of[node]]; }

  /// Global number of the first component of a node.
  dealii::types::global_dof_index first_dof(const int node) const { return first_dofs[node]; }
  /// Local position of the first component of a node that this rank owns or has a copy of.
  int local_dof(const int node) const { return partitioner->global_to_local(first_dofs[node]); }
  bool owns(const int node) const { return partitioner->in_local_range(first_dofs[node]); }
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
  /// A component block of a slave among the local values.
  struct LocalSlave
  {
    int dof = 0;
    std::vector<std::pair<int, double>> masters; ///< first component and weight
  };

  void fill_mesh();
  void find_neighbours();
  void number_nodes();
  void find_slaves(const std::vector<int> &images);
  void make_partitioner();
  void number_locally();

  std::vector<dealii::types::global_dof_index> first_dofs;
  std::vector<int> slave_of; ///< by node: number in mesh.slaves, -1: none
  std::vector<LocalSlave> local_slaves;
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
