// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/cell_kernel.h"

namespace kerf::fem
{
template <int dim>
CellKernel<dim>::CellKernel(const Material &material, const Strain strain, const Integration integration)
  : finite_law(material.lame_lambda(), material.lame_mu()), linear_law(material.lame_lambda(), material.lame_mu()),
    strain(strain), integration(integration), full_integration(integration == Integration::selective)
{
}

template <int dim>
void CellKernel<dim>::clear()
{
  full_integration.clear();
  one_point_integration.clear();
  n_added = 0;
  node_dofs.clear();
  node_places.clear();
  node_values.clear();
}

template <int dim>
int CellKernel<dim>::number_of(const int first_dof)
{
  const std::size_t node = first_dof / dim;
  if (node >= node_places.size())
    node_places.resize(node + 1, -1);
  if (node_places[node] < 0)
  {
    node_places[node] = static_cast<int>(node_dofs.size());
    node_dofs.push_back(first_dof);
  }
  return node_places[node];
}

template <int dim>
void CellKernel<dim>::add_cell(const std::array<int, n> &first_dofs, const q1::NodalValues<dim> &X,
                               const std::array<double, n> &alpha)
{
  int number[n];
  for (int a = 0; a < n; ++a)
    number[a] = number_of(first_dofs[a]);
  const CellGeometry<dim> cell(X, alpha);
  if (integration == Integration::one_point)
  {
    if (one_point_integration.empty() || one_point_integration.back().is_arranged())
      one_point_integration.emplace_back();
    one_point_integration.back().add_cell(number, cell);
  }
  else
  {
    for (int &a : number)
      a *= node_stride<dim>;
    full_integration.add_cell(number, cell);
    node_values.resize(node_stride<dim> * node_dofs.size(), 0.);
  }
  ++n_added;
}

template <int dim>
void CellKernel<dim>::read_nodes(const double *u) const
{
  double *node = node_values.data();
  for (const int dof : node_dofs)
  {
    for (int c = 0; c < dim; ++c)
    {
      node[c] = u[dof + c];
      node[node_width<dim> + c] = 0.;
    }
    node += node_stride<dim>;
  }
}

template <int dim>
template <typename Law>
void CellKernel<dim>::subtract_forces(const Law &law, const double *u, double *f) const
{
  for (OnePointIntegration<dim> &cells : one_point_integration)
  {
    cells.arrange(node_dofs);
    cells.subtract_forces(law, u, f);
  }
  if (integration == Integration::one_point)
    return;
  read_nodes(u);
  double *node = node_values.data(), *node_f = node + node_width<dim>;
  full_integration.add_forces(law, node, node_f);
  for (const int dof : node_dofs)
  {
    for (int c = 0; c < dim; ++c)
      f[dof + c] -= node_f[c];
    node_f += node_stride<dim>;
  }
}

template <int dim>
template <typename Law>
double CellKernel<dim>::energy(const Law &law, const double *u) const
{
  double sum = 0.;
  for (OnePointIntegration<dim> &cells : one_point_integration)
  {
    cells.arrange(node_dofs);
    sum += cells.energy(law, u);
  }
  if (integration == Integration::one_point)
    return sum;
  read_nodes(u);
  return full_integration.energy(law, node_values.data());
}

template <int dim>
void CellKernel<dim>::subtract_internal_forces(const double *u, double *f) const
{
  if (strain == Strain::finite)
    subtract_forces(finite_law, u, f);
  else
    subtract_forces(linear_law, u, f);
}

template <int dim>
void CellKernel<dim>::subtract_linear_forces(const double *u, double *f) const
{
  subtract_forces(linear_law, u, f);
}

template <int dim>
double CellKernel<dim>::elastic_energy(const double *u) const
{
  return strain == Strain::finite ? energy(finite_law, u) : energy(linear_law, u);
}

template class CellKernel<2>;
template class CellKernel<3>;
} // namespace kerf::fem
