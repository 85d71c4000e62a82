// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/bond_kinematics.h"
#include "dem_side/bond/rock_bond_law.h"

#include <cstring>

/// Cundall's local (non-viscous) damping of four particles at a time.
namespace kerf::dem
{
/// Load on one particle.
template <int dim>
struct Load
{
  law::Vector<dim> force; ///< [N]
  law::Spin<dim> torque;  ///< [N m]
};

/// Pointers into the arrays of LIGGGHTS, at the first of the particles to damp.
struct Motions
{
  double *force, *torque;
  const double *velocity, *spin, *mass, *radius;
};

/// Power of damping forces [W].
template <typename Value>
struct DampingPower
{
  Value at_step;   ///< with the velocity at the step
  Value half_back; ///< with that of half a step before
};

/// Local damping of translations or rotations: opposed to the velocity at the step and proportional to the load, to which it is
/// added. @return power of this damping and of the damping of pairs
/// @param factor of local damping [-]; @param half_step from the velocity to the step [s]
/// @param per_inertia acceleration per load; @param pair_damping part of the load
template <int n>
DampingPower<SimdPack> damp_load(double factor, double half_step, const SimdPack (&velocity)[n], const SimdPack &per_inertia,
                                 const SimdPack (&pair_damping)[n], SimdPack (&load)[n])
{
  SimdPack before[n], speed2 = 1e-200, load2 = 0.; // avoids a division by zero for a particle at rest
  for (int c = 0; c < n; ++c)
  {
    before[c] = velocity[c] + half_step * per_inertia * load[c];
    speed2 += before[c] * before[c];
    load2 += load[c] * load[c];
  }
  const SimdPack viscosity = factor * sqrt(load2 / speed2);
  DampingPower<SimdPack> power = {0., 0.};
  for (int c = 0; c < n; ++c)
  {
    const SimdPack extra = -viscosity * before[c];
    load[c] += extra;
    power.at_step += (pair_damping[c] + extra) * (velocity[c] + half_step * per_inertia * load[c]);
    power.half_back += (pair_damping[c] + extra) * velocity[c];
  }
  return power;
}

/// Adds local damping to four particles. @return power of all damping on them
/// @param viscous damping of the pairs, part of force and torque
template <int dim>
DampingPower<double> damp_four(double factor, double half_step, const Motions &particles, const Load<dim> *viscous)
{
  constexpr int n_rotations = rotations<dim>;
  SimdPack mass, radius, force[3], torque[3], velocity[3], spin[3], pair_force[dim], pair_torque[n_rotations];
  std::memcpy(&mass.v, particles.mass, sizeof mass);
  std::memcpy(&radius.v, particles.radius, sizeof radius);
  load_vectors(particles.force, force[0], force[1], force[2]);
  load_vectors(particles.torque, torque[0], torque[1], torque[2]);
  load_vectors(particles.velocity, velocity[0], velocity[1], velocity[2]);
  load_vectors(particles.spin, spin[0], spin[1], spin[2]);
  for (int lane = 0; lane < SimdPack::size; ++lane)
  {
    for (int c = 0; c < dim; ++c)
      pair_force[c].set(lane, viscous[lane].force[c]);
    for (int c = 0; c < n_rotations; ++c)
      pair_torque[c].set(lane, viscous[lane].torque[c]);
  }
  const SimdPack per_mass = 1. / mass, per_inertia = per_mass / (inertia_factor(dim) * radius * radius);
  DampingPower<SimdPack> power, of_rotations;
  if constexpr (dim == 2)
  {
    SimdPack in_plane[] = {force[0], force[1]}, about_z[] = {torque[2]};
    const SimdPack velocity_in_plane[] = {velocity[0], velocity[1]}, spin_about_z[] = {spin[2]};
    power = damp_load<2>(factor, half_step, velocity_in_plane, per_mass, pair_force, in_plane);
    of_rotations = damp_load<1>(factor, half_step, spin_about_z, per_inertia, pair_torque, about_z);
    force[0] = in_plane[0], force[1] = in_plane[1], torque[2] = about_z[0];
  }
  else
  {
    power = damp_load<3>(factor, half_step, velocity, per_mass, pair_force, force);
    of_rotations = damp_load<3>(factor, half_step, spin, per_inertia, pair_torque, torque);
  }
  store_vectors(particles.force, force[0], force[1], force[2]);
  store_vectors(particles.torque, torque[0], torque[1], torque[2]);
  const auto sum = [](const SimdPack &values) { return (values[0] + values[1]) + (values[2] + values[3]); };
  return {sum(power.at_step + of_rotations.at_step), sum(power.half_back + of_rotations.half_back)};
}
} // namespace kerf::dem
