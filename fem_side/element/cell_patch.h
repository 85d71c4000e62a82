// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_batch.h"

namespace kerf::fem
{
/// A patch consists of the 2^dim cells around a node and has a grid of 3^dim nodes. A lane reads and writes each node once, not
/// once a cell. Cells and nodes of the grid are numbered with x fastest.
template <int dim>
struct Patch
{
  static constexpr int n_cells = 1 << dim;
  static constexpr int n_nodes = dim == 2 ? 9 : 27;

  /// Node of the grid that is node @p a of cell @p cell: the sum of that of cell 0 and the cell's first one.
  static constexpr int node(const int cell, const int a) { return node_of_first(cell) + node_of_first(a); }
  static constexpr int node_of_first(const int a) { return (a & 1) + 3 * (a >> 1 & 1) + 9 * (a >> 2); }
};

/// Nodal values of a patch.
template <int dim>
using PatchNodes = Lanes[Patch<dim>::n_nodes][dim];

/// Coefficients of the monomials of component @p i in a cell, times 2^dim.
template <int dim>
[[gnu::always_inline]] inline void read_cell(const PatchNodes<dim> &v, const int cell, const int i,
                                             Lanes (&c)[q1::n_nodes<dim>])
{
  const Lanes(*first)[dim] = v + Patch<dim>::node_of_first(cell);
#pragma GCC unroll 8
  for (int a = 0; a < q1::n_nodes<dim>; ++a)
    c[a] = first[Patch<dim>::node_of_first(a)][i];
#pragma GCC unroll 8
  for (int d = 0; d < dim; ++d)
#pragma GCC unroll 8
    for (int k = 0; k < q1::n_nodes<dim> / 2; ++k)
    {
      const int high = with_bit(k, d), low = high ^ 1 << d;
      const Lanes sum = c[high] + c[low];
      c[high] = c[high] - c[low];
      c[low] = sum;
    }
}
/// The transpose; overwrites the coefficients.
template <int dim>
[[gnu::always_inline]] inline void add_to_cell(Lanes (&c)[q1::n_nodes<dim>], const int cell, const int i, PatchNodes<dim> &v)
{
#pragma GCC unroll 8
  for (int d = 0; d < dim; ++d)
#pragma GCC unroll 8
    for (int k = 0; k < q1::n_nodes<dim> / 2; ++k)
    {
      const int odd = with_bit(k, d), even = odd ^ 1 << d;
      const Lanes low = c[even] - c[odd];
      c[odd] = c[even] + c[odd];
      c[even] = low;
    }
  Lanes(*first)[dim] = v + Patch<dim>::node_of_first(cell);
#pragma GCC unroll 8
  for (int a = 0; a < q1::n_nodes<dim>; ++a)
    first[Patch<dim>::node_of_first(a)][i] += c[a];
}

template <int dim, typename Geometry>
struct PatchList : LaneList<Patch<dim>::n_nodes, Geometry>
{
  using typename LaneList<Patch<dim>::n_nodes, Geometry>::Batch;
  static constexpr int n = q1::n_nodes<dim>;

  /// @p forces.add(geometry[k], read, add) computes the forces of cell k. It gets the monomials of one component at a time by
  /// read(component, c), so that they fit into registers, and returns forces likewise by add. @p before and @p after are called
  /// around each batch.
  template <typename Forces, typename Before, typename After>
  void add_forces(const double *u, double *f, const Forces &forces, const Before &before, const After &after) const
  {
    for (const Batch &batch : this->batches)
    {
      before();
      PatchNodes<dim> v, sum = {};
      read(u, batch, v);
#pragma GCC unroll 1
      for (int k = 0; k < Patch<dim>::n_cells; ++k)
      {
        // In parts, because a prefetch of the whole batch would stall.
        this->prefetch(&batch + 1, k, Patch<dim>::n_cells);
        forces.add(
          batch.geometry[k], [&](const int i, Lanes(&c)[n]) __attribute__((always_inline)) { read_cell<dim>(v, k, i, c); },
          [&](const int i, Lanes(&r)[n]) __attribute__((always_inline)) { add_to_cell<dim>(r, k, i, sum); });
      }
      for (int a = 0; a < Patch<dim>::n_nodes; ++a)
        scatter_add<dim>(sum[a], batch.offset[a], f);
      after();
    }
  }
  /// Sum of @p energy_of.sum(geometry[k], read).
  template <typename Energy, typename Before>
  double energy(const double *u, const Energy &energy_of, const Before &before) const
  {
    Lanes sum = {};
    for (const Batch &batch : this->batches)
    {
      before();
      PatchNodes<dim> v;
      read(u, batch, v);
      for (int cell = 0; cell < Patch<dim>::n_cells; ++cell)
        sum += energy_of.sum(
          batch.geometry[cell], [&](const int i, Lanes(&c)[n])
                                  __attribute__((always_inline)) { read_cell<dim>(v, cell, i, c); });
    }
    return sum_of_lanes(sum);
  }

private:
  static void read(const double *u, const Batch &batch, PatchNodes<dim> &v)
  {
    for (int a = 0; a < Patch<dim>::n_nodes; ++a)
      gather<dim>(u, batch.offset[a], v[a]);
  }
};
} // namespace kerf::fem
