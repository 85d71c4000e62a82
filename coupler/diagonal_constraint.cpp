// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/diagonal_constraint.h"

namespace kerf
{
DiagonalConstraint::DiagonalConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), links(packing, WindowNodes::own, settings.comm),
    work(settings.time_step, settings.comm)
{
}

void DiagonalConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  links.set_particles(particles);
}

void DiagonalConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  if (links.n_particles() == 0)
    return;
  if (packing.dim == 2)
    apply(ties_2d, phase, particles, fem);
  else
    apply(ties_3d, phase, particles, fem);
}

template <int dim>
void DiagonalConstraint::renew(Ties<dim> &ties, const dem::Particles &particles, fem::FemSide &fem)
{
  const std::vector<double> mass = links.tied_masses(particles, fem); // 1/D_i
  fem.read_window(fem::NodalField::inverse_mass, inverse_node_mass);
  couples.renew(fem.mesh(), links.window(), inverse_node_mass);
  ties.cells.assign(links, fem.mesh(), packing);
  ties.loads.renew(ties.cells, particles);
  ties.pulled = ties.cells.lanes_of([&](std::size_t k) { return links.links()[k].share * mass[k]; });
  ties.mobility.assign(ties.cells, links, particles);
}

template <int dim>
void DiagonalConstraint::apply(Ties<dim> &ties, dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  const bool stepping = phase == dem::Phase::step;
  const double dt = settings.time_step;
  work.begin(phase, particles, fem); // while the window is that of the step before
  const LinkChange change = links.update(particles, fem);
  work.add_energy(ties.loads.follow(phase, change, links, ties.cells, particles, dt, packing.size(), settings.comm));
  if (change == LinkChange::renewed)
    renew(ties, particles, fem);

  fem.read_window(fem::NodalField::displacement, displacement);
  fem.read_window(fem::NodalField::velocity, velocity);
  fem.read_window(fem::NodalField::force, force);
  // In a step the hook sees v^{n-1/2} and the forces lead to v^{n+1/2}; after a setup half a step leads there.
  const double tau = stepping ? dt : 0.5 * dt;
  ahead = velocity + tau * inverse_node_mass.cwiseProduct(force);
  const double power =
    packing.periodic.isZero(0.) ? pull<dim, false>(ties, tau, particles) : pull<dim, true>(ties, tau, particles);
  if (stepping)
    work.add_energy(0.5 * dt * power);
  fem.add_window_forces(node_force);
  work.end(node_force, velocity);
}

/// Adds the forces. Returns the power of the forces of the step before and of these on the particles [W].
template <int dim, bool periodic>
double DiagonalConstraint::pull(Ties<dim> &ties, double tau, dem::Particles &particles)
{
  constexpr int corners = LinkCells<dim>::corners;
  const double closing = settings.closing / settings.time_step, rate_of_tau = 1. / tau;
  node_force.setZero(3, links.n_window());
  LinkLanes power = {}, couple[3] = {};
  int k = 0;
  for (const auto &cell : ties.cells.cells())
  {
    double place[dim][corners], v[dim][corners];
    ties.cells.places(cell, displacement, place);
    ties.cells.coefficients(cell, ahead, v);
    const int begin = k;
    for (; k < cell.end; ++k)
    {
      ties.cells.fetch_after(k, particles.position, particles.velocity, particles.force);
      const auto &batch = ties.cells.batches()[k];
      const auto monomials = batch.monomials();
      const auto inverse_mass = ties.mobility.of(k, cell);
      const auto position = load_vectors<dim>(particles.position.data(), batch.particle),
                 own_velocity = load_vectors<dim>(particles.velocity.data(), batch.particle),
                 own_force = load_vectors<dim>(particles.force.data(), batch.particle);
      std::array<LinkLanes, dim> gap, force;
      for (int c = 0; c < dim; ++c)
      {
        gap[c] = value_of(place[c], monomials) - position[c]; // -chi
        const LinkLanes rate = value_of(v[c], monomials) - own_velocity[c] - tau * inverse_mass[c] * own_force[c];
        if (periodic && packing.periodic[c] > 0.)
          wrap_lanes(gap[c], packing.periodic[c]);
        force[c] = rate_of_tau * ties.pulled[k] * (rate + closing * gap[c]);
        power += (ties.loads.force[k][c] + force[c]) * own_velocity[c];
        ties.loads.force[k][c] = force[c];
      }
      add_vectors<dim>(particles.force.data(), batch.particle, force);
      add_moments(gap, force, couple);
    }
    for (int c = 0; c < dim; ++c)
      ties.cells.scatter(
        cell, begin, [&](int batch) { return -ties.loads.force[batch][c]; }, c, node_force);
  }
  couples.add(Eigen::Vector3d(sum_of(couple[0]), sum_of(couple[1]), sum_of(couple[2])), displacement, node_force);
  return sum_of(power);
}
} // namespace kerf
