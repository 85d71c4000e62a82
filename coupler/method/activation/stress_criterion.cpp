// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/stress_criterion.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>

namespace kerf
{
namespace
{
/// Smallest and largest principal stress.
std::array<double, 2> principal_range(const Eigen::Matrix<double, 6, 1> &sigma)
{
  if (sigma[3] == 0. && sigma[4] == 0.) // closed form in the plane, since every cell is checked every few steps
  {
    const double middle = 0.5 * (sigma[0] + sigma[1]),
                 radius = std::sqrt(0.25 * std::pow(sigma[0] - sigma[1], 2) + sigma[5] * sigma[5]);
    return {std::min(middle - radius, sigma[2]), std::max(middle + radius, sigma[2])};
  }
  Eigen::Matrix3d tensor;
  tensor << sigma[0], sigma[5], sigma[4], sigma[5], sigma[1], sigma[3], sigma[4], sigma[3], sigma[2];
  // Not computeDirect(): its closed form is accurate to half of the digits only.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(tensor, Eigen::EigenvaluesOnly);
  return {solver.eigenvalues()[0], solver.eigenvalues()[2]};
}
} // namespace

double stress_measure(Criterion criterion, const Eigen::Matrix<double, 6, 1> &sigma, double tensile_strength,
                      double compressive_strength)
{
  if (criterion == Criterion::von_mises)
  {
    const double a = sigma[0] - sigma[1], b = sigma[1] - sigma[2], c = sigma[2] - sigma[0];
    return std::sqrt(0.5 * (a * a + b * b + c * c) + 3. * sigma.tail<3>().squaredNorm());
  }
  if (criterion == Criterion::drucker_prager)
  {
    const double ratio = tensile_strength / compressive_strength;
    const double von_mises = stress_measure(Criterion::von_mises, sigma, 0., 0.); // sqrt(3 J_2)
    return 0.5 * ((1. + ratio) * von_mises + (1. - ratio) * sigma.head<3>().sum());
  }
  const auto [smallest, largest] = principal_range(sigma);
  if (criterion == Criterion::maximum_principal)
    return largest;
  return largest - smallest * tensile_strength / compressive_strength;
}

double norm_below(double measure, double tensile_strength, double compressive_strength)
{
  // Bounds relative to the norm: principal stress 1, von Mises stress sqrt(3/2), trace sqrt(3).
  return measure / (1. + std::max(1., tensile_strength / compressive_strength));
}
} // namespace kerf
