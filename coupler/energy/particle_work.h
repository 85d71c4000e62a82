// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <mpi.h>
#include <vector>

namespace kerf
{
/// Work of forces that the coupler adds to particles, by the trapezoidal rule over each step: mean of the forces at its two
/// ends times the displacement between them. Velocity Verlet balances energy exactly in this measure: the gain of m/2 v^{n-1/2}
/// v^{n+1/2} equals the work of all forces. Theory (10.4).
class ParticleWork
{
public:
  ParticleWork(double dt, MPI_Comm comm) : dt(dt), comm(comm) {}

  /// Starts a step or a setup: adds the work of the last step's forces on the way to the present positions. Call it before
  /// forces are added. Collective when particles changed rank.
  void begin(dem::Phase phase, const dem::Particles &particles);
  /// Adds force [N] and torque [N m] on particle @p i in this step. Call it before the particle's velocity is changed.
  void add(const dem::Particles &particles, int i, const Eigen::Vector3d &force, const Eigen::Vector3d &torque)
  {
    loads.push_back({i, particles.index[i], force, torque});
    if (stepping)
      sum += half_way(particles, loads.back());
  }
  /// Adds work that no force over a step accounts for, e.g. of a prescribed change of velocity [J].
  void add_energy(double energy) { sum += energy; }

  double local() const { return sum; } ///< work since the start, of this rank [J]

private:
  struct Load
  {
    int slot = -1, index = -1;
    Eigen::Vector3d force, torque;
  };
  double half_way(const dem::Particles &particles, const Load &load) const
  {
    return 0.5 * dt *
           (load.force.dot(particles.velocity.col(load.slot)) + load.torque.dot(particles.angular_velocity.col(load.slot)));
  }
  void follow_moved(const dem::Particles &particles);

  double dt;
  MPI_Comm comm;
  bool stepping = false;
  std::uint64_t order = 0;
  std::vector<Load> loads; // of the present step
  double sum = 0.;
};
} // namespace kerf
