// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/overlap_links.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace kerf
{
/// Numbers of several links side by side.
constexpr int n_link_lanes = 4;
typedef double LinkLanes __attribute__((vector_size(n_link_lanes * sizeof(double))));

inline double sum_of(const LinkLanes &v)
{
  return (v[0] + v[1]) + (v[2] + v[3]);
}

/// sum_of() of each, four at a time.
template <std::size_t n>
std::array<double, n> sums_of(const LinkLanes (&v)[n])
{
  static_assert(n % 4 == 0 && n_link_lanes == 4);
  std::array<double, n> sums;
  for (std::size_t k = 0; k < n; k += 4)
  {
    const auto pairs = [&](std::size_t i) -> LinkLanes
    { return __builtin_shufflevector(v[i], v[i + 1], 0, 4, 2, 6) + __builtin_shufflevector(v[i], v[i + 1], 1, 5, 3, 7); };
    const LinkLanes first = pairs(k), second = pairs(k + 2);
    const LinkLanes four =
      __builtin_shufflevector(first, second, 0, 1, 4, 5) + __builtin_shufflevector(first, second, 2, 3, 6, 7);
    for (int l = 0; l < 4; ++l)
      sums[k + l] = four[l];
  }
  return sums;
}

/// From values at the corners to the coefficients of the monomials 1, xi, eta, xi eta, ... (numbered by bits, as corners are).
template <std::size_t corners>
void to_coefficients(double (&field)[corners])
{
  for (std::size_t bit = 1; bit < corners; bit <<= 1)
    for (std::size_t a = 0; a < corners; ++a)
      if (a & bit)
        field[a] -= field[a ^ bit];
}
/// The transpose: from moments with the monomials to the parts of the corners.
template <std::size_t corners>
void to_corners(std::array<double, corners> &moments)
{
  for (std::size_t bit = 1; bit < corners; bit <<= 1)
    for (std::size_t a = 0; a < corners; ++a)
      if (a & bit)
        moments[a ^ bit] -= moments[a];
}

/// The links of a rank cell by cell, several at once: the nodes of a cell are looked up and pushed once for all of its links.
/// Fields in a cell are multilinear; the coefficients of their monomials need no shape functions, only a link's place in the
/// cell.
template <int dim>
class LinkCells
{
public:
  static constexpr int corners = 1 << dim;
  using Monomials = std::array<LinkLanes, corners>;

  /// Some links of one cell. Lanes that are left over repeat a link; the numbers of lanes_of() are zero there.
  struct Batch
  {
    LinkLanes xi[dim];
    int particle[n_link_lanes];

    [[gnu::always_inline]] Monomials monomials() const
    {
      Monomials result;
      result[0] = LinkLanes{} + 1.;
      for (int d = 0; d < dim; ++d)
        for (int m = 0; m < 1 << d; ++m)
          result[(1 << d) + m] = m == 0 ? xi[d] : xi[d] * result[m];
      return result;
    }
  };
  /// The batches of a cell stand one after the other.
  struct Cell
  {
    std::array<int, corners> node; ///< columns of the window; of a cell that hangs the masters
    int end = 0;                   ///< of its batches
    bool blocked = false;          ///< whether one of its links has a direction in which it cannot move
    int hanging = -1;              ///< place among shares of masters
    double place[dim][corners];    ///< of the corners in the reference configuration, not torn by periodic axes [m]
  };

  void assign(const OverlapLinks &links, const fem::Mesh &mesh, const dem::Packing &packing);
  /// After particles have got other places in the arrays.
  void renumber(const OverlapLinks &links)
  {
    for (std::size_t k = 0; k < all_batches.size(); ++k)
      for (int l = 0; l < n_link_lanes; ++l)
        all_batches[k].particle[l] = links.links()[link_of[k][l]].particle;
  }

  const std::vector<Cell> &cells() const { return all_cells; }
  /// Asks the memory for vectors of the particles of a batch that comes soon after @p batch; they are scattered.
  template <typename... Vectors>
  [[gnu::always_inline]] void fetch_after(int batch, const Vectors &...vectors) const
  {
    constexpr int distance = 6;
    if (batch + distance < static_cast<int>(all_batches.size()))
      for (const int i : all_batches[batch + distance].particle)
        (__builtin_prefetch(vectors.data() + 3 * i), ...);
  }
  const std::vector<Batch> &batches() const { return all_batches; }
  int most_batches() const { return longest; } ///< of a cell

  /// Coefficients of rows of a field of the window's nodes: sum_m coefficient_m monomial_m is its value at a link.
  template <std::size_t n, typename Field>
  [[gnu::always_inline]] void coefficients(const Cell &cell, const Field &field, double (&result)[n][corners]) const
  {
    for (std::size_t c = 0; c < n; ++c)
    {
      at_corners(cell, field, c, result[c]);
      to_coefficients(result[c]);
    }
  }
  /// Of the places of the finite elements now, which links tie particles to [m].
  [[gnu::always_inline]] void places(const Cell &cell, const Eigen::Matrix3Xd &displacement,
                                     double (&result)[dim][corners]) const
  {
    for (int c = 0; c < dim; ++c)
    {
      at_corners(cell, displacement, c, result[c]);
      for (int a = 0; a < corners; ++a)
        result[c][a] += cell.place[c][a];
      to_coefficients(result[c]);
    }
  }
  /// The transpose: what links give, given(batch), goes to the nodes' values in a row of a field of the window. A loop of
  /// its own for each row: its sums stay in registers. @p begin: first batch of the cell.
  template <typename Given, typename Field>
  [[gnu::always_inline]] void scatter(const Cell &cell, int begin, const Given &given, int row, Field &field) const
  {
    LinkLanes moments[corners] = {};
    for (int k = begin; k < cell.end; ++k)
    {
      const LinkLanes value = given(k);
      const Monomials monomials = all_batches[k].monomials();
      moments[0] += value;
      for (int m = 1; m < corners; ++m)
        moments[m] += monomials[m] * value;
    }
    std::array<double, corners> part = sums_of(moments);
    to_corners(part);
    if (cell.hanging >= 0)
    {
      Eigen::Map<CornerValues> values(part.data());
      values = (shares[cell.hanging].transpose() * values).eval();
    }
    for (int a = 0; a < corners; ++a)
      field(row, cell.node[a]) += part[a];
  }

  /// A number of every link, in the lanes of the batches.
  template <typename OfLink>
  std::vector<LinkLanes> lanes_of(const OfLink &of_link) const
  {
    std::vector<LinkLanes> lanes(all_batches.size(), LinkLanes{});
    for (std::size_t k = 0; k < place_of.size(); ++k)
      lanes[place_of[k] / n_link_lanes][place_of[k] % n_link_lanes] = of_link(k);
    return lanes;
  }
  int link(std::size_t batch, int lane) const { return link_of[batch][lane]; }
  /// Whether a lane has a link of its own.
  bool is_used(std::size_t batch, int lane) const
  {
    return place_of[link_of[batch][lane]] == static_cast<int>(batch) * n_link_lanes + lane;
  }

private:
  using CornerValues = Eigen::Matrix<double, corners, 1>;
  using Shares = Eigen::Matrix<double, corners, corners>; // row a: of corner a

  template <typename Field>
  [[gnu::always_inline]] void at_corners(const Cell &cell, const Field &field, int row, double (&result)[corners]) const
  {
    for (int a = 0; a < corners; ++a)
      result[a] = field(row, cell.node[a]);
    if (cell.hanging >= 0)
    {
      Eigen::Map<CornerValues> values(result);
      values = (shares[cell.hanging] * values).eval();
    }
  }
  Cell make_cell(const OverlapLink &link, const OverlapLinks &links, const fem::Mesh &mesh, const dem::Packing &packing);

  std::vector<Cell> all_cells;
  std::vector<Shares> shares; // of the corners' motion that each master gives, of cells that hang
  std::vector<Batch> all_batches;
  std::vector<std::array<int, n_link_lanes>> link_of; // of each batch
  std::vector<int> place_of;                          // of each link: lane of a batch
  int longest = 0;
};

/// Nodes that carry no link may have no column, or one whose fields end before: any other will do, it is taken times zero.
template <int dim>
typename LinkCells<dim>::Cell LinkCells<dim>::make_cell(const OverlapLink &link, const OverlapLinks &links,
                                                        const fem::Mesh &mesh, const dem::Packing &packing)
{
  Cell cell;
  const Eigen::Vector3d origin = Eigen::Map<const Eigen::Vector3d>(link.origin.data());
  for (int a = 0; a < corners; ++a)
  {
    const Eigen::Vector3d place = origin + packing.shortest(mesh.nodes.col(mesh.cells(a, link.cell)) - origin);
    for (int c = 0; c < dim; ++c)
      cell.place[c][a] = place[c];
  }
  const fem::CellMotion motion = fem::cell_motion(mesh, link.cell);
  const int n = static_cast<int>(motion.nodes.size());
  cell.node.fill(link.node[0]);
  for (int m = 0; m < n; ++m)
    if (const int column = links.columns()[motion.nodes[m]]; column >= 0 && column < links.n_carriers())
      cell.node[m] = column;
  Shares share = Shares::Zero();
  share.leftCols(n) = motion.share;
  if (share != Shares::Identity())
  {
    cell.hanging = static_cast<int>(shares.size());
    shares.push_back(share);
  }
  return cell;
}

template <int dim>
void LinkCells<dim>::assign(const OverlapLinks &links, const fem::Mesh &mesh, const dem::Packing &packing)
{
  const std::vector<OverlapLink> &list = links.links();
  std::vector<int> number(mesh.n_cells(), -1), count;
  all_cells.clear();
  shares.clear();
  for (const OverlapLink &link : list)
  {
    if (number[link.cell] < 0)
    {
      number[link.cell] = static_cast<int>(all_cells.size());
      all_cells.push_back(make_cell(link, links, mesh, packing));
      count.push_back(0);
    }
    ++count[number[link.cell]];
    if (std::any_of(link.blocked.begin(), link.blocked.begin() + dim, [](bool blocked) { return blocked; }))
      all_cells[number[link.cell]].blocked = true;
  }

  int n = 0;
  longest = 0;
  std::vector<int> next;
  for (std::size_t c = 0; c < count.size(); ++c)
  {
    next.push_back(n_link_lanes * n);
    const int batches = (count[c] + n_link_lanes - 1) / n_link_lanes;
    longest = std::max(longest, batches);
    n += batches;
    all_cells[c].end = n;
  }
  all_batches.assign(n, Batch());
  link_of.resize(n);
  place_of.resize(list.size());
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    place_of[k] = next[number[list[k].cell]]++;
    const int lane = place_of[k] % n_link_lanes;
    Batch &batch = all_batches[place_of[k] / n_link_lanes];
    for (int l = lane; l < n_link_lanes; ++l)
      link_of[place_of[k] / n_link_lanes][l] = static_cast<int>(k);
    for (int d = 0; d < dim; ++d)
      batch.xi[d][lane] = list[k].xi[d];
  }
  renumber(links);
}

