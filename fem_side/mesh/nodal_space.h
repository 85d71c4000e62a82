// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/q1_cell.h"
#include "fem_side/fem_side.h"
#include "fem_side/mesh/nodal_exchange.h"

#include <memory>
#include <vector>

namespace kerf::fem
{
/// Nodal vector of one rank, NodalSpace::n_local_dofs() long. A node has dim consecutive components. The nodes of this rank
/// come first, then copies (ghosts) of the other nodes that its cells have.
using NodalVector = Eigen::VectorXd;

template <int dim>
struct Discretisation;

/// The mesh, its distribution over ranks and the numbering of nodal vectors.
template <int dim>
class NodalSpace
{
public:
  static constexpr int n = q1::n_nodes<dim>;

  /// Throws std::invalid_argument with one line on a mesh that cannot be used. Collective.
  NodalSpace(MPI_Comm comm, const MeshSettings &settings);
  ~NodalSpace();
  NodalSpace(const NodalSpace &) = delete;
  NodalSpace &operator=(const NodalSpace &) = delete;

  MPI_Comm comm;
  Mesh mesh;
  std::vector<int> owned_cells;
  std::vector<std::array<int, n>> owned_cell_dofs; ///< local position of the first component of each node
  std::vector<int> owned_nodes;                    ///< node number of every owned node, in local order

  /// Brings copies of other ranks' nodes and all slaves up to date. Collective.
  void update_copies(NodalVector &values) const;
  /// The transpose of update_copies(): values of slaves and copies are added to masters and owners. Slaves and copies are zero
  /// afterwards. Collective.
  void sum_up(NodalVector &values) const;
  /// Values of slaves from those of their masters in a full set of nodal values, 3 x n_nodes.
  void interpolate_slaves(Eigen::Matrix3Xd &values) const;
  bool is_slave(const int node) const { return slave_of[node] >= 0; }
  /// The masters of a node for which is_slave() is true.
  const SlaveNode &slave(const int node) const { return mesh.slaves[slave_of[node]]; }

  /// Global number of the first component of a node.
  std::uint64_t first_dof(const int node) const { return first_dofs[node]; }
  /// Local position of the first component of a node that this rank owns or has a copy of; -1 of other nodes.
  int local_dof(const int node) const { return local_dofs[node]; }
  bool owns(const int node) const { return local_dofs[node] >= 0 && local_dofs[node] < n_owned_dofs(); }
  /// Number of nodal components this rank owns.
  int n_owned_dofs() const { return exchange->n_owned(); }
  /// Length of a nodal vector on this rank.
  int n_local_dofs() const { return exchange->n_owned() + exchange->n_copies(); }
  NodalVector zero_vector() const { return NodalVector::Zero(n_local_dofs()); }

  const NodalExchange &owners() const { return *exchange; }
  /// deal.II's objects, for files that include mesh/discretisation.h.
  const Discretisation<dim> &library() const { return *discretisation; }

  /// Reference positions of the nodes of a cell [m].
  q1::NodalValues<dim> cell_nodes(const int cell) const
  {
    q1::NodalValues<dim> X;
    for (int a = 0; a < n; ++a)
      X.col(a) = mesh.nodes.col(mesh.cells(a, cell)).template head<dim>();
    return X;
  }

private:
  /// Local positions of a slave and its masters.
  struct LocalSlave
  {
    int dof = 0;
    std::vector<std::pair<int, double>> masters; ///< first component and weight
  };

  void fill_mesh();
  void find_neighbours();
  void number_nodes();
  void find_slaves(const std::vector<int> &images);
  void make_exchange();
  void number_locally();

  std::unique_ptr<Discretisation<dim>> discretisation;
  std::unique_ptr<const NodalExchange> exchange;
  std::vector<std::uint64_t> first_dofs;
  std::vector<int> local_dofs;
  std::vector<int> slave_of; ///< by node: number in mesh.slaves, -1: none
  std::vector<LocalSlave> local_slaves;
};
} // namespace kerf::fem
