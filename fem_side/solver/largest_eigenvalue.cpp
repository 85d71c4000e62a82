// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/solver/largest_eigenvalue.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace kerf::fem
{
namespace
{
double global_dot(const Eigen::VectorXd &a, const Eigen::VectorXd &b, MPI_Comm comm)
{
  double sum = a.dot(b);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, comm);
  return sum;
}

/// Largest eigenvalue of the tridiagonal matrix and its residual in the large space.
LargestEigenvalue ritz_value(const std::vector<double> &diagonal, const std::vector<double> &off_diagonal)
{
  const int k = static_cast<int>(diagonal.size());
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(Eigen::Map<const Eigen::VectorXd>(diagonal.data(), k),
                                Eigen::Map<const Eigen::VectorXd>(off_diagonal.data(), k - 1));
  return {solver.eigenvalues()[k - 1], off_diagonal.back() * std::abs(solver.eigenvectors()(k - 1, k - 1)), k};
}
} // namespace

LargestEigenvalue largest_eigenvalue(const std::function<void(const Eigen::VectorXd &x, Eigen::VectorXd &y)> &apply,
                                     const Eigen::VectorXd &start, MPI_Comm comm, const double tolerance,
                                     const int max_iterations)
{
  const double norm = std::sqrt(global_dot(start, start, comm));
  if (norm == 0.)
    return {};
  Eigen::VectorXd x = start / norm;
  Eigen::VectorXd previous = Eigen::VectorXd::Zero(start.size());
  Eigen::VectorXd y(start.size());
  std::vector<double> diagonal, off_diagonal;
  LargestEigenvalue result;
  int next_check = 10;
  while (static_cast<int>(diagonal.size()) < max_iterations)
  {
    apply(x, y);
    diagonal.push_back(global_dot(x, y, comm));
    y -= diagonal.back() * x;
    if (!off_diagonal.empty())
      y -= off_diagonal.back() * previous;
    off_diagonal.push_back(std::sqrt(global_dot(y, y, comm)));
    if (!std::isfinite(off_diagonal.back())) // the eigenvalue solver would not end
      throw std::invalid_argument("rock: the stiffness of the cells over their mass is no finite number");

    const int k = static_cast<int>(diagonal.size());
    const bool exhausted = off_diagonal.back() <= 1e-14 * std::abs(diagonal.front());
    if (exhausted || k == next_check || k == max_iterations)
    {
      result = ritz_value(diagonal, off_diagonal);
      if (exhausted || result.error <= tolerance * result.value)
        break;
      next_check = k + std::max(10, k / 4); // the small eigenvalue problem grows with k^3
    }
    previous.swap(x);
    x = y / off_diagonal.back();
  }
  return result;
}
} // namespace kerf::fem
