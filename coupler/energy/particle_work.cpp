// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/energy/particle_work.h"

#include "coupler/base/mpi_helpers.h"

#include <unordered_map>

namespace kerf
{
using Eigen::Vector3d;

void ParticleWork::begin(dem::Phase phase, const dem::Particles &particles)
{
  stepping = phase == dem::Phase::step;
  if (particles.order != order)
  {
    if (stepping)
      follow_moved(particles);
    order = particles.order;
  }
  if (stepping) // forces of a setup take the place of those before
    for (const Load &load : loads)
      sum += half_way(particles, load);
  loads.clear();
}

void ParticleWork::follow_moved(const dem::Particles &particles)
{
  constexpr int size = 7; // index, force, torque
  std::vector<double> local;
  for (const Load &load : loads)
  {
    local.push_back(load.index);
    local.insert(local.end(), load.force.data(), load.force.data() + 3);
    local.insert(local.end(), load.torque.data(), load.torque.data() + 3);
  }
  const std::vector<double> all = gather_all(local, MPI_DOUBLE, comm);
  std::unordered_map<int, const double *> by_index;
  for (std::size_t k = 0; k < all.size(); k += size)
    by_index[static_cast<int>(all[k])] = &all[k];
  loads.clear();
  for (int i = 0; i < particles.n; ++i)
    if (const auto found = by_index.find(particles.index[i]); found != by_index.end())
      loads.push_back(
        {i, particles.index[i], Eigen::Map<const Vector3d>(found->second + 1), Eigen::Map<const Vector3d>(found->second + 4)});
}

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
