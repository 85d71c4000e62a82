// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/exchange/particle_interpolation.h"
#include "coupler/method/constraint/exchange/simd.h"

#include <algorithm>
#include <array>
#include <vector>

namespace kerf
{
/// Converts values at the corners to coefficients of the monomials 1, xi, eta, xi eta, ... The bits of a number give the powers
/// of the monomial, as they give the coordinates of a corner.
template <typename Value, std::size_t corners>
[[gnu::always_inline]] inline void to_coefficients(Value (&field)[corners])
{
  for (std::size_t bit = 1; bit < corners; bit <<= 1)
    for (std::size_t a = 0; a < corners; ++a)
      if (a & bit)
        field[a] -= field[a ^ bit];
}
/// The transpose of to_coefficients(): converts moments with the monomials to values at the corners.
template <typename Value, std::size_t corners>
[[gnu::always_inline]] inline void to_corners(Value (&moments)[corners])
{
  for (std::size_t bit = 1; bit < corners; bit <<= 1)
    for (std::size_t a = 0; a < corners; ++a)
      if (a & bit)
        moments[a ^ bit] -= moments[a];
}

/// Value at @p xi of the field with these coefficients.
template <typename Coefficients, typename Place>
[[gnu::always_inline]] inline auto value_of(const Coefficients &coefficient, const Place &xi)
{
  constexpr std::size_t corners = 1 << std::tuple_size_v<Place>;
  typename Place::value_type part[corners / 2];
  for (std::size_t m = 0; m < corners / 2; ++m)
    part[m] = coefficient[2 * m] + xi[0] * coefficient[2 * m + 1];
  for (std::size_t d = 1; corners >> (d + 1) > 0; ++d)
    for (std::size_t m = 0; m < corners >> (d + 1); ++m)
      part[m] = part[2 * m] + xi[d] * part[2 * m + 1];
  return part[0];
}
/// The transpose of value_of(): adds the moments of the value @p given at @p xi. Written without loops, which would keep the
/// moments in memory.
template <typename Value, std::size_t corners, typename Place>
[[gnu::always_inline]] inline void add_moments(const Value &given, const Place &xi, Value (&moments)[corners])
{
  const Value x = xi[0] * given, y = xi[1] * given, xy = xi[1] * x;
  moments[0] += given;
  moments[1] += x;
  moments[2] += y;
  moments[3] += xy;
  if constexpr (corners == 8)
  {
    moments[4] += xi[2] * given;
    moments[5] += xi[2] * x;
    moments[6] += xi[2] * y;
    moments[7] += xi[2] * xy;
  }
}

/// The tied particles of a rank, sorted by cell and grouped into batches for vector instructions. The nodal values of a cell
/// are read and its nodal forces are added once for all of its particles. Fields in a cell are multilinear. With the
/// coefficients of their monomials they need no shape functions, only the position of a particle in the cell.
template <int dim>
class CellBatches
{
public:
  static constexpr int corners = 1 << dim;
  using Vectors = PackedVectors<dim>;
  using One = typename Vectors::One;

  /// Tied particles of one cell, one for each lane. Unused lanes repeat a particle. Values of lanes_of() are zero there.
  struct alignas(64) Batch
  {
    std::array<SimdLanes, dim> xi;
    std::ptrdiff_t begin[n_simd_lanes]; ///< positions of the particles' vectors in arrays of three components

    /// Positions in the cell of a pack.
    [[gnu::always_inline]] std::array<SimdPack, dim> place(int number) const
    {
      std::array<SimdPack, dim> result;
      for (int d = 0; d < dim; ++d)
        result[d] = Vectors::spread(xi[d], number);
      return result;
    }
    [[gnu::always_inline]] const std::ptrdiff_t *begins(int number) const { return begin + Vectors::n_entries * number; }
    int particle(int lane) const { return static_cast<int>(begin[lane] / 3); }
  };
  /// A cell with tied particles. Its batches are consecutive.
  struct Cell
  {
    One place[corners];            ///< reference positions of the corners, without jumps across periodic axes [m]
    std::array<int, corners> node; ///< columns of the nodal window; the masters in a cell with hanging nodes
    int end = 0;                   ///< one past its last batch
    bool blocked = false;          ///< whether one of its particles is held in a direction
    int hanging = -1;              ///< position in the list of master shares; -1: no hanging nodes
  };

