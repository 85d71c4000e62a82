// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/one_point_cells.h"

#include <cmath>

namespace kerf::fem
{
namespace
{
template <int dim>
inline constexpr int n_hourglass = OnePointCells<dim>::n_hourglass;

/// Monomials with two factors or more: xi eta; in space xi eta, xi zeta, eta zeta, xi eta zeta.
constexpr int hourglass_monomials[4] = {3, 5, 6, 7};
/// Number of the amplitude of xi_d xi_e.
constexpr int hourglass_of(const int d, const int e)
{
  return d + e - 1;
}

template <int dim>
using Hourglass = Lanes[n_hourglass<dim>][dim];
template <int dim>
using Tensor = Lanes[dim][dim];

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

/// The mean over the Gauss points of the Jacobian's determinant and of its derivatives, which are the mean gradient times the
/// determinant: products of monomials that do not vanish in the mean. The monomial of all three directions has none.
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
  add_cross(B[3], x[2], x[6]);
  add_cross(B[5], x[6], x[4]);
  const Lanes curved = dot<3>(x[3], B[3]) + dot<3>(x[5], B[5]);
  add_cross(B[1], x[2], x[4]);
  add_cross(B[1], x[3], x[5]);
  add_cross(B[2], x[4], x[1]);
  add_cross(B[2], x[6], x[3]);
  add_cross(B[4], x[1], x[2]);
  add_cross(B[4], x[5], x[6]);
  add_cross(B[3], x[5], x[1]);
  add_cross(B[5], x[1], x[3]);
  add_cross(B[6], x[4], x[5]);
  add_cross(B[6], x[3], x[2]);
  return dot<3>(x[1], B[1]) + curved;
}

/// Cells of any shape. Monomials with a mean gradient: 1 .. @p n_gradients.
template <int dim, bool uniform>
class ShapedCell
{
public:
  static constexpr int n = q1::n_nodes<dim>;
  static constexpr int n_gradients = !uniform ? n - 1 : dim == 2 ? 2 : 6;

  Lanes weight; ///< sum of alpha JxW

  template <typename Geometry>
  [[gnu::always_inline]] explicit ShapedCell(const Geometry &geometry)
  {
#pragma GCC unroll 8
    for (int m = 1; m < n; ++m)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
        x[m][i] = geometry.positions.x[m][i];
    if constexpr (uniform)
    {
      const Lanes determinant = mean_gradient(x, B), inverse = 1. / determinant;
#pragma GCC unroll 8
      for (int m = 1; m <= n_gradients; ++m)
#pragma GCC unroll 8
        for (int j = 0; j < dim; ++j)
          B[m][j] *= inverse;
      weight = geometry.weight * determinant;
    }
    else
    {
#pragma GCC unroll 8
      for (int m = 1; m < n; ++m)
#pragma GCC unroll 8
        for (int j = 0; j < dim; ++j)
          B[m][j] = geometry.gradient[m][j];
      weight = geometry.weight;
    }
  }

  [[gnu::always_inline]] void split(const Lanes (&c)[n][dim], Tensor<dim> &H, Hourglass<dim> &q) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
      {
        H[i][j] = c[1][i] * B[1][j];
#pragma GCC unroll 8
        for (int m = 2; m <= n_gradients; ++m)
          H[i][j] += c[m][i] * B[m][j];
      }
#pragma GCC unroll 8
    for (int h = 0; h < n_hourglass<dim>; ++h)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
      {
        const int m = hourglass_monomials[h];
        q[h][i] = c[m][i];
#pragma GCC unroll 8
        for (int j = 0; j < dim; ++j)
          q[h][i] -= H[i][j] * x[m][j];
      }
  }

