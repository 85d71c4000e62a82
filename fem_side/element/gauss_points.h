// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_batch.h"

#include <type_traits>

namespace kerf::fem
{
/// Derivatives du_c/dxi_d at the Gauss points. They do not depend on xi_d, so the last index is the point's number without bit
/// d.
template <int dim>
using Derivatives = Lanes[dim][dim][q1::n_nodes<dim> / 2];

template <int dim>
[[gnu::always_inline]] inline void evaluate(const Lanes (&c)[q1::n_nodes<dim>][dim], Derivatives<dim> &D)
{
  constexpr int n_rest = q1::n_nodes<dim> / 2;
#pragma GCC unroll 8
  for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
    {
#pragma GCC unroll 8
      for (int k = 0; k < n_rest; ++k)
        D[i][d][k] = c[with_bit(k, d)][i];
#pragma GCC unroll 8
      for (int bit = 1; bit < n_rest; bit *= 2)
#pragma GCC unroll 8
        for (int r = 0; r < n_rest; ++r)
          if (!(r & bit))
          {
            const Lanes even = D[i][d][r], odd = D[i][d][r | bit];
            D[i][d][r] = even - odd;
            D[i][d][r | bit] = even + odd;
          }
    }
}

/// The transpose of evaluate(); overwrites @p T.
template <int dim>
[[gnu::always_inline]] inline void integrate(Derivatives<dim> &T, Lanes (&f)[q1::n_nodes<dim>][dim])
{
  constexpr int n_rest = q1::n_nodes<dim> / 2;
#pragma GCC unroll 8
  for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
    {
#pragma GCC unroll 8
      for (int bit = 1; bit < n_rest; bit *= 2)
#pragma GCC unroll 8
        for (int r = 0; r < n_rest; ++r)
          if (!(r & bit))
          {
            const Lanes low = T[i][d][r], high = T[i][d][r | bit];
            T[i][d][r] = low + high;
            T[i][d][r | bit] = high - low;
          }
#pragma GCC unroll 8
      for (int k = 0; k < n_rest; ++k)
        f[with_bit(k, d)][i] += T[i][d][k];
    }
}

/// Mapping and weight alpha JxW of one Gauss point.
template <int dim>
struct MappedPoint
{
  Lanes mapping[dim][dim]; ///< 2^-dim dxi_d/dX_j
  Lanes weight;

  [[gnu::always_inline]] void gradient(const Derivatives<dim> &D, const int q, Lanes (&H)[dim][dim]) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
      {
        H[i][j] = D[i][0][without_bit(q, 0)] * mapping[0][j];
#pragma GCC unroll 8
        for (int d = 1; d < dim; ++d)
          H[i][j] += D[i][d][without_bit(q, d)] * mapping[d][j];
      }
  }
  /// The transpose of gradient(), added.
  [[gnu::always_inline]] void add_stress(const Lanes (&P)[dim][dim], const int q, Derivatives<dim> &T) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
      {
        Lanes sum = P[i][0] * mapping[d][0];
#pragma GCC unroll 8
        for (int j = 1; j < dim; ++j)
          sum += P[i][j] * mapping[d][j];
        T[i][d][without_bit(q, d)] += sum;
      }
  }
};

template <int dim>
struct BoxPoint
{
  Lanes mapping[dim];
  Lanes weight;

  [[gnu::always_inline]] void gradient(const Derivatives<dim> &D, const int q, Lanes (&H)[dim][dim]) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
        H[i][j] = D[i][j][without_bit(q, j)] * mapping[j];
  }
  [[gnu::always_inline]] void add_stress(const Lanes (&P)[dim][dim], const int q, Derivatives<dim> &T) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
        T[i][d][without_bit(q, d)] += P[i][d] * mapping[d];
  }
};

[[gnu::always_inline]] inline const Lanes &weight_at(const Lanes &weight, int)
{
  return weight;
}
template <std::size_t n>
[[gnu::always_inline]] inline const Lanes &weight_at(const Lanes (&weight)[n], const int q)
{
  return weight[q];
}

/// The Gauss points of a batch. @p Geometry is one of FullIntegration's.
template <int dim, typename Geometry, typename = void>
class Points
{
public:
  [[gnu::always_inline]] explicit Points(const Geometry &geometry) : geometry(geometry)
  {
    evaluate<dim>(geometry.positions.x, J);
  }

  [[gnu::always_inline]] MappedPoint<dim> operator[](const int q) const
  {
    MappedPoint<dim> point;
    const auto column = [&](const int d, const int j) { return J[j][d][without_bit(q, d)]; };
    Lanes determinant;
    if constexpr (dim == 2)
    {
      point.mapping[0][0] = column(1, 1);
      point.mapping[0][1] = -column(1, 0);
      point.mapping[1][0] = -column(0, 1);
      point.mapping[1][1] = column(0, 0);
      determinant = column(0, 0) * column(1, 1) - column(0, 1) * column(1, 0);
    }
    else
    {
#pragma GCC unroll 8
      for (int d = 0; d < 3; ++d)
#pragma GCC unroll 8
        for (int j = 0; j < 3; ++j)
          point.mapping[d][j] = column((d + 1) % 3, (j + 1) % 3) * column((d + 2) % 3, (j + 2) % 3) -
                                column((d + 1) % 3, (j + 2) % 3) * column((d + 2) % 3, (j + 1) % 3);
      determinant =
        column(0, 0) * point.mapping[0][0] + column(0, 1) * point.mapping[0][1] + column(0, 2) * point.mapping[0][2];
    }
    const Lanes inverse = 1. / determinant;
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
        point.mapping[d][j] *= inverse;
    point.weight = weight_at(geometry.weight, q) * determinant;
    return point;
  }

private:
  const Geometry &geometry;
  Derivatives<dim> J; ///< 2^dim dX/dxi
};

template <int dim, typename Geometry>
class Points<dim, Geometry, std::void_t<decltype(Geometry::mapping)>>
{
public:
  [[gnu::always_inline]] explicit Points(const Geometry &geometry) : geometry(geometry) {}

  [[gnu::always_inline]] BoxPoint<dim> operator[](const int q) const
  {
    BoxPoint<dim> point;
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      point.mapping[d] = geometry.mapping[d];
    point.weight = weight_at(geometry.weight, q);
    return point;
  }

private:
  const Geometry &geometry;
};
} // namespace kerf::fem
