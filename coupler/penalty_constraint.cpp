// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/penalty_constraint.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
double penalty_stiffness(const PenaltyConstraint::Settings &settings, double share, double mu)
{
  if (mu <= 0.)
    return 0.;
  return share * (settings.mass_scaled ? settings.beta * mu / (settings.time_step * settings.time_step) : settings.stiffness);
}

double penalty_viscosity(const PenaltyConstraint::Settings &settings, double share, double mu)
{
  return 2. * settings.damping * std::sqrt(penalty_stiffness(settings, share, mu) * share * mu);
}

PenaltyConstraint::PenaltyConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), links(packing, WindowNodes::own, settings.comm),
    damping_work(settings.time_step, settings.comm)
{
}

void PenaltyConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  links.set_particles(particles);
}

void PenaltyConstraint::choose_springs(const dem::Particles &particles, fem::FemSide &fem)
{
  const std::vector<double> masses = links.tied_masses(particles, fem);
  stiffness.clear();
  viscosity.clear();
  for (std::size_t k = 0; k < masses.size(); ++k)
  {
    const double share = links.links()[k].share;
    stiffness.push_back(penalty_stiffness(settings, share, masses[k]));
    viscosity.push_back(penalty_viscosity(settings, share, masses[k]));
  }
}

template <int dim>
void PenaltyConstraint::pull(Springs<dim> &springs, LinkChange change, dem::Particles &particles)
{
  if (change == LinkChange::renewed)
  {
    springs.cells.assign(links);
    springs.stiffness = springs.cells.lanes_of([this](std::size_t k) { return stiffness[k]; });
  }
  else if (change == LinkChange::renumbered)
    springs.cells.renumber(links);
  packing.periodic.isZero(0.) ? pull<dim, false>(springs, particles) : pull<dim, true>(springs, particles);
}

/// f_i = -k_i chi_i and its reaction.
template <int dim, bool periodic>
void PenaltyConstraint::pull(const Springs<dim> &springs, dem::Particles &particles)
{
  constexpr int corners = LinkCells<dim>::corners;
  LinkLanes energy = {};
  std::size_t k = 0;
  for (const auto &cell : springs.cells.cells())
  {
    double u[dim][corners];
    LinkLanes reaction[dim][corners] = {};
    for (int c = 0; c < dim; ++c)
      for (int a = 0; a < corners; ++a)
        u[c][a] = node_displacement(c, cell.node[a]);
    for (; static_cast<int>(k) < cell.end; ++k)
    {
      const auto &batch = springs.cells.batches()[k];
      const auto position = load_vectors<dim>(particles.position.data(), batch.particle);
      std::array<LinkLanes, dim> force;
      for (int c = 0; c < dim; ++c)
      {
        LinkLanes chi = position[c] - batch.origin[c];
        for (int a = 0; a < corners; ++a)
          chi -= batch.N[a] * u[c][a];
        if (periodic && packing.periodic[c] > 0.)
          wrap_lanes(chi, packing.periodic[c]);
        force[c] = springs.stiffness[k] * chi;
        for (int a = 0; a < corners; ++a)
          reaction[c][a] += batch.N[a] * force[c];
        energy += 0.5 * force[c] * chi;
      }
      subtract_vectors<dim>(particles.force.data(), batch.particle, force);
    }
    for (int c = 0; c < dim; ++c)
      for (int a = 0; a < corners; ++a)
        node_force(c, cell.node[a]) += sum_of(reaction[c][a]);
  }
  stored = sum_of(energy);
}

Eigen::VectorXd PenaltyConstraint::springs() const
{
  Eigen::VectorXd result = Eigen::VectorXd::Zero(n_local);
  for (std::size_t k = 0; k < links.links().size(); ++k)
    result[links.links()[k].particle] = stiffness[k];
  return result;
}

void PenaltyConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  if (links.n_particles() == 0)
    return;
  if (settings.damping > 0.)
    damping_work.begin(phase, particles, fem);
  n_local = particles.n;
  const LinkChange change = links.update(particles, fem);
  if (change == LinkChange::renewed)
    choose_springs(particles, fem);

  fem.read_window(fem::NodalField::displacement, node_displacement);
  node_force.setZero(3, links.n_window());
  if (packing.dim == 2)
    pull(springs_2d, change, particles);
  else
    pull(springs_3d, change, particles);
  fem.add_window_forces(node_force);
  if (settings.damping > 0.)
    add_damping(particles, fem);
}

/// Damping looks at the velocities of the half step before.
void PenaltyConstraint::add_damping(dem::Particles &particles, fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::velocity, node_velocity);
  node_force.setZero();
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const Eigen::Vector3d force = viscosity[k] * OverlapLinks::gap(link, particles.velocity, node_velocity);
    const Eigen::Vector3d couple = links.displacement_gap(link, particles, node_displacement).cross(force);
    particles.force.col(link.particle) -= force;
    particles.torque.col(link.particle) += couple;
    damping_work.add(particles, link.particle, -force, couple);
    OverlapLinks::spread(link, force, node_force);
  }
  fem.add_window_forces(node_force);
  damping_work.end(node_force, node_velocity);
}
} // namespace kerf
