// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/corrector/recovered_gradient.h"
#include "coupler/method/constraint/corrector/strain_components.h"
#include "coupler/method/constraint/exchange/cell_batches.h"

#include <vector>

namespace kerf
{
/// Green's strain E_a = (F_a^T F_a - 1)/2 at the nodes that carry tied particles, and F in their cells, from the displacements
/// of the nodal window. Also the transpose: nodal forces from the values conjugate to E and F. See Corrector. Theory (6.5),
/// (6.8).
template <int dim>
class NodalStrain
{
public:
  using One = typename PackedVectors<dim>::One;
  using Strain = typename StrainComponents<dim>::Vector;
  typedef std::array<One, dim> Gradient; ///< one vector for each axis of differentiation

  void assign(const RecoveredGradient &recovered, const ParticleInterpolation &interpolation, const CellBatches<dim> &cells);

  /// Computes E and F for displacements of the nodal window [m] and sets their conjugate values to zero.
  void gather(const Eigen::Matrix3Xd &displacement);
  /// E at the nodes that carry tied particles.
  const std::vector<Strain> &strain() const { return of_nodes; }
  /// Column @p d of F of a cell.
  const One &turn(std::size_t cell, int d) const { return mean[cell][d]; }

  /// Values conjugate to E of the nodes and to F of a cell, to be added to [N m].
  std::vector<Strain> &given() { return given_to_nodes; }
  void give_to_turn(std::size_t cell, int d, const One &value) { given_to_mean[cell][d] += value; }
  /// Adds the nodal forces of the conjugate values to @p force on the nodal window [N].
  void scatter(Eigen::Matrix3Xd &force);

private:
  static constexpr int corners = CellBatches<dim>::corners;
  /// The gradient in the middle of a cell is sum_a u_a (x) share_a.
  struct Middle
  {
    std::array<int, corners> node;
    std::array<std::array<double, dim>, corners> share;
  };
  void add_mean(const std::vector<int> &cells, const RecoveredGradient &recovered, const std::vector<int> &column_of_node);

  std::vector<Middle> middles;
  std::vector<int> number_of;   // position of a mesh cell in middles, or -1
  std::vector<int> member, end; // the middles that each mean averages; the means are F of cells, then F_a of nodes
  std::vector<Gradient> of_middle, mean, given_to_middle, given_to_mean;
  std::vector<Strain> of_nodes, given_to_nodes;
  std::size_t n_cells = 0;
};
} // namespace kerf
