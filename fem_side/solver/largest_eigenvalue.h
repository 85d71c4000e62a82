// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <mpi.h>

namespace kerf::fem
{
struct LargestEigenvalue
{
  double value = 0.;
  double error = 0.; ///< residual norm: distance from an eigenvalue
  int iterations = 0;
};

/// Largest eigenvalue of a symmetric positive semi-definite operator whose vectors are distributed over ranks. Lanczos' method
/// without reorthogonalisation: copies of converged eigenvalues do not change the largest (Parlett 1998, ch. 13). Power
/// iteration would need thousands of products because the top of an elastic spectrum is dense. @p apply: y = A x, collective.
/// @p start: this rank's part of the start vector. Stops when the error falls below @p tolerance times the value. Collective.
LargestEigenvalue largest_eigenvalue(const std::function<void(const Eigen::VectorXd &x, Eigen::VectorXd &y)> &apply,
                                     const Eigen::VectorXd &start, MPI_Comm comm, double tolerance, int max_iterations);
} // namespace kerf::fem
