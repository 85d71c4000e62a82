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

/// The links of a rank cell by cell, several at once: the nodes of a cell are looked up and pushed once for all of its links.
template <int dim>
class LinkCells
{
public:
  static constexpr int corners = 1 << dim;

  /// Some links of one cell. Lanes that are left over repeat a link; the numbers of lanes_of() are zero there.
  struct Batch
  {
    LinkLanes N[corners]; ///< 0 for corners that a point does not need
    int particle[n_link_lanes];
  };
  /// The batches of a cell stand one after the other.
  struct Cell
  {
    std::array<int, corners> node; ///< columns of the window
    int end = 0;                   ///< of its batches
    double place[dim][corners];    ///< of the nodes in the reference configuration, not torn by periodic axes [m]

    /// Where the nodes are now: sum_a N_a of them is the point of the finite elements that a particle is tied to [m].
    [[gnu::always_inline]] void places(const Eigen::Matrix3Xd &displacement, double (&x)[dim][corners]) const
    {
      for (int c = 0; c < dim; ++c)
        for (int a = 0; a < corners; ++a)
          x[c][a] = place[c][a] + displacement(c, node[a]);
    }
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
  const std::vector<Batch> &batches() const { return all_batches; }
  /// A number of every link, in the lanes of the batches.
  template <typename OfLink>
  std::vector<LinkLanes> lanes_of(const OfLink &of_link) const
  {
    std::vector<LinkLanes> lanes(all_batches.size(), LinkLanes{});
    for (std::size_t k = 0; k < place_of.size(); ++k)
      lanes[place_of[k] / n_link_lanes][place_of[k] % n_link_lanes] = of_link(k);
    return lanes;
  }
  /// Of the links' particles, 0 in directions in which one cannot move [1/kg].
  std::vector<std::array<LinkLanes, dim>> inverse_masses(const OverlapLinks &links, const dem::Particles &particles) const
  {
    std::vector<std::array<LinkLanes, dim>> result(all_batches.size());
    for (int axis = 0; axis < dim; ++axis)
    {
      const std::vector<LinkLanes> lanes = lanes_of(
        [&](std::size_t k)
        {
          const OverlapLink &link = links.links()[k];
          return link.blocked[axis] ? 0. : 1. / particles.mass[link.particle];
        });
      for (std::size_t k = 0; k < lanes.size(); ++k)
        result[k][axis] = lanes[k];
    }
    return result;
  }
  int link(std::size_t batch, int lane) const { return link_of[batch][lane]; }
  /// Whether a lane has a link of its own.
  bool is_used(std::size_t batch, int lane) const
  {
    return place_of[link_of[batch][lane]] == static_cast<int>(batch) * n_link_lanes + lane;
  }

private:
  std::vector<Cell> all_cells;
  std::vector<Batch> all_batches;
  std::vector<std::array<int, n_link_lanes>> link_of; // of each batch
  std::vector<int> place_of;                          // of each link: lane of a batch
};

template <int dim>
void LinkCells<dim>::assign(const OverlapLinks &links, const fem::Mesh &mesh, const dem::Packing &packing)
{
  const std::vector<OverlapLink> &list = links.links();
  all_cells.clear();
  std::vector<std::vector<int>> cells_at(links.n_window()); // by the first node
  std::vector<int> cell_of(list.size()), count;
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    Cell cell;
    for (int a = 0; a < corners; ++a)
      cell.node[a] = list[k].node[a < list[k].n ? a : 0];
    std::vector<int> &near = cells_at[cell.node[0]];
    auto found = std::find_if(near.begin(), near.end(), [&](int c) { return all_cells[c].node == cell.node; });
    if (found == near.end())
    {
      const Eigen::Vector3d origin = Eigen::Map<const Eigen::Vector3d>(list[k].origin.data());
      for (int a = 0; a < corners; ++a)
      {
        const Eigen::Vector3d place = origin + packing.shortest(mesh.nodes.col(links.window()[cell.node[a]]) - origin);
        for (int c = 0; c < dim; ++c)
          cell.place[c][a] = place[c];
      }
      found = near.insert(near.end(), static_cast<int>(all_cells.size()));
      all_cells.push_back(cell);
      count.push_back(0);
    }
    cell_of[k] = *found;
    ++count[*found];
  }

  int n = 0;
  std::vector<int> next;
  for (std::size_t c = 0; c < count.size(); ++c)
  {
    next.push_back(n_link_lanes * n);
    n += (count[c] + n_link_lanes - 1) / n_link_lanes;
    all_cells[c].end = n;
  }
  all_batches.assign(n, Batch());
  link_of.resize(n);
  place_of.resize(list.size());
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    place_of[k] = next[cell_of[k]]++;
    const int lane = place_of[k] % n_link_lanes;
    const int number = place_of[k] / n_link_lanes;
    for (int l = lane; l < n_link_lanes; ++l)
      link_of[number][l] = static_cast<int>(k);
    for (int a = 0; a < list[k].n; ++a)
      all_batches[number].N[a][lane] = list[k].N[a];
  }
  renumber(links);
}

/// One component of vectors of three components a particle, of the particles of a batch.
[[gnu::always_inline]] inline LinkLanes load_lanes(const double *values, const int *particle, int component)
{
  return LinkLanes{values[3 * particle[0] + component], values[3 * particle[1] + component],
                   values[3 * particle[2] + component], values[3 * particle[3] + component]};
}
/// Subtracts from them; lanes that repeat a particle must be zero.
[[gnu::always_inline]] inline void subtract_lanes(double *values, const int *particle, int component, const LinkLanes &lanes)
{
  for (int l = 0; l < n_link_lanes; ++l)
    values[3 * particle[l] + component] -= lanes[l];
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
[[gnu::always_inline]] inline void subtract_vectors(double *values, const int *particle,
                                                    const std::array<LinkLanes, dim> &lanes)
{
  const LinkLanes even = __builtin_shufflevector(lanes[0], lanes[1], 0, 4, 2, 6),
                  odd = __builtin_shufflevector(lanes[0], lanes[1], 1, 5, 3, 7);
  const auto subtract = [&](int l, double x, double y) {
    *reinterpret_cast<LinkPair *>(values + 3 * particle[l]) -= LinkPair{x, y};
  };
  subtract(0, even[0], even[1]);
  subtract(1, odd[0], odd[1]);
  subtract(2, even[2], even[3]);
  subtract(3, odd[2], odd[3]);
  if constexpr (dim == 3)
    subtract_lanes(values, particle, 2, lanes[2]);
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
