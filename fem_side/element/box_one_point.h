// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/hourglass.h"

namespace kerf::fem
{
/// Cells with edges parallel to the axes: ShapedOnePoint without the terms that are zero.
template <int dim>
class BoxOnePoint
{
public:
  static constexpr int n = q1::n_nodes<dim>;

  Lanes weight;

  template <typename Geometry>
  [[gnu::always_inline]] explicit BoxOnePoint(const Geometry &geometry) : weight(geometry.weight)
  {
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      mapping[d] = geometry.mapping[d];
  }

  template <typename Read>
  [[gnu::always_inline]] void split(const Read &read, GradientTensor<dim> &H, Hourglass<dim> &q) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
    {
      Lanes c[n];
      read(i, c);
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
        H[i][j] = c[1 << j] * mapping[j];
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        q[h][i] = c[hourglass_monomials[h]];
    }
  }

  template <typename Law>
  [[gnu::always_inline]] Lanes hourglass(const Law &law, const GradientTensor<dim> &H, const Hourglass<dim> &q,
                                         Hourglass<dim> &s, GradientTensor<dim> &P) const
  {
    const double lambda = hourglass_mean * law.sheet_lambda(), mu = hourglass_mean * law.mu;
    Hourglass<dim> p, r = {};
#pragma GCC unroll 8
    for (int h = 0; h < n_hourglass<dim>; ++h)
      Law::template pull_back<dim>(H, q[h], p[h]);
#pragma GCC unroll 8
    for (int normal = 0; normal < dim; ++normal)
    {
      const int a = normal == 0 ? 1 : 0, b = normal == dim - 1 ? dim - 2 : dim - 1;
      const int of_a = hourglass_of(normal, a), of_b = hourglass_of(normal, b);
      const Lanes strain_a = mapping[a] * p[of_a][a];
      if constexpr (dim == 2)
        r[of_a][a] += mapping[a] * ((lambda + 2. * mu) * strain_a);
      else
      {
        const Lanes strain_b = mapping[b] * p[of_b][b];
        const Lanes shear = mu * (mapping[a] * p[of_a][b] + mapping[b] * p[of_b][a]);
        r[of_a][a] += mapping[a] * ((lambda + 2. * mu) * strain_a + lambda * strain_b);
        r[of_b][b] += mapping[b] * ((lambda + 2. * mu) * strain_b + lambda * strain_a);
        r[of_a][b] += mapping[a] * shear;
        r[of_b][a] += mapping[b] * shear;
      }
    }
    if constexpr (dim == 3)
    {
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
        r[3][d] += (hourglass_mean * hourglass_mean * law.young() * mapping[d] * mapping[d]) * p[3][d];
    }
    Lanes energy = {};
#pragma GCC unroll 8
    for (int h = 0; h < n_hourglass<dim>; ++h)
    {
      Law::template push_forward<dim>(H, r[h], s[h]);
      energy += 0.5 * dot<dim>(p[h], r[h]);
      if constexpr (!Law::linear)
      {
#pragma GCC unroll 8
        for (int i = 0; i < dim; ++i)
          add<dim>(P[i], q[h][i], r[h]);
      }
    }
    return energy;
  }

  template <typename Add>
  [[gnu::always_inline]] void subtract_forces(const GradientTensor<dim> &P, const Hourglass<dim> &s, const Add &add) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
    {
      Lanes f[n] = {};
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
        f[1 << j] -= weight * mapping[j] * P[i][j];
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        f[hourglass_monomials[h]] -= weight * s[h][i];
      add(i, f);
    }
  }

private:
  Lanes mapping[dim];
};
} // namespace kerf::fem
