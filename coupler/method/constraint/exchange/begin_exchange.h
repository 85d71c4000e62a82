// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/interface_work.h"
#include "coupler/method/constraint/exchange/cell_batches.h"
#include "coupler/method/constraint/exchange/force_history.h"
#include "coupler/method/constraint/exchange/particle_interpolation.h"

namespace kerf
{
/// Fields of the nodal window, 3 x n_window.
struct WindowFields
{
  Eigen::Matrix3Xd &displacement, &velocity, &force; ///< [m], [m/s], [N]
};

/// The beginning of every exchange that constrains velocities: counts the work of the last step's forces, follows particles
/// that moved in their arrays or to other ranks, and reads the nodal fields. Calls @p renew when the tied particles are others.
/// Returns the time over which the forces of this exchange act [s]: the velocity is v^{n-1/2} in a step and the forces advance
/// it to v^{n+1/2}; after a setup they advance it by half a step. @p dt time step [s]. Collective.
template <int dim, typename Renew>
double begin_exchange(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem, const dem::Packing &packing, double dt,
                      ParticleInterpolation &interpolation, CellBatches<dim> &cells, ForceHistory<dim> &loads,
                      InterfaceWork &work, const WindowFields &fields, MPI_Comm comm, const Renew &renew)
{
  const bool stepping = phase == dem::Phase::step;
  if (stepping)
    fem.read_window(fem::NodalField::velocity, fields.velocity); // while the window is that of the step before
  work.begin(phase, particles, fields.velocity);
  const InterpolationChange change = interpolation.update(particles, fem);
  work.add_energy(loads.follow(phase, change, interpolation, cells, particles, dt, packing.size(), comm));
  if (change == InterpolationChange::renewed)
    renew();
  if (change == InterpolationChange::renewed || !stepping)
    fem.read_window(fem::NodalField::velocity, fields.velocity);
  fem.read_window(fem::NodalField::displacement, fields.displacement);
  fem.read_window(fem::NodalField::force, fields.force);
  return stepping ? dt : 0.5 * dt;
}
} // namespace kerf