/// A field at the links of a batch.
template <std::size_t corners>
[[gnu::always_inline]] inline LinkLanes value_of(const double (&coefficient)[corners],
                                                 const std::array<LinkLanes, corners> &monomials)
{
  LinkLanes value = monomials[1] * coefficient[1] + coefficient[0];
  for (std::size_t m = 2; m < corners; ++m)
    value += monomials[m] * coefficient[m];
  return value;
}

/// 1/m of the links' particles, 0 in directions in which one cannot move [1/kg].
template <int dim>
class Mobility
{
public:
  void assign(const LinkCells<dim> &cells, const OverlapLinks &links, const dem::Particles &particles)
  {
    inverse_mass = cells.lanes_of([&](std::size_t k) { return 1. / particles.mass[links.links()[k].particle]; });
    for (int axis = 0; axis < dim; ++axis)
      is_free[axis] = cells.lanes_of([&](std::size_t k) { return links.links()[k].blocked[axis] ? 0. : 1.; });
  }
  [[gnu::always_inline]] std::array<LinkLanes, dim> of(int batch, const typename LinkCells<dim>::Cell &cell) const
  {
    std::array<LinkLanes, dim> result;
    result.fill(inverse_mass[batch]);
    if (cell.blocked) // few are, the rest is not read
      for (int c = 0; c < dim; ++c)
        result[c] *= is_free[c][batch];
    return result;
  }

private:
  std::vector<LinkLanes> inverse_mass, is_free[dim];
};

