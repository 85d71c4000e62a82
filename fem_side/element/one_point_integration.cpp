// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/one_point_integration.h"

#include "fem_side/element/box_one_point.h"
#include "fem_side/element/shaped_one_point.h"

#include <algorithm>
#include <cmath>

namespace kerf::fem
{
namespace
{
/// Reads the monomials of a component.
template <int dim>
auto component_of(const Lanes (&c)[q1::n_nodes<dim>][dim])
{
  return [&c](const int i, Lanes(&component)[q1::n_nodes<dim>]) __attribute__((always_inline))
  {
#pragma GCC unroll 8
    for (int m = 0; m < q1::n_nodes<dim>; ++m)
      component[m] = c[m][i];
  };
}

/// Subtracts the internal forces of cells.
template <typename Cell, int dim, typename Law>
struct ForcesOfCell
{
  static constexpr int n = q1::n_nodes<dim>;
  const Law &law;

  template <typename Geometry, typename Read, typename Add>
  [[gnu::always_inline]] void add(const Geometry &geometry, const Read &read, const Add &add) const
  {
    const Cell cell(geometry);
    GradientTensor<dim> H, P;
    Hourglass<dim> q, s = {};
    cell.split(read, H, q);
    law.template first_piola<dim>(H, P);
    cell.hourglass(law, H, q, s, P);
    cell.subtract_forces(P, s, add);
  }
  template <typename Geometry>
  [[gnu::always_inline]] void operator()(const Geometry &geometry, const Lanes (&c)[n][dim], Lanes (&f)[n][dim]) const
  {
    add(
      geometry, component_of<dim>(c), [&](const int i, const Lanes(&r)[n]) __attribute__((always_inline)) {
#pragma GCC unroll 8
        for (int m = 0; m < n; ++m)
          f[m][i] = r[m];
      });
  }
};

template <typename Cell, int dim, typename Law>
struct EnergyOfCell
{
  static constexpr int n = q1::n_nodes<dim>;
  const Law &law;

  template <typename Geometry, typename Read>
  [[gnu::always_inline]] Lanes sum(const Geometry &geometry, const Read &read) const
  {
    const Cell cell(geometry);
    GradientTensor<dim> H, P = {};
    Hourglass<dim> q, s = {};
    cell.split(read, H, q);
    return cell.weight * (law.template energy_density<dim>(H) + cell.hourglass(law, H, q, s, P));
  }
  template <typename Geometry>
  [[gnu::always_inline]] Lanes operator()(const Geometry &geometry, const Lanes (&c)[n][dim]) const
  {
    return sum(geometry, component_of<dim>(c));
  }
};
} // namespace

template <int dim>
void OnePointIntegration<dim>::add_cell(const int (&node)[n], const CellGeometry<dim> &cell)
{
  const double total_weight = cell.total_weight();
  if (cell.uniform)
  {
    NumberedCell<dim> numbered;
    std::copy(node, node + n, numbered.node);
    numbered.X = cell.X;
    UniformCell uniform;
    for (int d = 0; d < dim; ++d)
      uniform.mapping[d] = cell.inverse[0](d, d) / n;
    uniform.box_weight = total_weight;
    uniform.mapped_weight = cell.alpha[0] * std::pow(1. / n, dim - 1);
    uniform.box = cell.box;
    waiting.push_back(numbered);
    waiting_uniform.push_back(uniform);
  }
  else
    weighted.add(node,
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
                       lanes.gradient[m][j][l] = sum / n;
                     }
                 });
}

template <int dim>
void OnePointIntegration<dim>::add_single(const int c)
{
  const UniformCell &cell = waiting_uniform[c];
  if (cell.box)
    boxes.add(waiting[c].node,
              [&](Box &lanes, const int l, const bool unused)
              {
                for (int d = 0; d < dim; ++d)
                  lanes.mapping[d][l] = cell.mapping[d];
                lanes.weight[l] = unused ? 0. : cell.box_weight;
              });
  else
    mapped.add(waiting[c].node,
               [&](Mapped &lanes, const int l, const bool unused)
               {
                 lanes.positions.set(l, waiting[c].X);
                 lanes.weight[l] = unused ? 0. : cell.mapped_weight;
               });
}

template <int dim>
void OnePointIntegration<dim>::add_patches(const std::vector<std::array<int, P::n_cells>> &patches, const bool of_boxes)
{
  for (const auto &patch : patches)
  {
    int node[P::n_nodes];
    const double *X[P::n_nodes];
    for (int j = 0; j < P::n_cells; ++j)
      for (int a = 0; a < n; ++a)
      {
        node[P::node(j, a)] = waiting[patch[j]].node[a];
        X[P::node(j, a)] = waiting[patch[j]].X.col(a).data();
      }
    if (of_boxes)
      box_patches.add(node,
                      [&](BoxPatch &lanes, const int l, const bool unused)
                      {
                        for (int d = 0; d < dim; ++d)
                          for (int side = 0; side < 2; ++side)
                            lanes.mapping[d][side][l] = waiting_uniform[patch[side << d]].mapping[d];
                        for (int j = 0; j < P::n_cells; ++j)
                          lanes.weight[j][l] = unused ? 0. : waiting_uniform[patch[j]].box_weight;
                      });
    else
      mapped_patches.add(node,
                         [&](MappedPatch &lanes, const int l, const bool unused)
                         {
                           for (int k = 0; k < P::n_nodes; ++k)
                             for (int i = 0; i < dim; ++i)
                               lanes.position[k][i][l] = X[k][i];
                           for (int j = 0; j < P::n_cells; ++j)
                             lanes.weight[j][l] = unused ? 0. : waiting_uniform[patch[j]].mapped_weight;
                         });
  }
}

