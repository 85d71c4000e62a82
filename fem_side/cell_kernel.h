// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/q1_cell.h"
#include "fem_side/st_venant_kirchhoff.h"

#include <array>
#include <vector>

namespace kerf::fem
{
#if defined(__AVX512F__)
inline constexpr int n_lanes = 8;
#elif defined(__AVX__)
inline constexpr int n_lanes = 4;
#else
inline constexpr int n_lanes = 2;
#endif

/// As many doubles as one instruction of the host works on. The element library may come with one lane only, so that its own
/// vectorised evaluation cannot be relied on.
typedef double Lanes __attribute__((vector_size(n_lanes * sizeof(double))));

/// Internal forces of a set of weighted cells, as many cells at a time as the host has lanes. Nodal vectors are arrays with dim
/// consecutive components a node.
template <int dim>
class CellKernel
{
public:
  static constexpr int n = q1::n_nodes<dim>; ///< nodes and Gauss points of a cell

  explicit CellKernel(const StVenantKirchhoff &law) : law(law), linear_law{law.lambda, law.mu} {}

  void clear();
  /// @p first_dofs: position of the first component of each node; @p X: reference positions [m]; @p alpha: weights at the Gauss
  /// points.
  void add_cell(const std::array<int, n> &first_dofs, const q1::NodalValues<dim> &X, const std::array<double, n> &alpha);
  int n_cells() const { return n_filled; }

  /// f_a -= sum_q alpha_q P_q grad N_a JxW (total Lagrangian), [N].
  void subtract_internal_forces(const double *u, double *f) const { loop(law, u, f); }
  /// The same with the law linearised at the undeformed state: f -= K u.
  void subtract_linear_forces(const double *u, double *f) const { loop(linear_law, u, f); }
  /// Weighted stored energy [J].
  double elastic_energy(const double *u) const;

private:
  struct Batch
  {
    Lanes mapping[n][dim][dim]; ///< 2^-dim dxi_i/dX_j at the Gauss points; the factor belongs to q1::nodes_to_monomials()
    Lanes weight[n];            ///< alpha JxW
    int first_dof[n][n_lanes];
  };

  template <typename Law>
  void loop(const Law &law, const double *u, double *f) const;
  static void displacement_gradient(const Batch &batch, const int q, const Lanes (&monomials)[n][dim], Lanes (&H)[dim][dim]);

  StVenantKirchhoff law;
  LinearisedLaw linear_law;
  std::vector<Batch> batches;
  int n_filled = 0;
};
} // namespace kerf::fem
