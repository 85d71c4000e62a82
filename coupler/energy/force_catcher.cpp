// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/energy/force_catcher.h"

namespace kerf
{
dem::Particles &ForceCatcher::catch_forces(const dem::Particles &particles)
{
  if (force.cols() != particles.n)
  {
    force.setZero(3, particles.n);
    torque.setZero(3, particles.n);
  }
  const auto map = [&](dem::Vectors &vectors, const double *data)
  { new (&vectors) dem::Vectors(const_cast<double *>(data), 3, particles.n); };
  map(caught.position, particles.position.data());
  map(caught.velocity, particles.velocity.data());
  map(caught.angular_velocity, particles.angular_velocity.data());
  map(caught.force, force.data());
  map(caught.torque, torque.data());
  caught.n = particles.n;
  caught.index = particles.index;
  caught.mass = particles.mass;
  caught.radius = particles.radius;
  caught.weight = particles.weight;
  caught.rotation = particles.rotation;
  caught.order = particles.order;
  return caught;
}

void ForceCatcher::release(const std::vector<int> &touched, dem::Particles &particles, ParticleWork &work)
{
  for (const int i : touched)
  {
    if ((force.col(i).array() == 0.).all() && (torque.col(i).array() == 0.).all())
      continue;
    particles.force.col(i) += force.col(i);
    particles.torque.col(i) += torque.col(i);
    work.add(particles, i, force.col(i), torque.col(i));
    force.col(i).setZero();
    torque.col(i).setZero();
  }
}
} // namespace kerf
