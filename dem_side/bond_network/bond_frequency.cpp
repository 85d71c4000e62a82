// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_network/bond_network.h"
#include "dem_side/bond_network/network_operator.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
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

namespace
{
NetworkOperator whole_network(const Packing &packing, const NetworkOperator::Material &material)
{
  if (packing.dim != 2 && packing.dim != 3)
    throw std::invalid_argument("largest frequency: the packing must be 2D or 3D");
  if (!(material.density > 0.) || !(material.k_n >= 0.) || !(material.k_t >= 0.) || !(material.damping >= 0.))
    throw std::invalid_argument("largest frequency: density must be positive, stiffnesses and damping not negative");
  std::vector<int> particles(packing.size());
  std::iota(particles.begin(), particles.end(), 0);
  return NetworkOperator(packing, StoredBonds(packing), material, particles, std::vector<char>(packing.size(), 1),
                         Eigen::VectorXd::Ones(packing.size()));
}

/// Upper estimate of the largest eigenvalue of M^-1 (stiff K + viscous C) of the free network, translations and rotations.
double highest_of(const NetworkOperator &network, double stiff, double viscous)
{
  constexpr double safety = 1.01; // of the frequency
  const Eigen::VectorXd inverse_root_mass = network.masses().cwiseSqrt().cwiseInverse();
  Eigen::VectorXd motion;
  const auto multiply = [&](const Eigen::VectorXd &x, Eigen::VectorXd &y)
  {
    motion = inverse_root_mass.cwiseProduct(x);
    y.setZero();
    network.add_sum(stiff, viscous, motion, y);
    y = y.cwiseProduct(inverse_root_mass);
  };
  return safety * safety * largest_eigenvalue(network.n_dofs(), multiply);
}
} // namespace

double largest_frequency(const Packing &packing, double k_n, double k_t, double density)
{
  if (packing.bonds.empty())
    return 0.;
  return std::sqrt(highest_of(whole_network(packing, {k_n, k_t, density}), 1., 0.));
}

double largest_step(const Packing &packing, const NetworkOperator::Material &material, const Eigen::VectorXd &dashpots,
                    const std::function<double(double dt)> &limit)
{
  if (packing.bonds.empty())
    return std::numeric_limits<double>::infinity();
  if (limit(0.) <= 0.)
    return 0.;
  NetworkOperator network = whole_network(packing, material);
  network.add_dashpots(dashpots);
  // Largest step up to the upper one that is allowed.
  const auto bisect = [](double upper, const auto &allowed)
  {
    double lower = 0.;
    for (int k = 0; k < 60; ++k)
      (allowed(0.5 * (lower + upper)) ? lower : upper) = 0.5 * (lower + upper);
    return lower;
  };
  const bool damped = material.damping > 0. || dashpots.size() > 0;
  const double stiff = highest_of(network, 1., 0.), viscous = damped ? highest_of(network, 0., 2.) : 0.;
  double dt = bisect(2. * std::sqrt(limit(0.) / stiff), [&](double s) { return stiff * s * s + viscous * s <= limit(s); });
  if (!damped)
    return dt;
  // The eigenvalue of a sum is at most the sum of both, so this step is too short. It grows at most with the square of the
  // step, so the next ones approach the limit from below.
  constexpr double settled = 1.002;
  constexpr int most_iterations = 10;
  for (int k = 0; k < most_iterations && dt > 0.; ++k)
  {
    const double value = highest_of(network, 1., 2. / dt);
    const double next = bisect(2. * dt, [&](double s) { return value * s * s <= limit(s); });
    const bool done = next < settled * dt;
    dt = std::max(dt, next);
    if (done)
      break;
  }
  return dt;
}
} // namespace kerf::dem
