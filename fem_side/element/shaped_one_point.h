// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/hourglass.h"

namespace kerf::fem
{
/// Mean over the Gauss points of the Jacobian's determinant (returned) and of its derivatives B, which are the mean gradient
/// times the determinant. Only products of monomials with a nonzero mean contribute. The monomial of all three directions has
/// no mean gradient.
[[gnu::always_inline]] inline Lanes mean_gradient(const Lanes (&x)[4][2], Lanes (&B)[4][2])
{
  B[1][0] = x[2][1];
  B[1][1] = -x[2][0];
  B[2][0] = -x[1][1];
  B[2][1] = x[1][0];
  return dot<2>(x[1], B[1]);
}
[[gnu::always_inline]] inline Lanes mean_gradient(const Lanes (&x)[8][3], Lanes (&B)[8][3])
{
  Lanes y[7][3]; // times the mean of the squares
#pragma GCC unroll 8
  for (const int m : {3, 5, 6})
#pragma GCC unroll 8
    for (int i = 0; i < 3; ++i)
      y[m][i] = hourglass_mean * x[m][i];
  add_cross(B[3], x[2], y[6]);
  add_cross(B[5], y[6], x[4]);
  const Lanes curved = dot<3>(x[3], B[3]) + dot<3>(x[5], B[5]);
  add_cross(B[1], x[2], x[4]);
  add_cross(B[1], x[3], y[5]);
  add_cross(B[2], x[4], x[1]);
  add_cross(B[2], y[6], x[3]);
  add_cross(B[4], x[1], x[2]);
  add_cross(B[4], y[5], x[6]);
  add_cross(B[3], y[5], x[1]);
  add_cross(B[5], x[1], y[3]);
  add_cross(B[6], x[4], y[5]);
  add_cross(B[6], y[3], x[2]);
  return dot<3>(x[1], B[1]) + curved;
}

/// Cells of any shape. Monomials with a mean gradient: 1 .. @p n_gradients.
template <int dim, bool uniform>
class ShapedOnePoint
{
public:
  static constexpr int n = q1::n_nodes<dim>;
  static constexpr int n_gradients = !uniform ? n - 1 : dim == 2 ? 2 : 6;

  Lanes weight; ///< sum of alpha JxW

  template <typename Geometry>
  [[gnu::always_inline]] explicit ShapedOnePoint(const Geometry &geometry)
  {
#pragma GCC unroll 8
    for (int m = 1; m < n; ++m)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
        x[m][i] = geometry.positions.x[m][i];
    // Inverses of the squares of edges and of areas between them, and of the determinant.
    constexpr int n_areas = dim == 2 ? 0 : 3;
    Lanes inverse[dim + n_areas + uniform];
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      inverse[d] = length_squared[d] = dot<dim>(x[1 << d], x[1 << d]);
#pragma GCC unroll 8
    for (int normal = 0; normal < n_areas; ++normal)
    {
      const int a = normal == 0 ? 1 : 0, b = normal == dim - 1 ? dim - 2 : dim - 1;
      product[normal] = dot<dim>(x[1 << a], x[1 << b]);
      inverse[dim + normal] = length_squared[a] * length_squared[b] - product[normal] * product[normal];
    }
    if constexpr (uniform)
    {
      inverse[dim + n_areas] = mean_gradient(x, B);
      weight = geometry.weight * inverse[dim + n_areas];
    }
    else
    {
#pragma GCC unroll 8
      for (int m = 1; m < n; ++m)
#pragma GCC unroll 8
        for (int j = 0; j < dim; ++j)
          B[m][j] = geometry.gradient[m][j];
      weight = gradient_weight = geometry.weight;
    }
    invert(inverse);
    if constexpr (uniform)
    {
      inverse_determinant = inverse[dim + n_areas];
      gradient_weight = geometry.weight;
    }
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      inverse_length[d] = inverse[d];
#pragma GCC unroll 8
    for (int normal = 0; normal < n_areas; ++normal)
      inverse_area[normal] = inverse[dim + normal];
  }

