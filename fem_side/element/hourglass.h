// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_batch.h"

namespace kerf::fem
{
template <int dim>
inline constexpr int n_hourglass = q1::n_nodes<dim> - 1 - dim; ///< monomials with two factors or more

/// Monomials with two factors or more: xi eta; in space xi eta, xi zeta, eta zeta, xi eta zeta.
inline constexpr int hourglass_monomials[4] = {3, 5, 6, 7};
/// Mean of xi^2 over the Gauss points: the amplitudes are those of plain monomials.
inline constexpr double hourglass_mean = 1. / 3.;
/// Number of the amplitude of xi_d xi_e.
constexpr int hourglass_of(const int d, const int e)
{
  return d + e - 1;
}

template <int dim>
using Hourglass = Lanes[n_hourglass<dim>][dim];
template <int dim>
using GradientTensor = Lanes[dim][dim];

template <int dim>
[[gnu::always_inline]] inline Lanes dot(const Lanes (&a)[dim], const Lanes (&b)[dim])
{
  Lanes sum = a[0] * b[0];
#pragma GCC unroll 8
  for (int i = 1; i < dim; ++i)
    sum += a[i] * b[i];
  return sum;
}

template <int dim>
[[gnu::always_inline]] inline void add(Lanes (&to)[dim], const Lanes &factor, const Lanes (&v)[dim])
{
#pragma GCC unroll 8
  for (int i = 0; i < dim; ++i)
    to[i] += factor * v[i];
}

[[gnu::always_inline]] inline void add_cross(Lanes (&to)[3], const Lanes (&a)[3], const Lanes (&b)[3])
{
#pragma GCC unroll 8
  for (int i = 0; i < 3; ++i)
    to[i] += a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/// The inverses of all values by one division, because a division takes as long as a dozen products.
template <int k>
[[gnu::always_inline]] inline void invert(Lanes (&values)[k])
{
  if constexpr (k == 1)
    values[0] = 1. / values[0];
  else
  {
    Lanes products[(k + 1) / 2];
    if constexpr (k % 2 == 1)
      products[k / 2] = values[k - 1];
#pragma GCC unroll 8
    for (int i = 0; i < k / 2; ++i)
      products[i] = values[2 * i] * values[2 * i + 1];
    invert(products);
    if constexpr (k % 2 == 1)
      values[k - 1] = products[k / 2];
#pragma GCC unroll 8
    for (int i = 0; i < k / 2; ++i)
    {
      const Lanes low = values[2 * i];
      values[2 * i] = products[i] * values[2 * i + 1];
      values[2 * i + 1] = products[i] * low;
    }
  }
}
} // namespace kerf::fem
