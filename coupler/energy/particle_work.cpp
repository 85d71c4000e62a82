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
} // namespace kerf