template <int dim>
void OnePointIntegration<dim>::arrange(const std::vector<int> &node_dofs)
{
  if (arranged)
    return;
  arranged = true;
  std::vector<std::array<int, P::n_cells>> patches[2];
  for (const auto &patch : find_patches<dim>(waiting, static_cast<int>(node_dofs.size())))
  {
    bool box = true;
    for (const int cell : patch)
      box = box && waiting_uniform[cell].box;
    patches[box].push_back(patch);
  }
  std::vector<char> in_patch(waiting.size(), 0);
  for (const bool box : {false, true})
  {
    // The last batch is used only if it fills at least half of its lanes.
    const std::size_t rest = patches[box].size() % n_lanes;
    if (2 * rest < n_lanes)
      patches[box].resize(patches[box].size() - rest);
    for (const auto &patch : patches[box])
      for (const int cell : patch)
        in_patch[cell] = 1;
    add_patches(patches[box], box);
  }
  for (std::size_t c = 0; c < waiting.size(); ++c)
    if (!in_patch[c])
      add_single(static_cast<int>(c));
  waiting = {};
  waiting_uniform = {};

  std::vector<typename NodeStream<dim>::Part> parts;
  const auto add_parts = [&parts](auto &list)
  {
    for (auto &batch : list.batches)
      parts.push_back({&batch.offset[0][0], static_cast<int>(sizeof(batch.offset) / sizeof(int))});
  };
  add_parts(mapped_patches);
  add_parts(box_patches);
  add_parts(mapped);
  add_parts(weighted);
  add_parts(boxes);
  nodes.plan(parts, node_dofs);
}

template <int dim>
template <typename Law>
void OnePointIntegration<dim>::subtract_forces(const Law &law, const double *u, double *f) const
{
  int batch = 0;
  const auto before = [&] { nodes.read(batch, u); };
  const auto after = [&] { nodes.write(batch++, f); };
  const auto add = [&](const auto &list, const auto &law_of)
  { list.add_forces(nodes.displacements(u), nodes.forces(f), law_of, before, after); };
  add(mapped_patches, ForcesOfCell<ShapedOnePoint<dim, true>, dim, Law>{law});
  add(box_patches, ForcesOfCell<BoxOnePoint<dim>, dim, Law>{law});
  add(mapped, ForcesOfCell<ShapedOnePoint<dim, true>, dim, Law>{law});
  add(weighted, ForcesOfCell<ShapedOnePoint<dim, false>, dim, Law>{law});
  add(boxes, ForcesOfCell<BoxOnePoint<dim>, dim, Law>{law});
}

template <int dim>
template <typename Law>
double OnePointIntegration<dim>::energy(const Law &law, const double *u) const
{
  int batch = 0;
  const auto before = [&] { nodes.read(batch++, u); };
  const auto sum = [&](const auto &list, const auto &law_of) { return list.energy(nodes.displacements(u), law_of, before); };
  double result = sum(mapped_patches, EnergyOfCell<ShapedOnePoint<dim, true>, dim, Law>{law});
  result += sum(box_patches, EnergyOfCell<BoxOnePoint<dim>, dim, Law>{law});
  result += sum(mapped, EnergyOfCell<ShapedOnePoint<dim, true>, dim, Law>{law});
  result += sum(weighted, EnergyOfCell<ShapedOnePoint<dim, false>, dim, Law>{law});
  result += sum(boxes, EnergyOfCell<BoxOnePoint<dim>, dim, Law>{law});
  return result;
}

template class OnePointIntegration<2>;
template class OnePointIntegration<3>;
template void OnePointIntegration<2>::subtract_forces(const StVenantKirchhoff &, const double *, double *) const;
template void OnePointIntegration<3>::subtract_forces(const StVenantKirchhoff &, const double *, double *) const;
template void OnePointIntegration<2>::subtract_forces(const LinearisedLaw &, const double *, double *) const;
template void OnePointIntegration<3>::subtract_forces(const LinearisedLaw &, const double *, double *) const;
template double OnePointIntegration<2>::energy(const StVenantKirchhoff &, const double *) const;
template double OnePointIntegration<3>::energy(const StVenantKirchhoff &, const double *) const;
template double OnePointIntegration<2>::energy(const LinearisedLaw &, const double *) const;
template double OnePointIntegration<3>::energy(const LinearisedLaw &, const double *) const;
} // namespace kerf::fem
