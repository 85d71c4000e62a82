// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/corrector/recovered_gradient.h"
#include "coupler/method/constraint/corrector/strain_components.h"
#include "coupler/method/constraint/exchange/cell_batches.h"

#include <vector>

namespace kerf
{
/// Green's strain E_a = (F_a^T F_a - 1)/2 at the nodes of the entries and F of their cells, by the displacements of the window,
/// and the transpose: from what is given to E and F to the forces on the window's nodes. See Corrector. Theory (6.5), (6.8).
template <int dim>
class NodalStrain
{
public:
  using One = typename PackedVectors<dim>::One;
  using Strain = typename StrainComponents<dim>::Vector;
  typedef std::array<One, dim> Gradient; ///< by the axis along which is differentiated

  void assign(const RecoveredGradient &recovered, const ParticleInterpolation &interpolation, const CellBatches<dim> &cells);

  /// Strains and turns for these displacements of the window [m], nothing given to them.
  void gather(const Eigen::Matrix3Xd &displacement);
  /// At the entries' nodes.
  const std::vector<Strain> &strain() const { return of_nodes; }
  /// F of a cell: its column @p d.
  const One &turn(std::size_t cell, int d) const { return mean[cell][d]; }

  /// To be added to: what is given to E of the nodes and to F of a cell [N m].
  std::vector<Strain> &given() { return given_to_nodes; }
  void give_to_turn(std::size_t cell, int d, const One &value) { given_to_mean[cell][d] += value; }
  /// Adds to the forces [N] on the window's nodes.
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
  std::vector<int> number_of;   // of a cell of the mesh among the middles, or -1
  std::vector<int> member, end; // middles of each mean, one mean after the other: F of cells, then F_a of nodes
  std::vector<Gradient> of_middle, mean, given_to_middle, given_to_mean;
  std::vector<Strain> of_nodes, given_to_nodes;
  std::size_t n_cells = 0;
};
} // namespace kerf
