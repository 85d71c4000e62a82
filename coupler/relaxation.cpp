// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/relaxation.h"

#include "coupler/stable_step.h"

#include <Eigen/Geometry>
#include <unordered_map>

namespace kerf
{
void relax(const Case &settings, const dem::Packing &packing, const std::vector<int> &moving,
           const Accelerations &accelerations, dem::DemSide &dem_side, const std::function<void()> &compute_forces,
           const std::function<Eigen::VectorXd()> &springs)
{
  constexpr double step = 0.9, memory = 0.55;
  using Move = Eigen::Matrix<double, 6, 1>; // displacement, rotation
  std::unordered_map<int, Move> moves;
  for (const int index : moving)
    moves[index] = Move::Zero();
  const double density = particle_density(settings, packing), k_n = settings.bond.k_n, k_t = settings.bond.k_t;

  compute_forces();
  for (int iteration = 0; iteration < settings.relaxation_steps; ++iteration)
  {
    dem::Particles particles = dem_side.particles();
    const Eigen::VectorXd spring = springs();
    for (int i = 0; i < particles.n; ++i)
    {
      const auto found = moves.find(particles.index[i]);
      if (found == moves.end())
        continue;
      // Of n contacts half look along each direction; the weighted mass carries the mean contact weight.
      const double contacts = packing.coordination() * particles.mass[i] / (density * packing.volume(particles.index[i]));
      const double radius = particles.radius[i];
      Move &move = found->second;
      move *= memory;
      const double stiffness = 0.5 * contacts * (k_n + k_t) + (i < spring.size() ? spring[i] : 0.);
      Eigen::Vector3d force = particles.force.col(i);
      if (const auto wanted = accelerations.find(particles.index[i]); wanted != accelerations.end())
        force -= particles.mass[i] * wanted->second;
      move.head<3>() += step / stiffness * force;
      move.tail<3>() += step / (contacts * k_t * radius * radius) * particles.torque.col(i);
      particles.position.col(i) += move.head<3>();
      Eigen::Map<Eigen::Vector4d> stored(particles.rotation + 4 * i); // (w, x, y, z), turned by a small angle
      const Eigen::Quaterniond turned = Eigen::Quaterniond(1., 0.5 * move[3], 0.5 * move[4], 0.5 * move[5]) *
                                        Eigen::Quaterniond(stored[0], stored[1], stored[2], stored[3]);
      stored = Eigen::Vector4d(turned.w(), turned.x(), turned.y(), turned.z()).normalized();
    }
    compute_forces();
  }
}
} // namespace kerf
