// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/q1_cell.h"

#include <Eigen/Core>
#include <array>

namespace kerf::fem
{
/// Reference geometry and weights of a cell at its Gauss points.
template <int dim>
struct CellGeometry
{
  static constexpr int n = q1::n_nodes<dim>;
  using Matrix = Eigen::Matrix<double, dim, dim>;
  using NodalGradients = Eigen::Matrix<double, n, dim>; ///< grad N_a, row a

  q1::NodalValues<dim> X; ///< [m]
  std::array<double, n> alpha;
  std::array<Matrix, n> inverse; ///< dxi/dX [1/m]
  std::array<double, n> weight;  ///< alpha JxW
  bool uniform = true;           ///< the same weight everywhere
  bool box = true;               ///< edges parallel to the axes

  CellGeometry(const q1::NodalValues<dim> &X, const std::array<double, n> &alpha);

  double total_weight() const;
  /// At Gauss point @p q [1/m].
  NodalGradients gradients(int q) const { return q1::shape_derivatives<dim>(q1::gauss_point<dim>(q)) * inverse[q]; }
  /// Weighted mean over the Gauss points [1/m].
  NodalGradients mean_gradients() const;
};
} // namespace kerf::fem
