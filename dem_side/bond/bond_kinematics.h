// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>

namespace kerf::dem
{
/// Moment of inertia of a particle over m r^2 [-]: a disc in two dimensions, else a sphere.
constexpr double inertia_factor(int dim)
{
  return dim == 2 ? 0.5 : 0.4;
}

/// Number of rotations of a particle.
template <int dim>
constexpr int rotations = dim == 2 ? 1 : 3;
/// Number of translations and rotations of a particle.
template <int dim>
constexpr int particle_dofs = dim + rotations<dim>;

/// Displacement of the point at @p lever * n from a centre by a unit rotation about each axis.
template <int dim>
Eigen::Matrix<double, dim, rotations<dim>> from_rotation(const Eigen::Matrix<double, dim, 1> &n, double lever)
{
  Eigen::Matrix<double, dim, rotations<dim>> matrix;
  if constexpr (dim == 2)
    matrix << -n[1], n[0];
  else
    matrix << 0., n[2], -n[1], -n[2], 0., n[0], n[1], -n[0], 0.;
  return lever * matrix;
}

/// Relative displacement at the contact point from the degrees of freedom of i and then of j.
/// @param n unit vector from i to j. @param lever_i, lever_j distance of the contact point from the centres [m]
template <int dim>
Eigen::Matrix<double, dim, 2 * particle_dofs<dim>> relative_displacement(const Eigen::Matrix<double, dim, 1> &n, double lever_i,
                                                                         double lever_j)
{
  Eigen::Matrix<double, dim, 2 * particle_dofs<dim>> matrix;
  matrix.template leftCols<dim>() = -Eigen::Matrix<double, dim, dim>::Identity();
  matrix.template middleCols<rotations<dim>>(dim) = -from_rotation<dim>(n, lever_i);
  matrix.template middleCols<dim>(particle_dofs<dim>).setIdentity();
  matrix.template rightCols<rotations<dim>>() = -from_rotation<dim>(n, lever_j);
  return matrix;
}
} // namespace kerf::dem
