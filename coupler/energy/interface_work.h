// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/particle_work.h"

namespace kerf
{
/// Work of the forces of a constraint on particles and on the nodes of its window, by the trapezoidal rule over the steps of
/// both sides (see ParticleWork).
class InterfaceWork
{
public:
  InterfaceWork(double dt, MPI_Comm comm) : dt(dt), on_particles(dt, comm) {}

  /// Adds the work of the last step's forces on the way to the present positions. Call it before the window changes.
  /// Collective.
  /// @param node_velocity of the window's nodes [m/s], read in steps only
  void begin(dem::Phase phase, const dem::Particles &particles, const Eigen::Matrix3Xd &node_velocity);
  /// Adds force [N] and torque [N m] on particle @p i in this step.
  void add(const dem::Particles &particles, int i, const Eigen::Vector3d &force, const Eigen::Vector3d &torque)
  {
    on_particles.add(particles, i, force, torque);
  }
  /// Adds work that the constraint has summed up itself [J].
  void add_energy(double energy) { on_particles.add_energy(energy); }
  /// Adds the forces on the window's nodes in this step.
  /// @param force [N], 3 x n_window
  /// @param velocity of the nodes [m/s], 3 x n_window
  void end(const Eigen::Matrix3Xd &force, const Eigen::Matrix3Xd &velocity);

  /// Work on both sides since the start, of this rank [J].
  double local() const { return on_particles.local() + on_nodes; }

private:
  double dt;
  ParticleWork on_particles;
  double on_nodes = 0.;
  bool stepping = false, has_forces = false;
  Eigen::Matrix3Xd node_force;
};
} // namespace kerf
