// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/cell_batch.h"

namespace kerf::fem
{
/// A patch is the 2^dim cells around a node: a grid of 3^dim nodes, of which a lane reads each once and not once a cell. Cells
/// and nodes of the grid are numbered with x fastest. Across the last axis it consists of layers of cells between planes of
/// nodes.
template <int dim>
struct Patch
{
  static constexpr int n_cells = 1 << dim;
  static constexpr int n_nodes = dim == 2 ? 9 : 27;
  static constexpr int n_planes = 3;
  static constexpr int cells_of_layer = n_cells / 2;
  static constexpr int nodes_of_plane = n_nodes / n_planes;
  static constexpr int face_monomials = q1::n_nodes<dim> / 2; ///< of a cell, on one of the planes

  /// Node of the grid that is node @p a of cell @p cell.
  static constexpr int node(const int cell, const int a)
  {
    int number = 0;
    for (int d = dim - 1; d >= 0; --d)
      number = 3 * number + (cell >> d & 1) + (a >> d & 1);
    return number;
  }
};

/// A field on a patch: what cells that lie side by side share is computed once. Of the butterflies from nodes to monomials, all
/// but the one across the layers are done plane by plane.
template <int dim>
class PatchField
{
public:
  using P = Patch<dim>;
  static constexpr int n = q1::n_nodes<dim>;
  using Plane = Lanes[P::nodes_of_plane][dim];

  /// Nodal values -> monomials on the faces of the cells.
  [[gnu::always_inline]] void set_plane(const int plane, const Lanes (*v)[dim])
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
      if constexpr (dim == 2)
      {
#pragma GCC unroll 8
        for (int c = 0; c < 2; ++c)
          split(v[c][i], v[c + 1][i], at[plane][c][0][i], at[plane][c][1][i]);
      }
      else
      {
        Lanes along_x[3][2][2];
#pragma GCC unroll 8
        for (int y = 0; y < 3; ++y)
#pragma GCC unroll 8
          for (int x = 0; x < 2; ++x)
            split(v[3 * y + x][i], v[3 * y + x + 1][i], along_x[y][x][0], along_x[y][x][1]);
#pragma GCC unroll 8
        for (int c = 0; c < 4; ++c)
#pragma GCC unroll 8
          for (int m = 0; m < 2; ++m)
            split(along_x[c >> 1][c & 1][m], along_x[(c >> 1) + 1][c & 1][m], at[plane][c][m][i], at[plane][c][m + 2][i]);
      }
  }
  /// Coefficients of the monomials in a cell, times 2^dim.
  [[gnu::always_inline]] void monomials(const int cell, Lanes (&c)[n][dim]) const
  {
    const int layer = cell / P::cells_of_layer, column = cell % P::cells_of_layer;
#pragma GCC unroll 8
    for (int m = 0; m < P::face_monomials; ++m)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
        split(at[layer][column][m][i], at[layer + 1][column][m][i], c[m][i], c[m + P::face_monomials][i]);
  }

