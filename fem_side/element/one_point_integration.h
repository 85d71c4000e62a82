// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_batch.h"
#include "fem_side/element/cell_geometry.h"
#include "fem_side/element/elastic_law.h"
#include "fem_side/element/find_patches.h"
#include "fem_side/element/node_stream.h"

namespace kerf::fem
{
/// One-point integration: one stress a cell, that of the mean gradient (Flanagan & Belytschko 1981), and elastic hourglass
/// control without a parameter.
///
/// The mean gradient H does not depend on the amplitudes q of the monomials xi eta, ... of the displacement, measured from the
/// linear field H X. They get the stiffness of an assumed strain, in the spirit of Belytschko & Bindeman (1993). The strain
/// that grows along xi_d is that of a bent sheet in the two other directions: only its in-plane components count, under plane
/// stress. The strains of xi eta zeta are uniaxial. There is no transverse shear and no constrained volume change, so the cell
/// does not lock in bending or when nearly incompressible. Strains are covariant components along the cell's edges at its
/// centre; with finite strain these are the deformed edges F J. So rotations do not matter and forces are the derivative of an
/// energy. Theory (2.6), (2.7), (2.11) to (2.13).
template <int dim>
class OnePointIntegration
{
public:
  static constexpr int n = q1::n_nodes<dim>;
  static constexpr int n_hourglass = n - 1 - dim; ///< monomials with two factors or more

  /// @p node: numbers of the nodes.
  void add_cell(const int (&node)[n], const CellGeometry<dim> &cell);
  /// After all cells, before their forces; @p node_dofs: first component of each node in the vectors below.
  void arrange(const std::vector<int> &node_dofs);
  bool is_arranged() const { return arranged; }

  /// f -= internal forces [N].
  template <typename Law>
  void subtract_forces(const Law &law, const double *u, double *f) const;
  /// Weighted stored energy [J].
  template <typename Law>
  double energy(const Law &law, const double *u) const;

private:
  using P = Patch<dim>;

  /// The mean gradient is computed from the positions in each call, which is cheaper than loading it from memory.
  struct Mapped
  {
    BatchPositions<dim, false> positions;
    Lanes weight; ///< alpha/2^(dim^2 - dim), the rest of the volume comes from the positions
  };
  /// Weights that differ over the cell.
  struct Weighted
  {
    BatchPositions<dim, false> positions;
    Lanes gradient[n][dim]; ///< H = sum over monomials 1.. of c (x) gradient
    Lanes weight;           ///< sum of alpha JxW
  };
  /// Edges parallel to the axes, one weight.
  struct Box
  {
    Lanes mapping[dim]; ///< 2^-dim dxi_d/dx_d
    Lanes weight;       ///< sum of alpha JxW
  };
  /// Weights have the factors of Mapped and Box.
  struct MappedPatch
  {
    PatchNodes<dim> position;
    Lanes weight[P::n_cells];

    [[gnu::always_inline]] Mapped operator[](const int cell) const
    {
      Mapped result;
#pragma GCC unroll 8
      for (int i = 0; i < dim; ++i)
      {
        Lanes c[n];
        read_cell<dim>(position, cell, i, c);
#pragma GCC unroll 8
        for (int m = 1; m < n; ++m)
          result.positions.x[m][i] = c[m];
      }
      result.weight = weight[cell];
      return result;
    }
  };
  struct BoxPatch
  {
    Lanes mapping[dim][2]; ///< of both layers in each direction
    Lanes weight[P::n_cells];

    [[gnu::always_inline]] Box operator[](const int cell) const
    {
      Box result;
#pragma GCC unroll 8
      for (int d = 0; d < dim; ++d)
        result.mapping[d] = mapping[d][cell >> d & 1];
      result.weight = weight[cell];
      return result;
    }
  };

  /// A cell that may become part of a patch.
  struct UniformCell
  {
    double mapping[dim];
    double box_weight, mapped_weight;
    bool box;
  };

  void add_patches(const std::vector<std::array<int, P::n_cells>> &patches, bool of_boxes);
  void add_single(int c);

  std::vector<NumberedCell<dim>> waiting; ///< for arrange()
  std::vector<UniformCell> waiting_uniform;
  bool arranged = false;

  // In the order of their use, on which the places of their nodes depend.
  PatchList<dim, MappedPatch> mapped_patches;
  PatchList<dim, BoxPatch> box_patches;
  BatchList<dim, Mapped, false> mapped;
  BatchList<dim, Weighted, false> weighted;
  BatchList<dim, Box, false> boxes;
  NodeStream<dim> nodes;
};
} // namespace kerf::fem
