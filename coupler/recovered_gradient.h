// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/link_lanes.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Gradients of a field at the nodes: the mean over the cells around a node of the gradients at their centres. Cells whose
/// nodes do not all have mass do not count, as such nodes rest.
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

/// The gradients of some nodes by the values of the nodes around them, and the transpose. Nodes are columns of a window.
class GradientRows
{
public:
  void clear()
  {
    entries.clear();
    end.clear();
  }
  /// The next node's.
  void add(const std::vector<RecoveredGradient::Entry> &of_node, const std::vector<int> &column_of_node);

  /// gradients: a column a node, row dim * d + c is the derivative of component c along d.
  template <int dim>
  void gather(const Eigen::Matrix3Xd &values, Eigen::MatrixXd &gradients) const;
  /// Adds to the values of the nodes around what belongs to @p gradients.
  template <int dim>
  void scatter(const Eigen::MatrixXd &gradients, Eigen::Matrix3Xd &values) const;

private:
  std::vector<RecoveredGradient::Entry> entries;
  std::vector<int> end; // of each node
};

template <int dim>
void GradientRows::gather(const Eigen::Matrix3Xd &values, Eigen::MatrixXd &gradients) const
{
  using Vectors = LinkVectors<dim>;
  gradients.resize(dim * dim, end.size());
  int at = 0;
  for (std::size_t a = 0; a < end.size(); ++a)
  {
    typename Vectors::One along[dim] = {};
    for (; at < end[a]; ++at)
    {
      const auto value = Vectors::load_one(values.data() + 3 * entries[at].node);
      for (int d = 0; d < dim; ++d)
        along[d] += value * entries[at].share[d];
    }
    for (int d = 0; d < dim; ++d)
      Vectors::store_one(gradients.data() + dim * (dim * a + d), along[d]);
  }
}

template <int dim>
void GradientRows::scatter(const Eigen::MatrixXd &gradients, Eigen::Matrix3Xd &values) const
{
  using Vectors = LinkVectors<dim>;
  int at = 0;
  for (std::size_t a = 0; a < end.size(); ++a)
  {
    typename Vectors::One along[dim];
    for (int d = 0; d < dim; ++d)
      along[d] = Vectors::load_one(gradients.data() + dim * (dim * a + d));
    for (; at < end[a]; ++at)
    {
      double *value = values.data() + 3 * entries[at].node;
      auto sum = Vectors::load_one(value);
      for (int d = 0; d < dim; ++d)
        sum += along[d] * entries[at].share[d];
      Vectors::store_one(value, sum);
    }
  }
}
} // namespace kerf
