// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/cell_kernel.h"

#include <Eigen/Dense>

namespace kerf::fem
{
namespace
{
template <int n, int dim>
inline void gather(const double *u, const int (&first_dof)[n][n_lanes], Lanes (&values)[n][dim])
{
  for (int a = 0; a < n; ++a)
    for (int c = 0; c < dim; ++c)
    {
      Lanes value = {};
      for (int l = 0; l < n_lanes; ++l)
        value[l] = u[first_dof[a][l] + c];
      values[a][c] = value;
    }
}

/// Lane after lane, because cells of one batch may share nodes.
template <int n, int dim>
inline void scatter_add(const Lanes (&values)[n][dim], const int (&first_dof)[n][n_lanes], double *f)
{
  for (int a = 0; a < n; ++a)
    for (int l = 0; l < n_lanes; ++l)
      for (int c = 0; c < dim; ++c)
        f[first_dof[a][l] + c] += values[a][c][l];
}
} // namespace

template <int dim>
void CellKernel<dim>::clear()
{
  batches.clear();
  n_filled = 0;
}

template <int dim>
void CellKernel<dim>::add_cell(const std::array<int, n> &first_dofs, const q1::NodalValues<dim> &X,
                               const std::array<double, n> &alpha)
{
  const int lane = n_filled++ % n_lanes;
  if (lane == 0)
    batches.emplace_back();
  Batch &batch = batches.back();
  // The first cell fills all lanes without weight: lanes that stay unused then add exact zeros to valid nodes.
  for (int l = lane; l < (lane == 0 ? n_lanes : lane + 1); ++l)
  {
    for (int a = 0; a < n; ++a)
      batch.first_dof[a][l] = first_dofs[a];
    for (int q = 0; q < n; ++q)
    {
      const Eigen::Matrix<double, dim, dim> J = X * q1::shape_derivatives<dim>(q1::gauss_point<dim>(q));
      const Eigen::Matrix<double, dim, dim> inverse = J.inverse();
      for (int i = 0; i < dim; ++i)
        for (int j = 0; j < dim; ++j)
          batch.mapping[q][i][j][l] = inverse(i, j) / n;
      batch.weight[q][l] = l == lane ? alpha[q] * J.determinant() : 0.;
    }
  }
}

template <int dim>
inline void CellKernel<dim>::displacement_gradient(const Batch &batch, const int q, const Lanes (&monomials)[n][dim],
                                                   Lanes (&H)[dim][dim])
{
  Lanes D[dim][dim]; // du_c/dxi_d
#pragma GCC unroll 8
  for (int c = 0; c < dim; ++c)
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
    {
      D[c][d] = monomials[1 << d][c];
#pragma GCC unroll 8
      for (int mask = 1; mask < n; ++mask)
        if ((mask >> d & 1) && mask != 1 << d)
          D[c][d] += q1::gauss_monomial(mask ^ 1 << d, q) * monomials[mask][c];
    }
#pragma GCC unroll 8
  for (int c = 0; c < dim; ++c)
#pragma GCC unroll 8
    for (int j = 0; j < dim; ++j)
    {
      H[c][j] = D[c][0] * batch.mapping[q][0][j];
#pragma GCC unroll 8
      for (int d = 1; d < dim; ++d)
        H[c][j] += D[c][d] * batch.mapping[q][d][j];
    }
}

template <int dim>
template <typename Law>
void CellKernel<dim>::loop(const Law &law, const double *u, double *f) const
{
  for (const Batch &batch : batches)
  {
    Lanes monomials[n][dim];
    gather(u, batch.first_dof, monomials);
    q1::nodes_to_monomials<dim, dim>(monomials);

    Lanes forces[n][dim] = {};
#pragma GCC unroll 8
    for (int q = 0; q < n; ++q)
    {
      Lanes H[dim][dim], P[dim][dim];
      displacement_gradient(batch, q, monomials, H);
      law.template first_piola<dim>(H, P);
#pragma GCC unroll 8
      for (int c = 0; c < dim; ++c)
#pragma GCC unroll 8
        for (int d = 0; d < dim; ++d)
        {
          Lanes T = P[c][0] * batch.mapping[q][d][0];
#pragma GCC unroll 8
          for (int j = 1; j < dim; ++j)
            T += P[c][j] * batch.mapping[q][d][j];
          T *= batch.weight[q];
#pragma GCC unroll 8
          for (int mask = 1; mask < n; ++mask)
            if (mask >> d & 1)
              forces[mask][c] -= q1::gauss_monomial(mask ^ 1 << d, q) * T;
        }
    }
    q1::monomials_to_nodes<dim, dim>(forces);
    scatter_add(forces, batch.first_dof, f);
  }
}

template <int dim>
double CellKernel<dim>::elastic_energy(const double *u) const
{
  Lanes energy = {};
  for (const Batch &batch : batches)
  {
    Lanes monomials[n][dim];
    gather(u, batch.first_dof, monomials);
    q1::nodes_to_monomials<dim, dim>(monomials);
    for (int q = 0; q < n; ++q)
    {
      Lanes H[dim][dim];
      displacement_gradient(batch, q, monomials, H);
      energy += batch.weight[q] * law.template energy_density<dim>(H);
    }
  }
  double sum = 0.;
  for (int l = 0; l < n_lanes; ++l)
    sum += energy[l];
  return sum;
}

template class CellKernel<2>;
template class CellKernel<3>;
} // namespace kerf::fem
