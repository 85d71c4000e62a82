// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/cell_batch.h"
#include "fem_side/cell_geometry.h"
#include "fem_side/elastic_law.h"

namespace kerf::fem
{
/// Cells with one stress, that of the mean gradient (Flanagan & Belytschko 1981), and elastic hourglass control without a
/// parameter.
///
/// What the mean gradient H does not see are the amplitudes q of the monomials xi eta, ... of the displacement, measured from
/// the linear field H X. They are given the stiffness of an assumed strain (in the spirit of Belytschko & Bindeman 1993): the
/// strain that grows along xi_d is that of a bent sheet of the two other directions, so only its in-plane components count,
/// under plane stress; the strains of xi eta zeta are uniaxial. No transverse shear, no volume change that the rock could not
/// escape: neither locks. Strains are covariant components along the cell's edges at its centre, with finite strain the
/// deformed edges F J, so that rotations do not matter and forces are the derivative of an energy.
template <int dim>
class OnePointCells
{
public:
  static constexpr int n = q1::n_nodes<dim>;
  static constexpr int n_hourglass = n - 1 - dim; ///< monomials with two factors or more

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
  /// The mean gradient is computed from the positions in each call: cheaper than fetching it from memory.
  struct Mapped
  {
    BatchPositions<dim> positions;
    Lanes weight; ///< alpha/2^(dim^2 - dim), the rest of the volume comes from the positions
  };
  /// Weights that differ over the cell.
  struct Weighted
  {
    BatchPositions<dim> positions;
    Lanes gradient[n][dim]; ///< H = sum over monomials 1.. of c (x) gradient
    Lanes weight;           ///< sum of alpha JxW
  };
  /// Edges parallel to the axes, one weight.
  struct Box
  {
    Lanes mapping[dim]; ///< 2^-dim dxi_d/dx_d
    Lanes weight;       ///< sum of alpha JxW
  };

  BatchList<dim, Mapped> mapped;
  BatchList<dim, Weighted> weighted;
  BatchList<dim, Box> boxes;
};
} // namespace kerf::fem
