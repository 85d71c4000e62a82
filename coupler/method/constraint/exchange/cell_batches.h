// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/exchange/particle_interpolation.h"
#include "coupler/method/constraint/exchange/simd.h"

#include <algorithm>
#include <array>
#include <vector>

namespace kerf
{
/// From values at the corners to the coefficients of the monomials 1, xi, eta, xi eta, ... (numbered by bits, as corners are).
template <typename Value, std::size_t corners>
[[gnu::always_inline]] inline void to_coefficients(Value (&field)[corners])
{
  for (std::size_t bit = 1; bit < corners; bit <<= 1)
    for (std::size_t a = 0; a < corners; ++a)
      if (a & bit)
        field[a] -= field[a ^ bit];
}
/// The transpose: from moments with the monomials to the parts of the corners.
template <typename Value, std::size_t corners>
[[gnu::always_inline]] inline void to_corners(Value (&moments)[corners])
{
  for (std::size_t bit = 1; bit < corners; bit <<= 1)
    for (std::size_t a = 0; a < corners; ++a)
      if (a & bit)
        moments[a ^ bit] -= moments[a];
}

/// The field with these coefficients at places xi in the cell.
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
/// The transpose: adds the moments of what is @p given there. Without loops, which would keep the moments in memory.
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

/// The entries of a rank cell by cell, several at once: the nodes of a cell are looked up and pushed once for all of its
/// entries. Fields in a cell are multilinear; the coefficients of their monomials need no shape functions, only an entry's
/// place in the cell.
template <int dim>
class CellBatches
{
public:
  static constexpr int corners = 1 << dim;
  using Vectors = PackedVectors<dim>;
  using One = typename Vectors::One;

  /// Some entries of one cell. Lanes that are left over repeat an entry; the numbers of lanes_of() are zero there.
  struct alignas(64) Batch
  {
    std::array<SimdLanes, dim> xi;
    std::ptrdiff_t begin[n_simd_lanes]; ///< of the particles' vectors in arrays of three components

    /// Of a pack.
    [[gnu::always_inline]] std::array<SimdPack, dim> place(int number) const
    {
      std::array<SimdPack, dim> result;
      for (int d = 0; d < dim; ++d)
        result[d] = Vectors::spread(xi[d], number);
      return result;
    }
    [[gnu::always_inline]] const std::ptrdiff_t *begins(int number) const { return begin + Vectors::interpolation * number; }
    int particle(int lane) const { return static_cast<int>(begin[lane] / 3); }
  };
  /// The batches of a cell stand one after the other.
  struct Cell
  {
    One place[corners];            ///< of the corners in the reference configuration, not torn by periodic axes [m]
    std::array<int, corners> node; ///< columns of the window; of a cell that hangs the masters
    int end = 0;                   ///< of its batches
    bool blocked = false;          ///< whether one of its entries has a direction in which it cannot move
    int hanging = -1;              ///< place among shares of masters
  };

