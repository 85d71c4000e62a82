// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/one_point_cells.h"

#include "fem_side/box_one_point.h"
#include "fem_side/shaped_one_point.h"

#include <cmath>

namespace kerf::fem
{
namespace
{
template <typename Cell, int dim, typename Law>
[[gnu::always_inline]] inline void forces_of_cell(const Law &law, const Cell &cell, const Lanes (&c)[q1::n_nodes<dim>][dim],
                                                  Lanes (&f)[q1::n_nodes<dim>][dim])
{
  GradientTensor<dim> H, P;
  Hourglass<dim> q, s = {};
  cell.split(c, H, q);
  law.template first_piola<dim>(H, P);
  cell.hourglass(law, H, q, s, P);
  cell.add_forces(P, s, f);
}

template <typename Cell, int dim, typename Law>
[[gnu::always_inline]] inline Lanes energy_of_cell(const Law &law, const Cell &cell, const Lanes (&c)[q1::n_nodes<dim>][dim])
{
  GradientTensor<dim> H, P = {};
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
                    { forces_of_cell<ShapedOnePoint<dim, true>, dim>(law, ShapedOnePoint<dim, true>(geometry), c, r); });
  weighted.add_forces(u, f,
                      [&law](const Weighted &geometry, const Coefficients &c, Coefficients &r)
                      { forces_of_cell<ShapedOnePoint<dim, false>, dim>(law, ShapedOnePoint<dim, false>(geometry), c, r); });
  boxes.add_forces(u, f,
                   [&law](const Box &geometry, const Coefficients &c, Coefficients &r)
                   { forces_of_cell<BoxOnePoint<dim>, dim>(law, BoxOnePoint<dim>(geometry), c, r); });
}

template <int dim>
template <typename Law>
double OnePointCells<dim>::energy(const Law &law, const double *u) const
{
  using Coefficients = Lanes[n][dim];
  return mapped.energy(u,
                       [&law](const Mapped &geometry, const Coefficients &c) {
                         return energy_of_cell<ShapedOnePoint<dim, true>, dim>(law, ShapedOnePoint<dim, true>(geometry), c);
                       }) +
         weighted.energy(u,
                         [&law](const Weighted &geometry, const Coefficients &c) {
                           return energy_of_cell<ShapedOnePoint<dim, false>, dim>(law, ShapedOnePoint<dim, false>(geometry), c);
                         }) +
         boxes.energy(u, [&law](const Box &geometry, const Coefficients &c)
                      { return energy_of_cell<BoxOnePoint<dim>, dim>(law, BoxOnePoint<dim>(geometry), c); });
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
