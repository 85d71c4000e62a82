// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_network/bond_network.h"
#include "dem_side/bond_network/network_operator.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
/// Upper estimate of the largest eigenvalue by Lanczos iteration: the largest Ritz value plus its residual. It needs no
/// reorthogonalisation, because only the upper end of the spectrum is of interest.
/// @param multiply called as multiply(x, y): y = A x of the symmetric operator on vectors of length @p n.
template <typename Multiply>
double largest_eigenvalue(const int n, const Multiply &multiply)
{
  const double tolerance = 1e-3; // of omega^2, 0.05 % of omega
  const int max_steps = std::min(n, 1000);
  std::mt19937_64 random(1);
  Eigen::VectorXd q(n), q_previous = Eigen::VectorXd::Zero(n), next(n);
  for (int i = 0; i < n; ++i)
    q[i] = double(random() >> 11) * 0x1p-53 - 0.5;
  q.normalize();
  std::vector<double> diagonal, off_diagonal;
  double previous_value = 0.;
  for (int step = 1; step <= max_steps; ++step)
  {
    multiply(q, next);
    if (step > 1)
      next -= off_diagonal.back() * q_previous;
    diagonal.push_back(q.dot(next));
    next -= diagonal.back() * q;
    const double norm = next.norm();
    if (!std::isfinite(norm)) // the eigenvalue solver would not end
      throw std::invalid_argument("the stiffness of the bonds over the mass of the particles is no finite number");
    if (step % 20 == 0 || step == max_steps || norm <= 1e-12 * diagonal.front())
    {
      const Eigen::Map<const Eigen::VectorXd> d(diagonal.data(), step), e(off_diagonal.data(), step - 1);
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz;
      ritz.computeFromTridiagonal(d, e);
      const double value = ritz.eigenvalues()[step - 1];
      const double residual = norm * std::abs(ritz.eigenvectors()(step - 1, step - 1));
      // The value must have converged as well: a small residual alone may belong to the second largest eigenvalue.
      if ((residual < tolerance * value && value - previous_value < tolerance * value) || step == max_steps ||
          norm <= 1e-12 * diagonal.front())
        return value + residual;
      previous_value = value;
    }
    off_diagonal.push_back(norm);
    q_previous.swap(q);
    q = next / norm;
  }
  return 0.; // only for an empty matrix
}
} // namespace

double largest_frequency(const Packing &packing, double k_n, double k_t, double density)
{
  if (packing.dim != 2 && packing.dim != 3)
    throw std::invalid_argument("largest frequency: the packing must be 2D or 3D");
  if (!(density > 0.) || !(k_n >= 0.) || !(k_t >= 0.))
    throw std::invalid_argument("largest frequency: density must be positive and stiffnesses not negative");
  if (packing.bonds.empty())
    return 0.;
  std::vector<int> particles(packing.size());
  std::iota(particles.begin(), particles.end(), 0);
  const NetworkOperator network(packing, StoredBonds(packing), {k_n, k_t, density}, particles,
                                std::vector<char>(packing.size(), 1), Eigen::VectorXd::Ones(packing.size()));
  // M^-1/2 K M^-1/2 of the free network, translations and rotations.
  const Eigen::VectorXd inverse_root_mass = network.masses().cwiseSqrt().cwiseInverse();
  Eigen::VectorXd motion;
  const auto multiply = [&](const Eigen::VectorXd &x, Eigen::VectorXd &y)
  {
    motion = inverse_root_mass.cwiseProduct(x);
    y.setZero();
    network.add_product(motion, y);
    y = y.cwiseProduct(inverse_root_mass);
  };
  const double safety = 1.01;
  return safety * std::sqrt(largest_eigenvalue(network.n_dofs(), multiply));
}
} // namespace kerf::dem
