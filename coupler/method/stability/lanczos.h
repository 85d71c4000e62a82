// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

namespace kerf
{
/// The top of the spectrum of a symmetric operator.
struct HighestMode
{
  double value = 0.;      ///< Rayleigh quotient of the vector, from below
  double residual = 0.;   ///< norm of A y - value y, |y| = 1
  Eigen::VectorXd vector; ///< of unit length
  int products = 0;       ///< with the operator
};

/// Largest eigenvalue by Lanczos' method with a short basis and restarts from the best vector. Stops when the residual falls
/// below @p tolerance times the value, when a restart no longer raises the value by a tenth of that, or after
/// @p max_products. @p apply: y = A x.
HighestMode highest_mode(const std::function<void(const Eigen::VectorXd &x, Eigen::VectorXd &y)> &apply,
                         const Eigen::VectorXd &start, double tolerance, int max_products);
} // namespace kerf
