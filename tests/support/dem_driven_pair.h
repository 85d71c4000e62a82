// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "tests/support/dem_test_packings.h"

namespace kerf::dem::test
{
constexpr double d0 = 1e-3; ///< distance of the pair [m]

/// Both particles follow given paths; the loads that the engine computed are kept.
struct Driven
{
  using Path = std::function<Eigen::Vector3d(int particle, double time)>;

  Driven(const Settings &settings, Path path, const Eigen::Vector3d &spin = Eigen::Vector3d::Zero())
    : dt(settings.time_step), path(path), spin(spin), dem(settings)
  {
    auto particles = all_particles(*settings.packing);
    for (NewParticle &p : particles)
    {
      p.displacement = path(p.index, 0.) - settings.packing->positions.col(p.index);
      p.velocity = (path(p.index, dt) - path(p.index, 0.)) / dt;
      p.angular_velocity = spin;
    }
    start(dem, *settings.packing, particles, hook());
  }
  void advance(int steps) { dem.advance(steps, hook()); }
  ForceHook hook()
  {
    return [this](Phase phase, Particles &p)
    {
      if (phase == Phase::step)
        ++n;
      force.setZero();
      torque.setZero();
      for (int i = 0; i < p.n; ++i)
      {
        force.col(p.index[i]) = p.force.col(i);
        torque.col(p.index[i]) = p.torque.col(i);
        p.force.col(i).setZero();
        p.torque.col(i).setZero();
        p.velocity.col(i) = (path(p.index[i], (n + 1) * dt) - p.position.col(i)) / dt;
        p.angular_velocity.col(i) = spin;
      }
      MPI_Allreduce(MPI_IN_PLACE, force.data(), 6, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
      MPI_Allreduce(MPI_IN_PLACE, torque.data(), 6, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    };
  }

  double dt;
  Path path;
  Eigen::Vector3d spin;
  int n = 0;
  Eigen::Matrix<double, 3, 2> force, torque; ///< by particle
  DemSide dem;
};

/// The first particle rests, the second one moves with this velocity.
inline Driven::Path moving(const Packing &packing, const Eigen::Vector3d &velocity)
{
  const Eigen::Matrix3Xd x = packing.positions;
  return [x, velocity](int particle, double t) { return Eigen::Vector3d(x.col(particle) + particle * t * velocity); };
}
} // namespace kerf::dem::test
