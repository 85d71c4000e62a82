// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_batch.h"
#include "fem_side/element/cell_geometry.h"
#include "fem_side/element/elastic_law.h"

namespace kerf::fem
{
/// Full integration: cells integrated at all Gauss points. With @p mean_dilatation the volumetric strain is replaced by its
/// weighted mean over the cell (B-bar, Hughes 1980), which does not lock when the rock is nearly incompressible. With Green's
/// strain the mean is that of tr E, so that forces are still the derivative of an energy.
template <int dim>
class FullIntegration
{
public:
  static constexpr int n = q1::n_nodes<dim>;

  explicit FullIntegration(const bool mean_dilatation) : mean_dilatation(mean_dilatation) {}

  void clear();
  /// @p offset: places of the nodes in the arrays below.
  void add_cell(const int (&offset)[n], const CellGeometry<dim> &cell);

  /// f += internal forces [N]. @p u, @p f: first components of the first node, nodes at node_stride<dim>.
  template <typename Law>
  void add_forces(const Law &law, const double *u, double *f) const;
  /// Weighted stored energy [J].
  template <typename Law>
  double energy(const Law &law, const double *u) const;

private:
  /// The mapping is computed from the positions in each call, which is cheaper than loading it from memory.
  struct Mapped
  {
    BatchPositions<dim> positions;
    Lanes weight[n]; ///< alpha/2^(dim^2), the rest of JxW comes from the positions
  };
  struct UniformMapped
  {
    BatchPositions<dim> positions;
    Lanes weight;
  };
  /// Edges parallel to the axes: the diagonal of the mapping.
  struct Box
  {
    Lanes mapping[dim]; ///< 2^-dim dxi_d/dx_d
    Lanes weight[n];    ///< alpha JxW
  };
  struct UniformBox
  {
    Lanes mapping[dim];
    Lanes weight;
  };

  template <bool mean, typename Law>
  void add_forces_of(const Law &law, const double *u, double *f) const;
  template <bool mean, typename Law>
  double energy_of(const Law &law, const double *u) const;

  bool mean_dilatation;
  BatchList<dim, Mapped> mapped;
  BatchList<dim, UniformMapped> uniform_mapped;
  BatchList<dim, Box> boxes;
  BatchList<dim, UniformBox> uniform_boxes;
};
} // namespace kerf::fem
