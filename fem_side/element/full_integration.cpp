// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/full_integration.h"

#include "fem_side/element/gauss_points.h"

#include <cmath>

namespace kerf::fem
{
namespace
{
/// Weighted mean of tr E over the cell, and the sum of the weights.
template <int dim, typename Law, typename Geometry>
[[gnu::always_inline]] inline Lanes mean_of_dilatation(const Law &, const Points<dim, Geometry> &points,
                                                       const Derivatives<dim> &D, Lanes &total_weight)
{
  Lanes sum = {};
  total_weight = sum;
#pragma GCC unroll 8
  for (int q = 0; q < q1::n_nodes<dim>; ++q)
  {
    Lanes H[dim][dim];
    const auto point = points[q];
    point.gradient(D, q, H);
    sum += point.weight * Law::template dilatation<dim>(H);
    total_weight += point.weight;
  }
  // Unused lanes have no weight; the tiny number avoids 0/0 there.
  return sum / (total_weight + 1e-300);
}

template <int dim, bool mean_dilatation, typename Law, typename Geometry>
[[gnu::always_inline]] inline void forces_of_points(const Law &law, const Geometry &geometry,
                                                    const Lanes (&c)[q1::n_nodes<dim>][dim], Lanes (&f)[q1::n_nodes<dim>][dim])
{
  Derivatives<dim> D, T = {};
  evaluate<dim>(c, D);
  const Points<dim, Geometry> points(geometry);
  Lanes mean = {};
  if constexpr (mean_dilatation)
  {
    Lanes total_weight;
    mean = mean_of_dilatation<dim>(law, points, D, total_weight);
  }
#pragma GCC unroll 8
  for (int q = 0; q < q1::n_nodes<dim>; ++q)
  {
    Lanes H[dim][dim], E[dim][dim], S[dim][dim], P[dim][dim];
    const auto point = points[q];
    point.gradient(D, q, H);
    Law::template strain<dim>(H, E);
    if constexpr (mean_dilatation)
      law.template second_piola_of_mean<dim>(E, mean, S);
    else
      law.template second_piola<dim>(E, S);
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
#pragma GCC unroll 8
      for (int j = 0; j <= i; ++j)
        S[i][j] = S[j][i] = S[i][j] * point.weight;
    Law::template piola_of<dim>(H, S, P);
    point.add_stress(P, q, T);
  }
  integrate<dim>(T, f);
}

/// The same forces for Hooke's law with constant mapping and weight. Products of different monomials vanish in the sum over
/// Gauss points, so the sum runs over the 2^dim - 1 monomials of the strain instead. Most of these have few components.
template <int dim, bool mean_dilatation, typename Geometry>
[[gnu::always_inline]] inline void forces_of_monomials(const LinearisedLaw &law, const Geometry &geometry,
                                                       const Lanes (&c)[q1::n_nodes<dim>][dim],
                                                       Lanes (&f)[q1::n_nodes<dim>][dim])
{
  constexpr int n = q1::n_nodes<dim>;
  const Lanes weight = static_cast<double>(n) * geometry.weight;
  Lanes mapping[dim], weighted_mapping[dim];
#pragma GCC unroll 8
  for (int d = 0; d < dim; ++d)
  {
    mapping[d] = geometry.mapping[d];
    weighted_mapping[d] = weight * mapping[d];
  }
#pragma GCC unroll 8
  for (int k = 0; k < n - 1; ++k) // the part of the strain that goes with monomial k
  {
    // The mean dilatation is constant over the cell.
    const double lambda = mean_dilatation && k > 0 ? -2. / 3. * law.mu : law.lambda;
    Lanes H[dim][dim], pressure = {};
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      if (!(k >> d & 1))
      {
#pragma GCC unroll 8
        for (int i = 0; i < dim; ++i)
          H[i][d] = c[k | 1 << d][i] * mapping[d];
        pressure += lambda * H[d][d];
      }
#pragma GCC unroll 8
    for (int d = 0; d < dim; ++d)
      if (!(k >> d & 1))
#pragma GCC unroll 8
        for (int i = 0; i < dim; ++i)
        {
          const Lanes stress = i == d         ? (2. * law.mu) * H[d][d] + pressure
                               : (k >> i & 1) ? law.mu * H[i][d]
                                              : law.mu * (H[i][d] + H[d][i]);
          f[k | 1 << d][i] += stress * weighted_mapping[d];
        }
  }
}

template <int dim, bool mean_dilatation, typename Law, typename Geometry>
[[gnu::always_inline]] inline Lanes energy_of_points(const Law &law, const Geometry &geometry,
                                                     const Lanes (&c)[q1::n_nodes<dim>][dim])
{
  Derivatives<dim> D;
  evaluate<dim>(c, D);
  const Points<dim, Geometry> points(geometry);
  Lanes energy = {};
  if constexpr (mean_dilatation)
  {
    Lanes total_weight;
    const Lanes mean = mean_of_dilatation<dim>(law, points, D, total_weight);
    energy = (0.5 * law.bulk_modulus()) * total_weight * mean * mean;
  }
  for (int q = 0; q < q1::n_nodes<dim>; ++q)
  {
    Lanes H[dim][dim];
    const auto point = points[q];
    point.gradient(D, q, H);
    energy +=
      point.weight * (mean_dilatation ? law.template deviatoric_energy_density<dim>(H) : law.template energy_density<dim>(H));
  }
  return energy;
}
} // namespace

template <int dim>
void FullIntegration<dim>::clear()
{
  mapped.clear();
  uniform_mapped.clear();
  boxes.clear();
  uniform_boxes.clear();
}

template <int dim>
void FullIntegration<dim>::add_cell(const int (&offset)[n], const CellGeometry<dim> &cell)
{
  const auto set_mapping = [&](auto &lanes, const int l)
  {
    for (int d = 0; d < dim; ++d)
      lanes.mapping[d][l] = cell.inverse[0](d, d) / n;
  };
  const double scale = std::pow(1. / n, dim);
  if (cell.box && cell.uniform)
    uniform_boxes.add(offset,
                      [&](UniformBox &lanes, const int l, const bool unused)
                      {
                        set_mapping(lanes, l);
                        lanes.weight[l] = unused ? 0. : cell.weight[0];
                      });
  else if (cell.box)
    boxes.add(offset,
              [&](Box &lanes, const int l, const bool unused)
              {
                set_mapping(lanes, l);
                for (int q = 0; q < n; ++q)
                  lanes.weight[q][l] = unused ? 0. : cell.weight[q];
              });
  else if (cell.uniform)
    uniform_mapped.add(offset,
                       [&](UniformMapped &lanes, const int l, const bool unused)
                       {
                         lanes.positions.set(l, cell.X);
                         lanes.weight[l] = unused ? 0. : scale * cell.alpha[0];
                       });
  else
    mapped.add(offset,
               [&](Mapped &lanes, const int l, const bool unused)
               {
                 lanes.positions.set(l, cell.X);
                 for (int q = 0; q < n; ++q)
                   lanes.weight[q][l] = unused ? 0. : scale * cell.alpha[q];
               });
}

template <int dim>
template <bool mean, typename Law>
void FullIntegration<dim>::add_forces_of(const Law &law, const double *u, double *f) const
{
  using Coefficients = Lanes[n][dim];
  const auto of_points = [&law](const auto &geometry, const Coefficients &c, Coefficients &r)
  { forces_of_points<dim, mean>(law, geometry, c, r); };
  mapped.add_forces(u, f, of_points);
  uniform_mapped.add_forces(u, f, of_points);
  boxes.add_forces(u, f, of_points);
  if constexpr (Law::linear)
    uniform_boxes.add_forces(u, f,
                             [&law](const UniformBox &geometry, const Coefficients &c, Coefficients &r)
                             { forces_of_monomials<dim, mean>(law, geometry, c, r); });
  else
    uniform_boxes.add_forces(u, f, of_points);
}

template <int dim>
template <bool mean, typename Law>
double FullIntegration<dim>::energy_of(const Law &law, const double *u) const
{
  using Coefficients = Lanes[n][dim];
  const auto of_cell = [&law](const auto &geometry, const Coefficients &c)
  { return energy_of_points<dim, mean>(law, geometry, c); };
  return mapped.energy(u, of_cell) + uniform_mapped.energy(u, of_cell) + boxes.energy(u, of_cell) +
         uniform_boxes.energy(u, of_cell);
}

template <int dim>
template <typename Law>
void FullIntegration<dim>::add_forces(const Law &law, const double *u, double *f) const
{
  if (mean_dilatation)
    add_forces_of<true>(law, u, f);
  else
    add_forces_of<false>(law, u, f);
}

template <int dim>
template <typename Law>
double FullIntegration<dim>::energy(const Law &law, const double *u) const
{
  return mean_dilatation ? energy_of<true>(law, u) : energy_of<false>(law, u);
}

template class FullIntegration<2>;
template class FullIntegration<3>;
template void FullIntegration<2>::add_forces(const StVenantKirchhoff &, const double *, double *) const;
template void FullIntegration<3>::add_forces(const StVenantKirchhoff &, const double *, double *) const;
template void FullIntegration<2>::add_forces(const LinearisedLaw &, const double *, double *) const;
template void FullIntegration<3>::add_forces(const LinearisedLaw &, const double *, double *) const;
template double FullIntegration<2>::energy(const StVenantKirchhoff &, const double *) const;
template double FullIntegration<3>::energy(const StVenantKirchhoff &, const double *) const;
template double FullIntegration<2>::energy(const LinearisedLaw &, const double *) const;
template double FullIntegration<3>::energy(const LinearisedLaw &, const double *) const;
} // namespace kerf::fem
