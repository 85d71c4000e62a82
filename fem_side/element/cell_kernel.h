// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/full_integration.h"
#include "fem_side/element/one_point_integration.h"
#include "fem_side/fem_side.h"

#include <Eigen/Core>
#include <array>
#include <vector>

namespace kerf::fem
{
/// Internal forces of a set of weighted cells. It works on as many cells at a time as the host has SIMD lanes. Nodal vectors
/// are arrays with dim consecutive components a node.
template <int dim>
class CellKernel
{
public:
  static constexpr int n = q1::n_nodes<dim>; ///< nodes and Gauss points of a cell

  CellKernel(const Material &material, Strain strain, Integration integration);

  void clear();
  /// @p first_dofs: position of the first component of each node; @p X: reference positions [m]; @p alpha: weights at the Gauss
  /// points.
  void add_cell(const std::array<int, n> &first_dofs, const q1::NodalValues<dim> &X, const std::array<double, n> &alpha);
  int n_cells() const { return n_added; }

  /// f_a -= sum_q alpha_q P_q grad N_a JxW (total Lagrangian), [N].
  void subtract_internal_forces(const double *u, double *f) const;
  /// The same with the law linearised at the undeformed state: f -= K u.
  void subtract_linear_forces(const double *u, double *f) const;
  /// Weighted stored energy [J].
  double elastic_energy(const double *u) const;

private:
  using NodalArray = std::vector<double, Eigen::aligned_allocator<double>>;

  int number_of(int first_dof);
  void read_nodes(const double *u) const;
  template <typename Law>
  void subtract_forces(const Law &law, const double *u, double *f) const;
  template <typename Law>
  double energy(const Law &law, const double *u) const;

  StVenantKirchhoff finite_law;
  LinearisedLaw linear_law;
  Strain strain;
  Integration integration;
  FullIntegration<dim> full_integration;
  /// Each is arranged at its first use; cells that are added later go to a new one.
  mutable std::vector<OnePointIntegration<dim>> one_point_integration;
  int n_added = 0;

  // Nodes in the order of the cells, so that the nodes of a cell are close in memory.
  std::vector<int> node_dofs;     ///< first component in the caller's vectors
  std::vector<int> node_places;   ///< the inverse of node_dofs, by component / dim; -1: not a node of these cells
  mutable NodalArray node_values; ///< displacement and force of each node, see node_stride
};
} // namespace kerf::fem
