// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/particle_work.h"

namespace kerf
{
/// Work of the forces that a constraint puts on particles and nodes of its window, by the trapezoidal rule over the steps of
/// both sides (see ParticleWork).
class InterfaceWork
{
public:
  InterfaceWork(double dt, MPI_Comm comm) : dt(dt), on_particles(dt, comm) {}

  /// Before the window changes: counts the forces of the step before over the way to the present positions. Collective.
  /// @param node_velocity of the window's nodes [m/s], read in steps only
  void begin(dem::Phase phase, const dem::Particles &particles, const Eigen::Matrix3Xd &node_velocity);
  /// Force [N] and torque [N m] that particle @p i gets now.
  void add(const dem::Particles &particles, int i, const Eigen::Vector3d &force, const Eigen::Vector3d &torque)
  {
    on_particles.add(particles, i, force, torque);
  }
  /// What a constraint counts itself [J].
  void add_energy(double energy) { on_particles.add_energy(energy); }
  /// Forces on the window's nodes [N] and their velocities [m/s], 3 x n_window.
  void end(const Eigen::Matrix3Xd &force, const Eigen::Matrix3Xd &velocity);

  /// Done on both sides since the start, of this rank [J].
  double local() const { return on_particles.local() + on_nodes; }

private:
  double dt;
  ParticleWork on_particles;
  double on_nodes = 0.;
  bool stepping = false, has_forces = false;
  Eigen::Matrix3Xd node_force;
};
} // namespace kerf
