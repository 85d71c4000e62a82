// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/elastic_law.h"
#include "fem_side/fem_side.h"

#include <Eigen/Dense>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
template <int dim, typename Law>
Eigen::Matrix3d first_piola(const Law &law, const Eigen::Matrix3d &gradient)
{
  double H[dim][dim], P[dim][dim];
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j)
      H[i][j] = gradient(i, j);
  law.template first_piola<dim>(H, P);
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j)
      result(i, j) = P[i][j];
  return result;
}

/// Strain of a stress by Hooke's law; in two dimensions plane strain of the in-plane part.
Eigen::Matrix3d hooke_strain(const ElasticLaw<FiniteStrain> &law, const int dim, const Eigen::Matrix3d &stress)
{
  const double share = law.lambda / (dim * law.lambda + 2. * law.mu);
  Eigen::Matrix3d strain = stress;
  for (int i = 0; i < dim; ++i)
    strain(i, i) -= share * stress.topLeftCorner(dim, dim).trace();
  return strain / (2. * law.mu);
}
} // namespace

InitialState initial_state(const Settings &settings)
{
  const int dim = settings.dim;
  const ElasticLaw<FiniteStrain> law(settings.material.lame_lambda(), settings.material.lame_mu());
  const ElasticLaw<SmallStrain> small(law.lambda, law.mu);
  const bool finite = settings.strain == Strain::finite;
  Eigen::Matrix3d target = Eigen::Matrix3d::Zero();
  target.topLeftCorner(dim, dim) = settings.initial_stress.topLeftCorner(dim, dim);
  InitialState state;
  if (target.norm() == 0.)
    return state;
  // Newton's method with Hooke's law as approximate tangent: each round reduces the error by a factor of about the strain.
  for (int round = 0; round < 100; ++round)
  {
    if (finite)
      state.first_piola = dim == 2 ? first_piola<2>(law, state.gradient) : first_piola<3>(law, state.gradient);
    else
      state.first_piola = dim == 2 ? first_piola<2>(small, state.gradient) : first_piola<3>(small, state.gradient);
    Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
    if (finite)
      F += state.gradient;
    const Eigen::Matrix3d missing = target - state.first_piola * F.transpose() / F.determinant();
    if (!missing.allFinite())
      break;
    if (missing.norm() < 1e-14 * settings.material.young)
      return state;
    state.gradient += hooke_strain(law, dim, 0.5 * (missing + missing.transpose()));
  }
  throw std::invalid_argument("initial stress: too large for the stiffness of the rock");
}
} // namespace kerf::fem
