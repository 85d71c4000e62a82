// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_kinematics.h"
#include "dem_side/bond_network.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCore>
#include <cmath>
#include <random>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
/// M^-1/2 K M^-1/2 of the free network, translations and rotations.
template <int dim>
Eigen::SparseMatrix<double, Eigen::RowMajor> dynamic_matrix(const Packing &packing, double k_n, double k_t, double density)
{
  constexpr int dofs = particle_dofs<dim>;
  using Vector = Eigen::Matrix<double, dim, 1>;
  const double inertia = dim == 2 ? 0.5 : 0.4; // of a disc, a sphere [m r^2]
  const auto inverse_root_mass = [&](int i)
  {
    const double root = std::sqrt(density * packing.volume(i));
    Eigen::Matrix<double, dofs, 1> result;
    result.setConstant(1. / root);
    result.template tail<rotations<dim>>() /= std::sqrt(inertia) * packing.radii[i];
    return result;
  };

  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(packing.bonds.size() * 4 * dofs * dofs);
  for (const auto &[i, j] : packing.bonds)
  {
    const Vector branch = packing.branch(i, j).template head<dim>();
    const double length = branch.norm();
    const Vector n = branch / length;
    const double lever_i = length * packing.radii[i] / (packing.radii[i] + packing.radii[j]);
    Eigen::Matrix<double, dim, 2 *dofs> relative = relative_displacement<dim>(n, lever_i, length - lever_i);
    relative.template leftCols<dofs>() *= inverse_root_mass(i).asDiagonal();
    relative.template rightCols<dofs>() *= inverse_root_mass(j).asDiagonal();
    const auto unit = Eigen::Matrix<double, dim, dim>::Identity();
    const Eigen::Matrix<double, dim, dim> spring = k_t * unit + (k_n - k_t) * n * n.transpose();
    const Eigen::Matrix<double, 2 * dofs, 2 *dofs> block = relative.transpose() * spring * relative;
    for (int r = 0; r < 2 * dofs; ++r)
      for (int c = 0; c < 2 * dofs; ++c)
        entries.emplace_back(dofs * (r < dofs ? i : j) + r % dofs, dofs * (c < dofs ? i : j) + c % dofs, block(r, c));
  }
  Eigen::SparseMatrix<double, Eigen::RowMajor> matrix(dofs * packing.size(), dofs * packing.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Upper estimate of the largest eigenvalue by Lanczos iteration: the largest Ritz value plus its residual. Without
/// reorthogonalisation, since only the outer end of the spectrum is wanted.
double largest_eigenvalue(const Eigen::SparseMatrix<double, Eigen::RowMajor> &matrix)
{
  const double tolerance = 1e-3; // of omega^2, 0.05 % of omega
  const int n = static_cast<int>(matrix.rows()), max_steps = std::min(n, 1000);
  std::mt19937_64 random(1);
  Eigen::VectorXd q(n), q_previous = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i)
    q[i] = double(random() >> 11) * 0x1p-53 - 0.5;
  q.normalize();
  std::vector<double> diagonal, off_diagonal;
  double settled = 0.;
  for (int step = 1; step <= max_steps; ++step)
  {
    Eigen::VectorXd next = matrix * q;
    if (step > 1)
      next -= off_diagonal.back() * q_previous;
    diagonal.push_back(q.dot(next));
    next -= diagonal.back() * q;
    const double norm = next.norm();
    if (step % 20 == 0 || step == max_steps || norm <= 1e-12 * diagonal.front())
    {
      const Eigen::Map<const Eigen::VectorXd> d(diagonal.data(), step), e(off_diagonal.data(), step - 1);
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
      ritz.computeFromTridiagonal(d, e);
      const double value = ritz.eigenvalues()[step - 1];
      const double residual = norm * std::abs(ritz.eigenvectors()(step - 1, step - 1));
      // The value must have settled as well: a small residual alone may belong to the second largest.
      if ((residual < tolerance * value && value - settled < tolerance * value) || step == max_steps ||
          norm <= 1e-12 * diagonal.front())
        return value + residual;
      settled = value;
    }
    off_diagonal.push_back(norm);
    q_previous = q;
    q = next / norm;
  }
  return 0.; // only for an empty matrix
}
} // namespace

double largest_frequency(const Packing &packing, double k_n, double k_t, double density)
{
  if (packing.dim != 2 && packing.dim != 3)
    throw std::runtime_error("largest frequency: the packing must be 2D or 3D");
  if (!(density > 0.) || !(k_n >= 0.) || !(k_t >= 0.))
    throw std::runtime_error("largest frequency: density must be positive and stiffnesses not negative");
  if (packing.bonds.empty())
    return 0.;
  const auto matrix =
    packing.dim == 2 ? dynamic_matrix<2>(packing, k_n, k_t, density) : dynamic_matrix<3>(packing, k_n, k_t, density);
  const double safety = 1.01;
  return safety * std::sqrt(largest_eigenvalue(matrix));
}
} // namespace kerf::dem
