// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Geometry>

namespace kerf::fem::q1
{
/// Multilinear cells on [-1, 1]^dim. Nodes, Gauss points (2 a direction) and the monomials 1, xi, eta, xi eta, ... share one
/// numbering by bits: bit d of a node or point says on which side it lies in direction d, bit d of a monomial whether xi_d is a
/// factor. That is also the lexicographic order (x fastest).
template <int dim>
inline constexpr int n_nodes = 1 << dim;

/// Gauss points lie at +-1/sqrt(3) with weight one.
inline constexpr double gauss = 0.577350269189625764509;

template <int dim>
using Point = Eigen::Matrix<double, dim, 1>;
/// One column a node.
template <int dim, int space_dim = dim>
using NodalValues = Eigen::Matrix<double, space_dim, n_nodes<dim>>;

template <int dim>
Point<dim> gauss_point(const int q)
{
  Point<dim> xi;
  for (int d = 0; d < dim; ++d)
    xi[d] = (q >> d & 1) ? gauss : -gauss;
  return xi;
}

template <int dim>
Eigen::Matrix<double, n_nodes<dim>, 1> shape_values(const Point<dim> &xi)
{
  Eigen::Matrix<double, n_nodes<dim>, 1> N;
  for (int a = 0; a < n_nodes<dim>; ++a)
  {
    N[a] = 1.;
    for (int d = 0; d < dim; ++d)
      N[a] *= 0.5 * (1. + ((a >> d & 1) ? xi[d] : -xi[d]));
  }
  return N;
}

/// Derivatives dN_a/dxi_d, row a, column d.
template <int dim>
Eigen::Matrix<double, n_nodes<dim>, dim> shape_derivatives(const Point<dim> &xi)
{
  Eigen::Matrix<double, n_nodes<dim>, dim> D;
  for (int a = 0; a < n_nodes<dim>; ++a)
    for (int d = 0; d < dim; ++d)
    {
      D(a, d) = (a >> d & 1) ? 0.5 : -0.5;
      for (int e = 0; e < dim; ++e)
        if (e != d)
          D(a, d) *= 0.5 * (1. + ((a >> e & 1) ? xi[e] : -xi[e]));
    }
  return D;
}

/// Normal of a face (of either sign) times its area per unit of face coordinates; X: positions of the face's nodes.
template <int dim>
Point<dim> area_vector(const NodalValues<dim - 1, dim> &X, const Point<dim - 1> &xi)
{
  const Eigen::Matrix<double, dim, dim - 1> tangents = X * shape_derivatives<dim - 1>(xi);
  if constexpr (dim == 2)
    return {tangents(1, 0), -tangents(0, 0)};
  else
    return tangents.col(0).cross(tangents.col(1));
}

/// Value of monomial @p mask at Gauss point @p q.
constexpr double gauss_monomial(const int mask, const int q)
{
  double value = 1.;
  for (int d = 0; d < 3; ++d)
    if (mask >> d & 1)
      value *= (q >> d & 1) ? gauss : -gauss;
  return value;
}

/// Nodal values -> 2^dim times the coefficients of the monomials. One butterfly for each direction takes far fewer operations
/// than sums over shape functions.
template <int dim, int n_components, typename Number>
inline void nodes_to_monomials(Number (&v)[n_nodes<dim>][n_components])
{
  for (int d = 0; d < dim; ++d)
    for (int a = 0; a < n_nodes<dim>; ++a)
      if (!(a >> d & 1))
        for (int c = 0; c < n_components; ++c)
        {
          const Number low = v[a][c], high = v[a | 1 << d][c];
          v[a][c] = high + low;
          v[a | 1 << d][c] = high - low;
        }
}

/// The transpose of nodes_to_monomials().
template <int dim, int n_components, typename Number>
inline void monomials_to_nodes(Number (&v)[n_nodes<dim>][n_components])
{
  for (int d = 0; d < dim; ++d)
    for (int a = 0; a < n_nodes<dim>; ++a)
      if (!(a >> d & 1))
        for (int c = 0; c < n_components; ++c)
        {
          const Number even = v[a][c], odd = v[a | 1 << d][c];
          v[a][c] = even - odd;
          v[a | 1 << d][c] = even + odd;
        }
}
} // namespace kerf::fem::q1
