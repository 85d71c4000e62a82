// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/nodal_window.h"

#include <algorithm>

namespace kerf::fem
{
namespace
{
template <int dim>
std::vector<std::uint64_t> components_of(const NodalSpace<dim> &space, const std::vector<int> &nodes)
{
  std::vector<std::uint64_t> components;
  for (const int node : nodes)
    for (int c = 0; c < dim; ++c)
      components.push_back(space.first_dof(node) + c);
  return components;
}
} // namespace

template <int dim>
NodalWindow<dim>::NodalWindow(const NodalSpace<dim> &space, const std::vector<int> &nodes)
  : exchange(space.owners(), components_of(space, nodes)), copies(exchange.n_copies())
{
  for (const int node : nodes)
    positions.push_back(exchange.position(space.first_dof(node)));
}

template <int dim>
void NodalWindow<dim>::read(const double *owned, Eigen::Matrix3Xd &values) const
{
  const int n_owned = exchange.n_owned();
  exchange.update_copies(owned, copies.data());
  values.setZero(3, n_nodes());
  for (int i = 0; i < n_nodes(); ++i)
  {
    const double *value = positions[i] < n_owned ? owned + positions[i] : copies.data() + (positions[i] - n_owned);
    for (int c = 0; c < dim; ++c)
      values(c, i) = value[c];
  }
}

template <int dim>
void NodalWindow<dim>::add(const Eigen::Matrix3Xd &values, double *owned) const
{
  const int n_owned = exchange.n_owned();
  std::fill(copies.begin(), copies.end(), 0.);
  for (int i = 0; i < n_nodes(); ++i)
  {
    double *value = positions[i] < n_owned ? owned + positions[i] : copies.data() + (positions[i] - n_owned);
    for (int c = 0; c < dim; ++c)
      value[c] += values(c, i);
  }
  exchange.add_copies(copies.data(), owned);
}

template class NodalWindow<2>;
template class NodalWindow<3>;
} // namespace kerf::fem