  /// Forces s and energy of the amplitudes q; adds to P what depends on H by the deformed edges.
  template <typename Law>
  [[gnu::always_inline]] Lanes hourglass(const Law &law, const Tensor<dim> &H, const Hourglass<dim> &q, Hourglass<dim> &s,
                                         Tensor<dim> &P) const
  {
    Lanes edge[dim][dim], on_edge[dim][dim] = {}, length_squared[dim];
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
    {
      Law::template push_forward<dim>(H, x[1 << d], edge[d]);
      length_squared[d] = dot<dim>(x[1 << d], x[1 << d]);
    }
    Lanes energy = {};
#pragma GCC unroll 8
    for (int normal = 0; normal < dim; ++normal)
    {
      // The in-plane strain of a sheet grows along its normal.
      const int a = normal == 0 ? 1 : 0, b = normal == dim - 1 ? dim - 2 : dim - 1;
      const int of_a = hourglass_of(normal, a), of_b = hourglass_of(normal, b);
      const double lambda = law.sheet_lambda(), mu = law.mu;
      const Lanes strain_aa = dot<dim>(q[of_a], edge[a]);
      if constexpr (dim == 2)
      {
        const Lanes stress_aa = (lambda + 2. * mu) * strain_aa / (length_squared[a] * length_squared[a]);
        add<dim>(s[of_a], stress_aa, edge[a]);
        add<dim>(on_edge[a], stress_aa, q[of_a]);
        energy += 0.5 * stress_aa * strain_aa;
      }
      else
      {
        const Lanes g_ab = dot<dim>(x[1 << a], x[1 << b]);
        const Lanes inverse = 1. / (length_squared[a] * length_squared[b] - g_ab * g_ab);
        const Lanes G_aa = length_squared[b] * inverse, G_bb = length_squared[a] * inverse, G_ab = -g_ab * inverse;
        const Lanes strain_bb = dot<dim>(q[of_b], edge[b]);
        const Lanes strain_ab = 0.5 * (dot<dim>(q[of_a], edge[b]) + dot<dim>(q[of_b], edge[a]));
        // One index raised, then the other.
        const Lanes m_aa = G_aa * strain_aa + G_ab * strain_ab, m_ab = G_aa * strain_ab + G_ab * strain_bb;
        const Lanes m_ba = G_ab * strain_aa + G_bb * strain_ab, m_bb = G_ab * strain_ab + G_bb * strain_bb;
        const Lanes pressure = lambda * (m_aa + m_bb);
        const Lanes t_aa = pressure + (2. * mu) * m_aa, t_bb = pressure + (2. * mu) * m_bb;
        const Lanes stress_aa = t_aa * G_aa + (2. * mu) * m_ab * G_ab;
        const Lanes stress_bb = t_bb * G_bb + (2. * mu) * m_ba * G_ab;
        const Lanes stress_ab = t_aa * G_ab + (2. * mu) * m_ab * G_bb;
        add<dim>(s[of_a], stress_aa, edge[a]);
        add<dim>(s[of_a], stress_ab, edge[b]);
        add<dim>(s[of_b], stress_bb, edge[b]);
        add<dim>(s[of_b], stress_ab, edge[a]);
        add<dim>(on_edge[a], stress_aa, q[of_a]);
        add<dim>(on_edge[a], stress_ab, q[of_b]);
        add<dim>(on_edge[b], stress_bb, q[of_b]);
        add<dim>(on_edge[b], stress_ab, q[of_a]);
        energy += 0.5 * (stress_aa * strain_aa + stress_bb * strain_bb) + stress_ab * strain_ab;
      }
    }
    if constexpr (dim == 3)
    {
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
      {
        const Lanes strain = dot<dim>(q[3], edge[d]);
        const Lanes stress = law.young() * strain / (length_squared[d] * length_squared[d]);
        add<dim>(s[3], stress, edge[d]);
        add<dim>(on_edge[d], stress, q[3]);
        energy += 0.5 * stress * strain;
      }
    }
    if constexpr (!Law::linear)
    {
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
#pragma GCC unroll 8
        for (int i = 0; i < dim; ++i)
          add<dim>(P[i], on_edge[d][i], x[1 << d]);
    }
    return energy;
  }

