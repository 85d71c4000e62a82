// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/stability/lanczos.h"

#include "coupler/base/errors.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace kerf
{
HighestMode highest_mode(const std::function<void(const Eigen::VectorXd &x, Eigen::VectorXd &y)> &apply,
                         const Eigen::VectorXd &start, double tolerance, int max_products)
{
  constexpr int longest_basis = 30;
  HighestMode mode;
  mode.vector = start;
  const double length = start.norm();
  if (length == 0.)
    return mode;
  mode.vector /= length;
  Eigen::VectorXd product(start.size());
  while (mode.products < max_products)
  {
    const int n = static_cast<int>(std::min<Eigen::Index>({longest_basis, max_products - mode.products, start.size()}));
    Eigen::MatrixXd basis(start.size(), n);
    Eigen::VectorXd diagonal(n), off_diagonal(n);
    basis.col(0) = mode.vector;
    int size = 0;
    while (size < n)
    {
      apply(basis.col(size), product);
      ++mode.products;
      diagonal[size] = basis.col(size).dot(product);
      // In exact arithmetic the product has components along two basis vectors only. A second pass orthogonalises against all
      // of them, because round-off leaves a residue when the product nearly vanishes.
      product -= diagonal[size] * basis.col(size);
      if (size > 0)
        product -= off_diagonal[size - 1] * basis.col(size - 1);
      product -= basis.leftCols(size + 1) * (basis.leftCols(size + 1).transpose() * product);
      off_diagonal[size] = product.norm();
      if (!std::isfinite(off_diagonal[size])) // the eigenvalue solver would not end
        throw InputError("the stiffness of the coupled model over its mass is no finite number");
      ++size;
      if (off_diagonal[size - 1] <= 1e-13 * std::abs(diagonal[0]))
        break;
      if (size < n)
        basis.col(size) = product / off_diagonal[size - 1];
    }
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
    ritz.computeFromTridiagonal(diagonal.head(size), off_diagonal.head(size - 1));
    const double before = mode.value;
    mode.value = ritz.eigenvalues()[size - 1];
    mode.residual = off_diagonal[size - 1] * std::abs(ritz.eigenvectors()(size - 1, size - 1));
    mode.vector = basis.leftCols(size) * ritz.eigenvectors().col(size - 1);
    mode.vector.normalize();
    if (mode.residual <= tolerance * mode.value || mode.value - before <= 0.1 * tolerance * mode.value || size < n)
      break;
  }
  return mode;
}
} // namespace kerf
