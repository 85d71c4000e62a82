// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

namespace kerf
{
/// Largest eigenvalue of a symmetric operator and its vector.
struct HighestMode
{
  double value = 0.;      ///< Rayleigh quotient of the vector, a lower bound of the eigenvalue
  double residual = 0.;   ///< norm of A y - value y for |y| = 1
  Eigen::VectorXd vector; ///< of unit length
  int products = 0;       ///< number of products with the operator
};

/// Largest eigenvalue by the Lanczos method with a short basis, restarted from the best vector. Stops when the residual is
/// below @p tolerance times the value, when a restart raises the value by less than a tenth of that, or after @p max_products.
/// @param apply computes y = A x
HighestMode highest_mode(const std::function<void(const Eigen::VectorXd &x, Eigen::VectorXd &y)> &apply,
                         const Eigen::VectorXd &start, double tolerance, int max_products);
} // namespace kerf