  /// The transposes: a cell's forces in monomials are added, those of a plane's nodes returned.
  void set_zero()
  {
    for (auto &plane : at)
      for (auto &cell : plane)
        for (auto &monomial : cell)
          for (Lanes &value : monomial)
            value = Lanes{};
  }
  [[gnu::always_inline]] void add_monomials(const int cell, const Lanes (&f)[n][dim])
  {
    const int layer = cell / P::cells_of_layer, column = cell % P::cells_of_layer;
#pragma GCC unroll 8
    for (int m = 0; m < P::face_monomials; ++m)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
      {
        at[layer][column][m][i] += f[m][i] - f[m + P::face_monomials][i];
        at[layer + 1][column][m][i] += f[m][i] + f[m + P::face_monomials][i];
      }
  }
  [[gnu::always_inline]] void plane_to_nodes(const int plane, Plane &v) const
  {
#pragma GCC unroll 8
    for (int i = 0; i < dim; ++i)
      if constexpr (dim == 2)
        join(at[plane][0][0][i], at[plane][0][1][i], at[plane][1][0][i], at[plane][1][1][i], v[0][i], v[1][i], v[2][i]);
      else
      {
        Lanes along_x[3][2][2];
#pragma GCC unroll 8
        for (int x = 0; x < 2; ++x)
#pragma GCC unroll 8
          for (int m = 0; m < 2; ++m)
            join(at[plane][x][m][i], at[plane][x][m + 2][i], at[plane][x + 2][m][i], at[plane][x + 2][m + 2][i],
                 along_x[0][x][m], along_x[1][x][m], along_x[2][x][m]);
#pragma GCC unroll 8
        for (int y = 0; y < 3; ++y)
          join(along_x[y][0][0], along_x[y][0][1], along_x[y][1][0], along_x[y][1][1], v[3 * y][i], v[3 * y + 1][i],
               v[3 * y + 2][i]);
      }
  }

private:
  [[gnu::always_inline]] static void split(const Lanes &low, const Lanes &high, Lanes &even, Lanes &odd)
  {
    even = high + low;
    odd = high - low;
  }
  /// The transpose for two cells in a row.
  [[gnu::always_inline]] static void join(const Lanes &even_0, const Lanes &odd_0, const Lanes &even_1, const Lanes &odd_1,
                                          Lanes &low, Lanes &middle, Lanes &high)
  {
    low = even_0 - odd_0;
    middle = (even_0 + odd_0) + (even_1 - odd_1);
    high = even_1 + odd_1;
  }

  Lanes at[P::n_planes][P::cells_of_layer][P::face_monomials][dim];
};

template <int dim, typename Geometry>
struct PatchList : LaneList<Patch<dim>::n_nodes, Geometry>
{
  using typename LaneList<Patch<dim>::n_nodes, Geometry>::Batch;
  using P = Patch<dim>;
  static constexpr int n = q1::n_nodes<dim>;

  /// @p forces(cells, cell, c, f): f += the internal forces of a cell in monomials, where cells = @p Cells(geometry). @p before
  /// and @p after are called around each batch.
  template <typename Cells, typename Forces, typename Before, typename After>
  void add_forces(const double *u, double *f, const Forces &forces, const Before &before, const After &after) const
  {
    PatchField<dim> field, patch_forces;
    for (const Batch &batch : this->batches)
    {
      this->prefetch(&batch + 1);
      before();
      read(u, batch, field);
      const Cells cells(batch.geometry);
      patch_forces.set_zero();
      for (int cell = 0; cell < P::n_cells; ++cell)
      {
        Lanes c[n][dim], r[n][dim] = {};
        field.monomials(cell, c);
        forces(cells, cell, c, r);
        patch_forces.add_monomials(cell, r);
      }
      for (int plane = 0; plane < P::n_planes; ++plane)
      {
        typename PatchField<dim>::Plane v;
        patch_forces.plane_to_nodes(plane, v);
#pragma GCC unroll 9
        for (int a = 0; a < P::nodes_of_plane; ++a)
          scatter_add<dim>(v[a], batch.offset[plane * P::nodes_of_plane + a], f);
      }
      after();
    }
  }
  /// Sum of @p energy(cells, cell, c).
  template <typename Cells, typename Energy, typename Before>
  double energy(const double *u, const Energy &energy_of, const Before &before) const
  {
    PatchField<dim> field;
    Lanes sum = {};
    for (const Batch &batch : this->batches)
    {
      before();
      read(u, batch, field);
      const Cells cells(batch.geometry);
      for (int cell = 0; cell < P::n_cells; ++cell)
      {
        Lanes c[n][dim];
        field.monomials(cell, c);
        sum += energy_of(cells, cell, c);
      }
    }
    return sum_of_lanes(sum);
  }

private:
  static void read(const double *u, const Batch &batch, PatchField<dim> &field)
  {
    for (int plane = 0; plane < P::n_planes; ++plane)
    {
      typename PatchField<dim>::Plane v;
#pragma GCC unroll 9
      for (int a = 0; a < P::nodes_of_plane; ++a)
        gather<dim>(u, batch.offset[plane * P::nodes_of_plane + a], v[a]);
      field.set_plane(plane, v);
    }
  }
};
} // namespace kerf::fem