  [[gnu::always_inline]] void add_forces(const Tensor<dim> &P, const Hourglass<dim> &s, Lanes (&f)[n][dim]) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
    {
      Lanes stress[dim];
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
      {
        stress[j] = P[i][j];
        // The amplitudes are measured from the linear field.
#pragma GCC unroll 8
        for (int h = 0; h < n_hourglass<dim>; ++h)
          stress[j] -= s[h][i] * x[hourglass_monomials[h]][j];
        stress[j] *= weight;
      }
#pragma GCC unroll 8
      for (int m = 1; m <= n_gradients; ++m)
        f[m][i] += dot<dim>(stress, B[m]);
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        f[hourglass_monomials[h]][i] += weight * s[h][i];
    }
  }

private:
  Lanes x[n][dim], B[n][dim] = {};
};

/// Edges parallel to the axes: the same with everything that is zero left out.
template <int dim>
class BoxCell
{
public:
  static constexpr int n = q1::n_nodes<dim>;

  Lanes weight;

  template <typename Geometry>
  [[gnu::always_inline]] explicit BoxCell(const Geometry &geometry) : weight(geometry.weight)
  {
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      mapping[d] = geometry.mapping[d];
  }

  [[gnu::always_inline]] void split(const Lanes (&c)[n][dim], Tensor<dim> &H, Hourglass<dim> &q) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
    {
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
        H[i][j] = c[1 << j][i] * mapping[j];
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        q[h][i] = c[hourglass_monomials[h]][i];
    }
  }

  template <typename Law>
  [[gnu::always_inline]] Lanes hourglass(const Law &law, const Tensor<dim> &H, const Hourglass<dim> &q, Hourglass<dim> &s,
                                         Tensor<dim> &P) const
  {
    const double lambda = law.sheet_lambda(), mu = law.mu;
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
        r[3][d] += (law.young() * mapping[d] * mapping[d]) * p[3][d];
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

  [[gnu::always_inline]] void add_forces(const Tensor<dim> &P, const Hourglass<dim> &s, Lanes (&f)[n][dim]) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
    {
#pragma GCC unroll 8
      for (int j = 0; j < dim; ++j)
        f[1 << j][i] += weight * mapping[j] * P[i][j];
#pragma GCC unroll 8
      for (int h = 0; h < n_hourglass<dim>; ++h)
        f[hourglass_monomials[h]][i] += weight * s[h][i];
    }
  }

private:
  Lanes mapping[dim];
};

template <typename Cell, int dim, typename Law>
[[gnu::always_inline]] inline void forces_of_cell(const Law &law, const Cell &cell, const Lanes (&c)[q1::n_nodes<dim>][dim],
                                                  Lanes (&f)[q1::n_nodes<dim>][dim])
{
  Tensor<dim> H, P;
  Hourglass<dim> q, s = {};
  cell.split(c, H, q);
  law.template first_piola<dim>(H, P);
  cell.hourglass(law, H, q, s, P);
  cell.add_forces(P, s, f);
}

template <typename Cell, int dim, typename Law>
[[gnu::always_inline]] inline Lanes energy_of_cell(const Law &law, const Cell &cell, const Lanes (&c)[q1::n_nodes<dim>][dim])
{
  Tensor<dim> H, P = {};
  Hourglass<dim> q, s = {};
  cell.split(c, H, q);
  return cell.weight * (law.template energy_density<dim>(H) + cell.hourglass(law, H, q, s, P));
}
} // namespace

template <int dim>
void OnePointCells<dim>::clear()
{
  mapped.clear();
  weighted.clear();
  boxes.clear();
}