/// One component of vectors of three components a particle, of the particles of a batch.
[[gnu::always_inline]] inline LinkLanes load_lanes(const double *values, const int *particle, int component)
{
  return LinkLanes{values[3 * particle[0] + component], values[3 * particle[1] + component],
                   values[3 * particle[2] + component], values[3 * particle[3] + component]};
}
/// Adds to them; lanes that repeat a particle must be zero.
[[gnu::always_inline]] inline void add_lanes(double *values, const int *particle, int component, const LinkLanes &lanes)
{
  for (int l = 0; l < n_link_lanes; ++l)
    values[3 * particle[l] + component] += lanes[l];
}
/// The first two components of a particle, at once.
typedef double LinkPair __attribute__((vector_size(2 * sizeof(double)), aligned(alignof(double))));
/// All components that move in @p dim dimensions.
template <int dim>
[[gnu::always_inline]] inline std::array<LinkLanes, dim> load_vectors(const double *values, const int *particle)
{
  const auto pair = [&](int l) -> LinkPair { return *reinterpret_cast<const LinkPair *>(values + 3 * particle[l]); };
  const LinkLanes even = __builtin_shufflevector(pair(0), pair(2), 0, 1, 2, 3),
                  odd = __builtin_shufflevector(pair(1), pair(3), 0, 1, 2, 3);
  std::array<LinkLanes, dim> result;
  result[0] = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
  result[1] = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
  if constexpr (dim == 3)
    result[2] = load_lanes(values, particle, 2);
  return result;
}
template <int dim>
[[gnu::always_inline]] inline void add_vectors(double *values, const int *particle, const std::array<LinkLanes, dim> &lanes)
{
  const LinkLanes even = __builtin_shufflevector(lanes[0], lanes[1], 0, 4, 2, 6),
                  odd = __builtin_shufflevector(lanes[0], lanes[1], 1, 5, 3, 7);
  const auto add = [&](int l, double x, double y) {
    *reinterpret_cast<LinkPair *>(values + 3 * particle[l]) += LinkPair{x, y};
  };
  add(0, even[0], even[1]);
  add(1, odd[0], odd[1]);
  add(2, even[2], even[3]);
  add(3, odd[2], odd[3]);
  if constexpr (dim == 3)
    add_lanes(values, particle, 2, lanes[2]);
}
/// couple += chi x force, of the axes that a body turns about.
[[gnu::always_inline]] inline void add_moments(const std::array<LinkLanes, 2> &chi, const std::array<LinkLanes, 2> &force,
                                               LinkLanes (&couple)[3])
{
  couple[2] += chi[0] * force[1] - chi[1] * force[0];
}
[[gnu::always_inline]] inline void add_moments(const std::array<LinkLanes, 3> &chi, const std::array<LinkLanes, 3> &force,
                                               LinkLanes (&couple)[3])
{
  couple[0] += chi[1] * force[2] - chi[2] * force[1];
  couple[1] += chi[2] * force[0] - chi[0] * force[2];
  couple[2] += chi[0] * force[1] - chi[1] * force[0];
}
/// The nearest image, where space repeats itself after @p period [m].
inline void wrap_lanes(LinkLanes &chi, double period)
{
  for (int l = 0; l < n_link_lanes; ++l)
    chi[l] -= period * std::round(chi[l] / period);
}
} // namespace kerf