  void assign(const ParticleInterpolation &interpolation, const fem::Mesh &mesh, const dem::Packing &packing);
  /// Called after the particles have moved in their arrays.
  void renumber(const ParticleInterpolation &interpolation)
  {
    for (std::size_t k = 0; k < all_batches.size(); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        all_batches[k].begin[l] = 3 * std::ptrdiff_t(interpolation.entries()[entry_of[k][l]].particle);
  }

  const std::vector<Cell> &cells() const { return all_cells; }
  const std::vector<Batch> &batches() const { return all_batches; }
  /// Prefetches the batch and the scattered particle vectors that follow soon after @p batch.
  template <typename... Arrays>
  [[gnu::always_inline]] void fetch_after(int batch, const Arrays &...arrays) const
  {
    kerf::fetch_after(all_batches, batch);
    fetch_vectors_after(all_batches, batch, 6, arrays...);
  }

  /// Coefficients of a vector field for value_of() of a pack. @param field one column for each node of the nodal window
  template <typename Matrix>
  [[gnu::always_inline]] void coefficients(const Cell &cell, const Matrix &field, SimdPack (&result)[corners]) const
  {
    One values[corners];
    at_corners(cell, field, values);
    repeat_coefficients(values, result);
  }
  /// Coefficients of the present positions of the finite elements [m]. With @p rate the reference positions are multiplied by
  /// it. Then @p displacement must be displacements times the rate plus another field.
  [[gnu::always_inline]] void places(const Cell &cell, const Eigen::Matrix3Xd &displacement, SimdPack (&result)[corners],
                                     double rate = 1.) const
  {
    One values[corners];
    places_of_corners(cell, displacement, values, rate);
    repeat_coefficients(values, result);
  }
  /// -chi of a pack [m]. @param period of the periodic axes, 0 in others [m]
  template <bool periodic>
  [[gnu::always_inline]] static SimdPack minus_chi(const SimdPack (&places)[corners], const std::array<SimdPack, dim> &xi,
                                                   const SimdPack &position, const Eigen::Vector3d &period)
  {
    SimdPack result = value_of(places, xi) - position;
    if (periodic)
      wrap<dim>(result, period);
    return result;
  }
  /// The transpose of coefficients(): adds @p sign times the moments of a cell to the nodal vectors @p field.
  template <typename Matrix>
  [[gnu::always_inline]] void scatter(const Cell &cell, const SimdPack (&moments)[corners], double sign, Matrix &&field) const
  {
    One sums[corners];
    for (int m = 0; m < corners; ++m)
      sums[m] = sign * Vectors::fold(moments[m]);
    scatter(cell, sums, field);
  }

  /// The same for one vector instead of a pack: coefficients of vectors stored by node, and of the positions.
  template <typename Value>
  [[gnu::always_inline]] void coefficients_of(const Cell &cell, const std::vector<Value> &of_nodes,
                                              Value (&result)[corners]) const
  {
    for (int a = 0; a < corners; ++a)
      result[a] = of_nodes[cell.node[a]];
    from_masters(cell, result);
    to_coefficients(result);
  }
  [[gnu::always_inline]] void places(const Cell &cell, const Eigen::Matrix3Xd &displacement, One (&result)[corners]) const
  {
    places_of_corners(cell, displacement, result);
    to_coefficients(result);
  }
  /// The transposes of these, to vectors stored by node and to columns of a matrix.
  template <typename Value>
  [[gnu::always_inline]] void scatter_to(const Cell &cell, Value (&moments)[corners], std::vector<Value> &to_nodes) const
  {
    give_to_masters(cell, moments);
    for (int a = 0; a < corners; ++a)
      to_nodes[cell.node[a]] += moments[a];
  }
  template <typename Matrix>
  [[gnu::always_inline]] void scatter(const Cell &cell, One (&moments)[corners], Matrix &&field) const
  {
    give_to_masters(cell, moments);
    for (int a = 0; a < corners; ++a)
    {
      double *vector = field.data() + field.outerStride() * cell.node[a];
      Vectors::store_one(vector, Vectors::load_one(vector) + moments[a]);
    }
  }

  /// One number for each tied particle, in the lanes of the batches.
  template <typename OfEntry>
  std::vector<SimdLanes> lanes_of(const OfEntry &of_entry) const
  {
    std::vector<SimdLanes> lanes(all_batches.size(), SimdLanes{});
    for (std::size_t k = 0; k < place_of.size(); ++k)
      lanes[place_of[k] / n_simd_lanes][place_of[k] % n_simd_lanes] = of_entry(k);
    return lanes;
  }
  int entry(std::size_t batch, int lane) const { return entry_of[batch][lane]; }
  /// Whether a lane is used, not a repetition.
  bool is_used(std::size_t batch, int lane) const
  {
    return place_of[entry_of[batch][lane]] == static_cast<int>(batch) * n_simd_lanes + lane;
  }

private:
  using Shares = std::array<std::array<double, corners>, corners>; // row a: shares of the masters in the motion of corner a

  template <typename Matrix>
  [[gnu::always_inline]] void at_corners(const Cell &cell, const Matrix &field, One (&values)[corners]) const
  {
    for (int a = 0; a < corners; ++a)
      values[a] = Vectors::load_one(field.data() + field.outerStride() * cell.node[a]);
    from_masters(cell, values);
  }
  [[gnu::always_inline]] void places_of_corners(const Cell &cell, const Eigen::Matrix3Xd &displacement, One (&values)[corners],
                                                double rate = 1.) const
  {
    at_corners(cell, displacement, values);
    for (int a = 0; a < corners; ++a)
      values[a] += rate * cell.place[a];
  }
  [[gnu::always_inline]] static void repeat_coefficients(One (&values)[corners], SimdPack (&result)[corners])
  {
    to_coefficients(values);
    for (int m = 0; m < corners; ++m)
      result[m] = Vectors::repeat(values[m]);
  }
  template <typename Value>
  [[gnu::always_inline]] void from_masters(const Cell &cell, Value (&values)[corners]) const
  {
    if (cell.hanging < 0)
      return;
    Value corner[corners] = {};
    for (int a = 0; a < corners; ++a)
      for (int m = 0; m < corners; ++m)
        corner[a] += shares[cell.hanging][a][m] * values[m];
    std::copy(corner, corner + corners, values);
  }
  /// Converts moments to values at the masters.
  template <typename Value>
  [[gnu::always_inline]] void give_to_masters(const Cell &cell, Value (&part)[corners]) const
  {
    to_corners(part);
    if (cell.hanging < 0)
      return;
    Value master[corners] = {};
    for (int a = 0; a < corners; ++a)
      for (int m = 0; m < corners; ++m)
        master[m] += shares[cell.hanging][a][m] * part[a];
    std::copy(master, master + corners, part);
  }
  Cell make_cell(const InterpolatedParticle &entry, const ParticleInterpolation &interpolation, const fem::Mesh &mesh,
                 const dem::Packing &packing);

  std::vector<Cell> all_cells;
  std::vector<Shares> shares; // for cells with hanging nodes
  std::vector<Batch> all_batches;
  std::vector<std::array<int, n_simd_lanes>> entry_of; // entry of each lane of each batch
  std::vector<int> place_of;                           // lane of each entry
};

/// A node that carries no tied particle may have no column of its own. Any other column can replace it, since its factor is
/// zero.
template <int dim>
typename CellBatches<dim>::Cell CellBatches<dim>::make_cell(const InterpolatedParticle &entry,
                                                            const ParticleInterpolation &interpolation, const fem::Mesh &mesh,
                                                            const dem::Packing &packing)
{
  Cell cell;
  const Eigen::Vector3d origin = Eigen::Map<const Eigen::Vector3d>(entry.origin.data());
  for (int a = 0; a < corners; ++a)
  {
    const Eigen::Vector3d place = origin + packing.shortest(mesh.nodes.col(mesh.cells(a, entry.cell)) - origin);
    cell.place[a] = Vectors::load_one(place.data());
  }
  const fem::CellMotion motion = fem::cell_motion(mesh, entry.cell);
  const int n = static_cast<int>(motion.nodes.size());
  cell.node.fill(entry.node[0]);
  for (int m = 0; m < n; ++m)
    if (const int column = interpolation.columns()[motion.nodes[m]]; column >= 0 && column < interpolation.n_carriers())
      cell.node[m] = column;
  Shares share{};
  bool hangs = false;
  for (int a = 0; a < corners; ++a)
    for (int m = 0; m < corners; ++m)
    {
      share[a][m] = m < n ? motion.share(a, m) : 0.;
      hangs = hangs || share[a][m] != (a == m);
    }
  if (hangs)
  {
    cell.hanging = static_cast<int>(shares.size());
    shares.push_back(share);
  }
  return cell;
}

template <int dim>
void CellBatches<dim>::assign(const ParticleInterpolation &interpolation, const fem::Mesh &mesh, const dem::Packing &packing)
{
  const std::vector<InterpolatedParticle> &list = interpolation.entries();
  std::vector<int> number(mesh.n_cells(), -1), count;
  all_cells.clear();
  shares.clear();
  for (const InterpolatedParticle &entry : list)
  {
    if (number[entry.cell] < 0)
    {
      number[entry.cell] = static_cast<int>(all_cells.size());
      all_cells.push_back(make_cell(entry, interpolation, mesh, packing));
      count.push_back(0);
    }
    ++count[number[entry.cell]];
    if (std::any_of(entry.blocked.begin(), entry.blocked.begin() + dim, [](bool blocked) { return blocked; }))
      all_cells[number[entry.cell]].blocked = true;
  }

  int n = 0;
  std::vector<int> next;
  for (std::size_t c = 0; c < count.size(); ++c)
  {
    next.push_back(n_simd_lanes * n);
    n += (count[c] + n_simd_lanes - 1) / n_simd_lanes;
    all_cells[c].end = n;
  }
  all_batches.assign(n, Batch());
  entry_of.resize(n);
  place_of.resize(list.size());
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    place_of[k] = next[number[list[k].cell]]++;
    const int lane = place_of[k] % n_simd_lanes;
    Batch &batch = all_batches[place_of[k] / n_simd_lanes];
    for (int l = lane; l < n_simd_lanes; ++l)
      entry_of[place_of[k] / n_simd_lanes][l] = static_cast<int>(k);
    for (int d = 0; d < dim; ++d)
      batch.xi[d][lane] = list[k].xi[d];
  }
  renumber(interpolation);
}

/// 1/m of the tied particles [1/kg], 0 in directions in which a particle is held.
template <int dim>
class InverseMass
{
public:
  void assign(const CellBatches<dim> &cells, const ParticleInterpolation &interpolation, const dem::Particles &particles)
  {
    using Vectors = PackedVectors<dim>;
    inverse_mass = cells.lanes_of([&](std::size_t k) { return 1. / particles.mass[interpolation.entries()[k].particle]; });
    of_pack.clear();
    if (std::none_of(cells.cells().begin(), cells.cells().end(), [](const auto &cell) { return cell.blocked; }))
      return;
    for (std::size_t k = 0; k < inverse_mass.size(); ++k)
      for (int p = 0; p < n_packs<dim>; ++p)
      {
        SimdPack pack = Vectors::spread(inverse_mass[k], p);
        for (int l = 0; l < Vectors::n_entries; ++l)
          for (int c = 0; c < dim; ++c)
            if (interpolation.entries()[cells.entry(k, Vectors::n_entries * p + l)].blocked[c])
              pack[Vectors::components * l + c] = 0.;
        of_pack.push_back(pack);
      }
  }
  [[gnu::always_inline]] void fetch_after(int batch) const { kerf::fetch_after(inverse_mass, batch); }
  /// Inverse masses of pack @p number of a batch.
  [[gnu::always_inline]] SimdPack of(int batch, int number, const typename CellBatches<dim>::Cell &cell) const
  {
    if (__builtin_expect(cell.blocked, false))
      return of_pack[n_packs<dim> * batch + number];
    return PackedVectors<dim>::spread(inverse_mass[batch], number);
  }

private:
  std::vector<SimdLanes> inverse_mass;
  std::vector<SimdPack> of_pack; // for cells with held particles only, which are few
};
} // namespace kerf
