// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/energy/interface_work.h"

namespace kerf
{
void InterfaceWork::begin(dem::Phase phase, const dem::Particles &particles, const Eigen::Matrix3Xd &node_velocity)
{
  stepping = phase == dem::Phase::step;
  on_particles.begin(phase, particles);
  if (stepping && has_forces)
    on_nodes += 0.5 * dt * node_force.cwiseProduct(node_velocity).sum();
  has_forces = false;
}

void InterfaceWork::end(const Eigen::Matrix3Xd &force, const Eigen::Matrix3Xd &velocity)
{
  if (stepping)
    on_nodes += 0.5 * dt * force.cwiseProduct(velocity).sum();
  node_force = force;
  has_forces = true;
}
} // namespace kerf