  void assign(const ParticleInterpolation &interpolation, const fem::Mesh &mesh, const dem::Packing &packing);
  /// After particles have got other places in the arrays.
  void renumber(const ParticleInterpolation &interpolation)
  {
    for (std::size_t k = 0; k < all_batches.size(); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        all_batches[k].begin[l] = 3 * std::ptrdiff_t(interpolation.entries()[link_of[k][l]].particle);
  }

  const std::vector<Cell> &cells() const { return all_cells; }
  const std::vector<Batch> &batches() const { return all_batches; }
  /// Asks the memory for vectors of the particles of a batch that comes soon after @p batch; they are scattered.
  template <typename... Arrays>
  [[gnu::always_inline]] void fetch_after(int batch, const Arrays &...arrays) const
  {
    kerf::fetch_after(all_batches, batch);
    fetch_vectors_after(all_batches, batch, 6, arrays...);
  }

  /// Coefficients of a vector field of the window's nodes, columns of a matrix, for value_of() a pack.
  template <typename Matrix>
  [[gnu::always_inline]] void coefficients(const Cell &cell, const Matrix &field, SimdPack (&result)[corners]) const
  {
    One values[corners];
    at_corners(cell, field, values);
    repeat_coefficients(values, result);
  }
  /// Of the places of the finite elements now, which entries tie particles to [m]; or of these times @p rate, when the field is
  /// more than displacements times that.
  [[gnu::always_inline]] void places(const Cell &cell, const Eigen::Matrix3Xd &displacement, SimdPack (&result)[corners],
                                     double rate = 1.) const
  {
    One values[corners];
    places_of_corners(cell, displacement, values, rate);
    repeat_coefficients(values, result);
  }
  /// -chi of a pack [m]. @param period of the axes in which space repeats itself [m]
  template <bool periodic>
  [[gnu::always_inline]] static SimdPack gap(const SimdPack (&places)[corners], const std::array<SimdPack, dim> &xi,
                                             const SimdPack &position, const Eigen::Vector3d &period)
  {
    SimdPack result = value_of(places, xi) - position;
    if (periodic)
      wrap<dim>(result, period);
    return result;
  }
  /// The transpose: by its moments, @p sign times what the entries of a cell give goes to the vectors of the nodes.
  template <typename Matrix>
  [[gnu::always_inline]] void scatter(const Cell &cell, const SimdPack (&moments)[corners], double sign, Matrix &&field) const
  {
    One sums[corners];
    for (int m = 0; m < corners; ++m)
      sums[m] = sign * Vectors::fold(moments[m]);
    scatter(cell, sums, field);
  }

  /// The same once, not for every entry of a pack: of vectors that are kept by node, and of the places.
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
  /// The transposes: to what is kept by node, and to columns of a matrix.
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

  /// A number of every entry, in the lanes of the batches.
  template <typename OfLink>
  std::vector<SimdLanes> lanes_of(const OfLink &of_link) const
  {
    std::vector<SimdLanes> lanes(all_batches.size(), SimdLanes{});
    for (std::size_t k = 0; k < place_of.size(); ++k)
      lanes[place_of[k] / n_simd_lanes][place_of[k] % n_simd_lanes] = of_link(k);
    return lanes;
  }
  int entry(std::size_t batch, int lane) const { return link_of[batch][lane]; }
  /// Whether a lane has an entry of its own.
  bool is_used(std::size_t batch, int lane) const
  {
    return place_of[link_of[batch][lane]] == static_cast<int>(batch) * n_simd_lanes + lane;
  }

private:
  using Shares = std::array<std::array<double, corners>, corners>; // row a: of corner a

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
  /// From moments to what the masters get.
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
  std::vector<Shares> shares; // of the corners' motion that each master gives, of cells that hang
  std::vector<Batch> all_batches;
  std::vector<std::array<int, n_simd_lanes>> link_of; // of each batch
  std::vector<int> place_of;                          // of each entry: lane of a batch
};

/// Nodes that carry no entry may have no column, or one whose fields end before: any other will do, it is taken times zero.
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
  link_of.resize(n);
  place_of.resize(list.size());
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    place_of[k] = next[number[list[k].cell]]++;
    const int lane = place_of[k] % n_simd_lanes;
    Batch &batch = all_batches[place_of[k] / n_simd_lanes];
    for (int l = lane; l < n_simd_lanes; ++l)
      link_of[place_of[k] / n_simd_lanes][l] = static_cast<int>(k);
    for (int d = 0; d < dim; ++d)
      batch.xi[d][lane] = list[k].xi[d];
  }
  renumber(interpolation);
}

/// 1/m of the entries' particles, 0 in directions in which one cannot move [1/kg].
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
        for (int l = 0; l < Vectors::interpolation; ++l)
          for (int c = 0; c < dim; ++c)
            if (interpolation.entries()[cells.entry(k, Vectors::interpolation * p + l)].blocked[c])
              pack[Vectors::components * l + c] = 0.;
        of_pack.push_back(pack);
      }
  }
  [[gnu::always_inline]] void fetch_after(int batch) const { kerf::fetch_after(inverse_mass, batch); }
  /// Of pack @p number of a batch.
  [[gnu::always_inline]] SimdPack of(int batch, int number, const typename CellBatches<dim>::Cell &cell) const
  {
    if (__builtin_expect(cell.blocked, false))
      return of_pack[n_packs<dim> * batch + number];
    return PackedVectors<dim>::spread(inverse_mass[batch], number);
  }

private:
  std::vector<SimdLanes> inverse_mass;
  std::vector<SimdPack> of_pack; // when a cell is blocked, which few are
};
} // namespace kerf
