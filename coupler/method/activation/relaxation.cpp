// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/relaxation.h"

#include <Eigen/Geometry>
#include <unordered_set>

namespace kerf
{
void relax(const dem::BondParameters &bond, double density, int iterations, const dem::Packing &packing,
           const std::vector<int> &moving, const Accelerations &accelerations, dem::DemSide &dem_side,
           const std::function<void()> &compute_forces, const std::function<Eigen::VectorXd()> &springs)
{
  constexpr double step = 0.9, memory = 0.55;
  struct Mover // a particle of this rank
  {
    int particle;                     // in the present order, which does not change
    Eigen::Matrix<double, 6, 1> move; // last increment of displacement and rotation
    Eigen::Vector3d target;           // target acceleration
  };
  std::vector<Mover> movers;
  {
    const std::unordered_set<int> chosen(moving.begin(), moving.end());
    const dem::Particles particles = dem_side.particles();
    for (int i = 0; i < particles.n; ++i)
      if (chosen.count(particles.index[i]))
      {
        const auto target = accelerations.find(particles.index[i]);
        movers.push_back({i, Eigen::Matrix<double, 6, 1>::Zero(),
                          target == accelerations.end() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : target->second});
      }
  }
  const double k_n = bond.k_n, k_t = bond.k_t;

  for (int iteration = 0; iteration < iterations; ++iteration)
  {
    dem::Particles particles = dem_side.particles();
    const Eigen::VectorXd spring = springs();
    for (auto &[i, move, target] : movers)
    {
      // In each direction half of the contacts act with k_n and half with k_t. The weighted mass gives their mean weight.
      const double contacts = packing.coordination() * particles.mass[i] / (density * packing.volume(particles.index[i]));
      const double radius = particles.radius[i];
      move *= memory;
      const double stiffness = 0.5 * contacts * (k_n + k_t) + (i < spring.size() ? spring[i] : 0.);
      const Eigen::Vector3d force = particles.force.col(i) - particles.mass[i] * target;
      move.head<3>() += step / stiffness * force;
      move.tail<3>() += step / (contacts * k_t * radius * radius) * particles.torque.col(i);
      particles.position.col(i) += move.head<3>();
      Eigen::Map<Eigen::Vector4d> stored(particles.rotation + 4 * i); // (w, x, y, z)
      const Eigen::Quaterniond turned = Eigen::Quaterniond(1., 0.5 * move[3], 0.5 * move[4], 0.5 * move[5]) *
                                        Eigen::Quaterniond(stored[0], stored[1], stored[2], stored[3]);
      stored = Eigen::Vector4d(turned.w(), turned.x(), turned.y(), turned.z()).normalized();
    }
    compute_forces();
  }
}
} // namespace kerf