  /// @p read(i, c): monomials of component i.
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
      {
        H[i][j] = c[1] * B[1][j];
#pragma GCC unroll 8
        for (int m = 2; m <= n_gradients; ++m)
          H[i][j] += c[m] * B[m][j];
        if constexpr (uniform)
          H[i][j] *= inverse_determinant;
      }
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
      {
        const int m = hourglass_monomials[h];
        q[h][i] = c[m] - dot<dim>(H[i], x[m]);
      }
    }
  }

  /// Forces s and energy (returned) of the amplitudes q. Adds to P the derivative of this energy with respect to H, on which it
  /// depends through the deformed edges.
  template <typename Law>
  [[gnu::always_inline]] Lanes hourglass(const Law &law, const GradientTensor<dim> &H, const Hourglass<dim> &q,
                                         Hourglass<dim> &s, GradientTensor<dim> &P) const
  {
    Lanes edge[dim][dim], strain[n_hourglass<dim>][dim], stress[n_hourglass<dim>][dim] = {};
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
    {
      Law::template push_forward<dim>(H, x[1 << d], edge[d]);
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        strain[h][d] = dot<dim>(q[h], edge[d]);
    }
    const double lambda = hourglass_mean * law.sheet_lambda(), mu = hourglass_mean * law.mu;
#pragma GCC unroll 8
    for (int normal = 0; normal < dim; ++normal)
    {
      // The in-plane strain of a sheet grows along its normal.
      const int a = normal == 0 ? 1 : 0, b = normal == dim - 1 ? dim - 2 : dim - 1;
      const int of_a = hourglass_of(normal, a), of_b = hourglass_of(normal, b);
      if constexpr (dim == 2)
        stress[of_a][a] = (lambda + 2. * mu) * strain[of_a][a] * (inverse_length[a] * inverse_length[a]);
      else
      {
        // Both indices raised: G E G = tr(G E) G - det(G) adj(E) for the inverse G of the metric.
        const Lanes shear = strain[of_a][b] + strain[of_b][a], inverse = inverse_area[normal];
        const Lanes trace = length_squared[b] * strain[of_a][a] + length_squared[a] * strain[of_b][b] - product[normal] * shear;
        const Lanes along_G = (lambda + 2. * mu) * trace * (inverse * inverse), along_adjugate = (2. * mu) * inverse;
        const Lanes stress_ab = 0.5 * along_adjugate * shear - along_G * product[normal];
        stress[of_a][a] += along_G * length_squared[b] - along_adjugate * strain[of_b][b];
        stress[of_b][b] += along_G * length_squared[a] - along_adjugate * strain[of_a][a];
        stress[of_a][b] += stress_ab;
        stress[of_b][a] += stress_ab;
      }
    }
    if constexpr (dim == 3)
    {
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
        stress[3][d] = (hourglass_mean * hourglass_mean * law.young()) * strain[3][d] * (inverse_length[d] * inverse_length[d]);
    }
    Lanes energy = {};
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
    {
      Lanes on_edge[dim] = {};
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
      {
        add<dim>(s[h], stress[h][d], edge[d]);
        add<dim>(on_edge, stress[h][d], q[h]);
        energy += 0.5 * stress[h][d] * strain[h][d];
      }
      if constexpr (!Law::linear)
      {
#pragma GCC unroll 8
        for (int i = 0; i < dim; ++i)
          add<dim>(P[i], on_edge[i], x[1 << d]);
      }
    }
    return energy;
  }

  /// @p add(i, f): adds forces of component i.
  template <typename Add>
  [[gnu::always_inline]] void subtract_forces(const GradientTensor<dim> &P, const Hourglass<dim> &s, const Add &add) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
    {
      Lanes stress[dim], f[n] = {};
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
      {
        stress[j] = P[i][j];
        // The amplitudes are measured from the linear field.
#pragma GCC unroll 8
        for (int h = 0; h < n_hourglass<dim>; ++h)
          stress[j] -= s[h][i] * x[hourglass_monomials[h]][j];
        stress[j] *= gradient_weight;
      }
#pragma GCC unroll 8
      for (int m = 1; m <= n_gradients; ++m)
        f[m] -= dot<dim>(stress, B[m]);
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        f[hourglass_monomials[h]] -= weight * s[h][i];
      add(i, f);
    }
  }

private:
  Lanes x[n][dim];
  Lanes B[n][dim] = {};      ///< the mean gradient; if the weight is uniform, times the determinant
  Lanes inverse_determinant; ///< of the Jacobian
  Lanes gradient_weight;     ///< weight of B
  // Of the edges at the centre: squares and, by the direction across, products of two; inverses of their squared lengths and
  // areas.
  Lanes length_squared[dim], product[dim], inverse_length[dim], inverse_area[dim];
};
} // namespace kerf::fem