template <int dim>
void OnePointCells<dim>::add_cell(const int (&offset)[n], const CellGeometry<dim> &cell)
{
  const double total_weight = cell.total_weight();
  if (cell.box && cell.uniform)
    boxes.add(offset,
              [&](Box &lanes, const int l, const bool unused)
              {
                for (int d = 0; d < dim; ++d)
                  lanes.mapping[d][l] = cell.inverse[0](d, d) / n;
                lanes.weight[l] = unused ? 0. : total_weight;
              });
  else if (cell.uniform)
    mapped.add(offset,
               [&](Mapped &lanes, const int l, const bool unused)
               {
                 lanes.positions.set(l, cell.X);
                 lanes.weight[l] = unused ? 0. : cell.alpha[0] * std::pow(1. / n, dim - 1);
               });
  else
    weighted.add(offset,
                 [&](Weighted &lanes, const int l, const bool unused)
                 {
                   const typename CellGeometry<dim>::NodalGradients nodal = cell.mean_gradients();
                   lanes.positions.set(l, cell.X);
                   lanes.weight[l] = unused ? 0. : total_weight;
                   for (int m = 1; m < n; ++m)
                     for (int j = 0; j < dim; ++j)
                     {
                       double sum = 0.;
                       for (int a = 0; a < n; ++a)
                         sum += sign(m, a) * nodal(a, j);
                       lanes.gradient[m][j][l] = sum / (n * monomial_scale(m));
                     }
                 });
}

template <int dim>
template <typename Law>
void OnePointCells<dim>::add_forces(const Law &law, const double *u, double *f) const
{
  using Coefficients = Lanes[n][dim];
  mapped.add_forces(u, f,
                    [&law](const Mapped &geometry, const Coefficients &c, Coefficients &r)
                    { forces_of_cell<ShapedCell<dim, true>, dim>(law, ShapedCell<dim, true>(geometry), c, r); });
  weighted.add_forces(u, f,
                      [&law](const Weighted &geometry, const Coefficients &c, Coefficients &r)
                      { forces_of_cell<ShapedCell<dim, false>, dim>(law, ShapedCell<dim, false>(geometry), c, r); });
  boxes.add_forces(u, f,
                   [&law](const Box &geometry, const Coefficients &c, Coefficients &r)
                   { forces_of_cell<BoxCell<dim>, dim>(law, BoxCell<dim>(geometry), c, r); });
}

template <int dim>
template <typename Law>
double OnePointCells<dim>::energy(const Law &law, const double *u) const
{
  using Coefficients = Lanes[n][dim];
  return mapped.energy(u, [&law](const Mapped &geometry, const Coefficients &c)
                       { return energy_of_cell<ShapedCell<dim, true>, dim>(law, ShapedCell<dim, true>(geometry), c); }) +
         weighted.energy(u, [&law](const Weighted &geometry, const Coefficients &c)
                         { return energy_of_cell<ShapedCell<dim, false>, dim>(law, ShapedCell<dim, false>(geometry), c); }) +
         boxes.energy(u, [&law](const Box &geometry, const Coefficients &c)
                      { return energy_of_cell<BoxCell<dim>, dim>(law, BoxCell<dim>(geometry), c); });
}

template class OnePointCells<2>;
template class OnePointCells<3>;
template void OnePointCells<2>::add_forces(const StVenantKirchhoff &, const double *, double *) const;
template void OnePointCells<3>::add_forces(const StVenantKirchhoff &, const double *, double *) const;
template void OnePointCells<2>::add_forces(const LinearisedLaw &, const double *, double *) const;
template void OnePointCells<3>::add_forces(const LinearisedLaw &, const double *, double *) const;
template double OnePointCells<2>::energy(const StVenantKirchhoff &, const double *) const;
template double OnePointCells<3>::energy(const StVenantKirchhoff &, const double *) const;
template double OnePointCells<2>::energy(const LinearisedLaw &, const double *) const;
template double OnePointCells<3>::energy(const LinearisedLaw &, const double *) const;
} // namespace kerf::fem
