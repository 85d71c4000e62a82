// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/cell_geometry.h"

#include <Eigen/Dense>

namespace kerf::fem
{
template <int dim>
CellGeometry<dim>::CellGeometry(const q1::NodalValues<dim> &X, const std::array<double, n> &alpha) : X(X), alpha(alpha)
{
  const Matrix centre = X * q1::shape_derivatives<dim>(q1::Point<dim>::Zero());
  const Matrix diagonal = centre.diagonal().asDiagonal();
  // Vertices of a box are exact up to the last bits of their coordinates.
  const double tolerance = 1e-15 * X.cwiseAbs().maxCoeff();
  for (int q = 0; q < n; ++q)
  {
    const Matrix J = X * q1::shape_derivatives<dim>(q1::gauss_point<dim>(q));
    box = box && (J - diagonal).cwiseAbs().maxCoeff() <= tolerance;
    inverse[q] = J.inverse();
    weight[q] = alpha[q] * J.determinant();
    uniform = uniform && alpha[q] == alpha[0];
  }
  if (box)
    for (int q = 0; q < n; ++q)
    {
      inverse[q] = centre.diagonal().cwiseInverse().asDiagonal();
      weight[q] = alpha[q] * centre.diagonal().prod();
    }
}

template <int dim>
double CellGeometry<dim>::total_weight() const
{
  double sum = 0.;
  for (const double w : weight)
    sum += w;
  return sum;
}

template <int dim>
typename CellGeometry<dim>::NodalGradients CellGeometry<dim>::mean_gradients() const
{
  NodalGradients sum = NodalGradients::Zero();
  for (int q = 0; q < n; ++q)
    sum += weight[q] * gradients(q);
  return sum / total_weight();
}

template struct CellGeometry<2>;
template struct CellGeometry<3>;
} // namespace kerf::fem
