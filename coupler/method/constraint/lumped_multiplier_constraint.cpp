// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/lumped_multiplier_constraint.h"

#include "coupler/method/constraint/exchange/begin_exchange.h"
namespace kerf
{
LumpedMultiplierConstraint::LumpedMultiplierConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), interpolation(packing, WindowNodes::own, settings.comm),
    work(settings.time_step, settings.comm)
{
}

std::unique_ptr<Constraint> make_lumped_multipliers(const ConstraintModel &model)
{
  return std::make_unique<LumpedMultiplierConstraint>(
    LumpedMultiplierConstraint::Settings{model.comm, 0., model.settings.penalty_ratio}, *model.packing);
}

void LumpedMultiplierConstraint::set_time_step(double dt)
{
  settings.time_step = dt;
  work = InterfaceWork(dt, settings.comm);
}

void LumpedMultiplierConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  interpolation.set_particles(particles);
}

void LumpedMultiplierConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  if (interpolation.n_particles() == 0)
    return;
  if (packing.dim == 2)
    apply(ties_2d, phase, particles, fem);
  else
    apply(ties_3d, phase, particles, fem);
}

template <int dim>
void LumpedMultiplierConstraint::renew(Ties<dim> &ties, const dem::Particles &particles, fem::FemSide &fem)
{
  const std::vector<double> mass = interpolation.tied_masses(particles, fem); // 1/D_i
  fem.read_window(fem::NodalField::inverse_mass, inverse_node_mass);
  couples.renew(fem.mesh(), interpolation.window(), inverse_node_mass);
  ties.cells.assign(interpolation, fem.mesh(), packing);
  ties.loads.renew(ties.cells, particles);
  ties.pulled = ties.cells.lanes_of([&](std::size_t k) { return interpolation.entries()[k].share * mass[k]; });
  ties.inverse_mass.assign(ties.cells, interpolation, particles);
}

template <int dim>
void LumpedMultiplierConstraint::apply(Ties<dim> &ties, dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  const double dt = settings.time_step,
               tau = begin_exchange<dim>(phase, particles, fem, packing, dt, interpolation, ties.cells, ties.loads, work,
                                         {displacement, velocity, force}, settings.comm, [&] { renew(ties, particles, fem); });
  ahead = velocity + tau * inverse_node_mass.cwiseProduct(force);
  const double power =
    packing.periodic.isZero(0.) ? pull<dim, false>(ties, tau, particles) : pull<dim, true>(ties, tau, particles);
  if (phase == dem::Phase::step)
    work.add_energy(0.5 * dt * power);
  fem.add_window_forces(node_force);
  work.end(node_force, velocity);
}

/// Adds the forces. Returns the power on the particles of the forces of the previous step and of the new ones [W]. The
/// expression dchi/dt + kappa chi/dt is linear in velocities and positions, so it is the difference of one nodal field and one
/// vector of the particle.
template <int dim, bool periodic>
double LumpedMultiplierConstraint::pull(Ties<dim> &ties, double tau, dem::Particles &particles)
{
  using Vectors = PackedVectors<dim>;
  constexpr int corners = CellBatches<dim>::corners;
  const double closing = settings.closing / settings.time_step, rate_of_tau = 1. / tau;
  node_force.setZero(3, interpolation.n_window());
  target = ahead + closing * displacement;
  SimdPack power = {};
  typename Vectors::Couple of_particles, of_nodes; // moments about the origin
  int k = 0;
  for (const auto &cell : ties.cells.cells())
  {
    SimdPack place[corners], rate[corners], given[corners] = {};
    ties.cells.places(cell, target, rate, closing);
    if (periodic)
      ties.cells.places(cell, displacement, place);
    for (; k < cell.end; ++k)
    {
      ties.cells.fetch_after(k, particles.position, particles.velocity, particles.force);
      ties.loads.fetch_after(k);
      ties.inverse_mass.fetch_after(k);
      fetch_after(ties.pulled, k);
      const auto &batch = ties.cells.batches()[k];
#pragma GCC unroll 2
      for (int p = 0; p < n_packs<dim>; ++p)
      {
        const auto *at = batch.begins(p);
        const auto xi = batch.place(p);
        const SimdPack own_velocity = Vectors::load(particles.velocity.data(), at),
                       own_force = Vectors::load(particles.force.data(), at);
        SimdPack position = Vectors::load(particles.position.data(), at);
        if (periodic) // the periodic image closest to the finite-element position
          position = value_of(place, xi) - CellBatches<dim>::template minus_chi<true>(place, xi, position, packing.periodic);
        const SimdPack asked =
          value_of(rate, xi) - own_velocity - closing * position - tau * ties.inverse_mass.of(k, p, cell) * own_force;
        const SimdPack force = rate_of_tau * Vectors::spread(ties.pulled[k], p) * asked;
        Vectors::store(particles.force.data(), at, own_force + force);
        power += ties.loads.exchange(n_packs<dim> * k + p, force) * own_velocity;
        of_particles.add(position, force);
        add_moments(force, xi, given);
      }
    }
    if (!periodic)
      ties.cells.places(cell, displacement, place);
    for (int m = 0; m < corners; ++m)
      of_nodes.add(place[m], given[m]);
    ties.cells.scatter(cell, given, -1., node_force);
  }
  couples.add(of_nodes.sum() - of_particles.sum(), displacement, node_force);
  return sum_of(power);
}
} // namespace kerf
