// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/q1_cell.h"
#include "fem_side/element/simd.h"

#include <vector>

namespace kerf::fem
{
/// A batch has as many cells as there are lanes. Inside a batch a field is represented by coefficients c_m of the monomials.
/// They are scaled so that 2^dim times the derivative along xi_d is a sum of +-c_m at every Gauss point: coefficient m is 2^dim
/// gauss^(|m| - 1) times that of monomial m, which has |m| factors. Positions are represented alike, so that 2^dim cancels in
/// gradients.
constexpr double monomial_scale(const int mask)
{
  double scale = 1.;
  for (int rest = mask & (mask - 1); rest != 0; rest &= rest - 1) // all factors but one
    scale *= q1::gauss;
  return scale;
}

/// @p index without its bit @p d.
constexpr int without_bit(const int index, const int d)
{
  return (index & ((1 << d) - 1)) | (index >> (d + 1) << d);
}
/// @p rest with a one inserted as bit @p d: the monomial whose derivative along xi_d is @p rest.
constexpr int with_bit(const int rest, const int d)
{
  return (rest & ((1 << d) - 1)) | 1 << d | rest >> d << (d + 1);
}
/// Sign of the monomial @p mask at Gauss point @p q.
constexpr double sign(const int mask, const int q)
{
  double s = 1.;
  for (int rest = mask & ~q; rest != 0; rest &= rest - 1)
    s = -s;
  return s;
}

/// Places of the nodes in the nodal arrays, lane by lane.
template <int dim>
using BatchNodes = int[q1::n_nodes<dim>][n_lanes];

/// Without @p scaled coefficient m is 2^dim times that of the monomial.
template <int dim, bool scaled = true>
inline void read_monomials(const double *values, const BatchNodes<dim> &nodes, Lanes (&c)[q1::n_nodes<dim>][dim])
{
#pragma GCC unroll 8
  for (int a = 0; a < q1::n_nodes<dim>; ++a)
    gather<dim>(values, nodes[a], c[a]);
  q1::nodes_to_monomials<dim, dim>(c);
#pragma GCC unroll 8
  for (int m = 3; m < q1::n_nodes<dim>; ++m)
    if (scaled && (m & (m - 1)) != 0)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
        c[m][i] *= monomial_scale(m);
}

/// The transpose of read_monomials(); overwrites the coefficients.
template <int dim, bool scaled = true>
inline void add_monomials(Lanes (&f)[q1::n_nodes<dim>][dim], const BatchNodes<dim> &nodes, double *values)
{
#pragma GCC unroll 8
  for (int m = 3; m < q1::n_nodes<dim>; ++m)
    if (scaled && (m & (m - 1)) != 0)
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
        f[m][i] *= monomial_scale(m);
  q1::monomials_to_nodes<dim, dim>(f);
#pragma GCC unroll 8
  for (int a = 0; a < q1::n_nodes<dim>; ++a)
    scatter_add<dim>(f[a], nodes[a], values);
}

/// Coefficients 1.. of the positions of a cell's nodes.
template <int dim, bool scaled = true>
struct BatchPositions
{
  Lanes x[q1::n_nodes<dim>][dim]; ///< x[0] is not used

  void set(const int lane, const q1::NodalValues<dim> &X)
  {
    for (int m = 1; m < q1::n_nodes<dim>; ++m)
      for (int j = 0; j < dim; ++j)
      {
        double sum = 0.;
        for (int a = 0; a < q1::n_nodes<dim>; ++a)
          sum += sign(m, a) * X(j, a);
        x[m][j][lane] = scaled ? monomial_scale(m) * sum : sum;
      }
  }
};

/// Batches of cells or patches with @p n_nodes nodes, filled lane by lane.
template <int n_nodes, typename Geometry>
struct LaneList
{
  struct Batch
  {
    Geometry geometry;
    int offset[n_nodes][n_lanes]; ///< places of the nodes in the nodal arrays
  };
  std::vector<Batch> batches;
  int n_added = 0;

  void clear()
  {
    batches.clear();
    n_added = 0;
  }
  /// @p set(geometry, lane, unused) writes a lane. The first cell of a batch fills all its lanes, without weight where unused,
  /// so that unused lanes add zeros to valid nodes.
  template <typename Set>
  void add(const int (&offset)[n_nodes], const Set &set)
  {
    const int lane = n_added++ % n_lanes;
    if (lane == 0)
      batches.emplace_back();
    Batch &batch = batches.back();
    for (int l = lane; l < (lane == 0 ? n_lanes : lane + 1); ++l)
    {
      for (int a = 0; a < n_nodes; ++a)
        batch.offset[a][l] = offset[a];
      set(batch.geometry, l, l != lane);
    }
  }
  /// Prefetches a batch, or one of @p n_parts parts of it. Addresses beyond the last batch do no harm.
  static void prefetch(const Batch *batch, const int part = 0, const int n_parts = 1)
  {
    const std::size_t n_lines = (sizeof(Batch) + 63) / 64, size = (n_lines + n_parts - 1) / n_parts * 64;
    for (std::size_t byte = part * size; byte < (part + 1) * size; byte += 64)
      __builtin_prefetch(reinterpret_cast<const char *>(batch) + byte);
  }
};

template <int dim, typename Geometry, bool scaled = true>
struct BatchList : LaneList<q1::n_nodes<dim>, Geometry>
{
  using typename LaneList<q1::n_nodes<dim>, Geometry>::Batch;

  /// @p forces(geometry, c, f): f += the internal forces in monomials. @p before and @p after are called around each batch.
  template <typename Forces, typename Before, typename After>
  void add_forces(const double *u, double *f, const Forces &forces, const Before &before, const After &after) const
  {
    for (const Batch &batch : this->batches)
    {
      this->prefetch(&batch + 2);
      before();
      Lanes c[q1::n_nodes<dim>][dim], r[q1::n_nodes<dim>][dim] = {};
      read_monomials<dim, scaled>(u, batch.offset, c);
      forces(batch.geometry, c, r);
      add_monomials<dim, scaled>(r, batch.offset, f);
      after();
    }
  }
  template <typename Forces>
  void add_forces(const double *u, double *f, const Forces &forces) const
  {
    add_forces(
      u, f, forces, [] {}, [] {});
  }
  /// Sum of @p energy(geometry, c).
  template <typename Energy, typename Before>
  double energy(const double *u, const Energy &energy_of, const Before &before) const
  {
    Lanes sum = {};
    for (const Batch &batch : this->batches)
    {
      before();
      Lanes c[q1::n_nodes<dim>][dim];
      read_monomials<dim, scaled>(u, batch.offset, c);
      sum += energy_of(batch.geometry, c);
    }
    return sum_of_lanes(sum);
  }
  template <typename Energy>
  double energy(const double *u, const Energy &energy_of) const
  {
    return energy(u, energy_of, [] {});
  }
};
} // namespace kerf::fem
